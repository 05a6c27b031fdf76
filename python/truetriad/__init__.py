# SPDX-License-Identifier: Apache-2.0
"""Calibration of accelerometers, magnetometers and gyroscopes.

    import truetriad
    c = truetriad.calibrate("datasets/demo/recording.csv")
    print(c)
    truth = c.accelerometer.correct(raw)         # (N, 3), m/s^2

docs/python.md. Raw readings keep the unit of their log; truth is in m/s^2, rad/s and uT; time in s,
temperature in degC.
"""


class Error(Exception):
    """Why something failed.

    code: "missing-column", … (docs/reasons.md). message: the whole text. file, line, column: the place, or None.
    """

    code = ""
    message = ""
    file = None
    line = None
    column = None


class Usage(Error, ValueError):
    """The call itself is wrong (exit code 1 of the command line)."""


class BadInput(Error):
    """A file is malformed, or no number in it can be trusted (exit code 2)."""


class NotEnough(Error):
    """The data do not determine what was asked for (exit code 3). `calibrate` raises it only if the
    recording leads to no experiment; else it returns a calibration that is not usable."""


def _find_module():
    """Adds a checkout's build folder to the package's path, unless the compiled module is found without it."""
    import importlib.util
    import pathlib
    if importlib.util.find_spec("._truetriad", __name__) is None:
        checkout = pathlib.Path(__file__).resolve().parents[2]
        __path__.append(str(checkout / "build/python/truetriad"))
    if importlib.util.find_spec("._truetriad", __name__) is None:
        raise ImportError("truetriad's module is not built for this Python; run `tools/build.sh python` "
                          f"in {checkout} to build it")


_find_module()
from . import _truetriad as _core  # noqa: E402  it raises the errors above
from ._answers import AllanDeviation, Comparison, Covariance, Evaluation, Plan  # noqa: E402
from . import _notebook  # noqa: E402
from ._recording import Recording  # noqa: E402
from ._truetriad import Calibration, Finding, Sensor  # noqa: E402
from ._verbs import allan, calibrate, compare, evaluate, load, plan, simulate  # noqa: E402

__version__ = _core.version
__all__ = [
    "AllanDeviation", "BadInput", "Calibration", "Comparison", "Covariance", "Error", "Evaluation",
    "Finding", "NotEnough", "Plan", "Recording", "Sensor", "Usage", "allan", "calibrate", "compare",
    "evaluate", "load", "plan", "simulate",
]


def _to_dict(self):
    """What calibration.yaml holds, as dicts, lists, numbers and texts."""
    import json
    return json.loads(self._json)


Calibration.to_dict = _to_dict
Calibration._repr_html_ = _notebook._repr_html_
Calibration.plot = _notebook.plot
Calibration.to_frame = _notebook.to_frame
Calibration.covariance = property(
    lambda self: Covariance(*self._covariance),
    doc="The covariance of all parameters, in the stated gauge: names and a NumPy matrix.")
