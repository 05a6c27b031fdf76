# SPDX-License-Identifier: Apache-2.0
from os import PathLike
from typing import Any, Mapping

import numpy as np
from numpy.typing import NDArray

class Recording:
    name: str
    serial: str
    sensors: dict[str, dict[str, Any]]
    accelerometer: NDArray[np.float64] | None
    gyroscope: NDArray[np.float64] | None
    magnetometer: NDArray[np.float64] | None
    def __init__(
        self,
        data: Mapping[str, Any],
        units: Mapping[str, str] | None = None,
        *,
        rate_hz: float | None = None,
        name: str = "recording",
        serial: str = "",
    ) -> None: ...
    def time(self, sensor: str) -> NDArray[np.float64] | None: ...
    def temperature(self, sensor: str) -> NDArray[np.float64] | None: ...
    def save(self, folder: str | PathLike[str]) -> str: ...
