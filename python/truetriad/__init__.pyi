# SPDX-License-Identifier: Apache-2.0
from os import PathLike
from typing import Any, Callable, Mapping, Sequence

from numpy.typing import ArrayLike

from ._answers import AllanDeviation as AllanDeviation
from ._answers import Comparison as Comparison
from ._answers import Covariance as Covariance
from ._answers import Evaluation as Evaluation
from ._answers import Plan as Plan
from ._recording import Recording as Recording
from ._truetriad import Calibration as Calibration
from ._truetriad import Finding as Finding
from ._truetriad import Sensor as Sensor

__version__: str

_Path = str | bytes | PathLike[str]
_Log = _Path | Recording | Mapping[str, Any]  # or a DataFrame
_Document = _Path | Mapping[str, Any]
_Progress = Callable[[float], object]

class Error(Exception):
    code: str
    message: str
    file: str | None
    line: int | None
    column: int | None

class Usage(Error, ValueError): ...
class BadInput(Error): ...
class NotEnough(Error): ...

def calibrate(
    recording: _Log | Sequence[_Log] | None = None,
    config: _Document | None = None,
    *,
    set: Mapping[str, Any] | None = None,
    units: Mapping[str, str] | None = None,
    folder: _Path | None = None,
    progress: _Progress | None = None,
) -> Calibration: ...
def load(path: _Path) -> Calibration: ...
def evaluate(
    calibration: Calibration | _Path,
    recording: _Log,
    *,
    units: Mapping[str, str] | None = None,
    poses: str = "",
    progress: _Progress | None = None,
) -> Evaluation: ...
def compare(a: Calibration | _Path, b: Calibration | _Path) -> Comparison: ...
def plan(
    config: _Document,
    measured: _Path | None = None,
    *,
    set: Mapping[str, Any] | None = None,
    progress: _Progress | None = None,
) -> Plan: ...
def allan(
    recording: _Path | Recording | ArrayLike,
    rate_hz: float | None = None,
    *,
    sensor: str = "gyroscope",
    unit: str = "rad/s",
    progress: _Progress | None = None,
) -> AllanDeviation: ...
def simulate(
    scenario: _Document,
    *,
    set: Mapping[str, Any] | None = None,
    unit: int = 0,
    progress: _Progress | None = None,
) -> tuple[Recording, Calibration]: ...
