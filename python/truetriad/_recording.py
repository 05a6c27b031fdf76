# SPDX-License-Identifier: Apache-2.0
"""Recordings in memory. NumPy is imported when the first is made."""
from . import Usage, _truetriad

SENSORS = ("accelerometer", "gyroscope", "magnetometer")
_PREFIXES = {"accel": "accelerometer", "gyro": "gyroscope", "mag": "magnetometer"}
_SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}


def _column(name):
    """("accel", "x", None, "m/s^2", None) of "accel_x[m/s^2]"; None of another name."""
    import re
    match = re.fullmatch(r"(?:(accel|gyro|mag)_([xyz])|(time|temperature))\[(.+)\]|(pose)", str(name))
    return match and match.groups()


def _fail(text):
    error = Usage(text)
    error.code, error.message = "invalid-argument", text
    return error


class Recording:
    """Readings of one unit in memory, as NumPy arrays.

    data, a mapping, is one of
      {"time": t, "accelerometer": a, "magnetometer": m, "temperature": T}: arrays that share a time;
      {"accelerometer": {"time": t, "readings": a, "temperature": T}, …}: each sensor with its own;
      a pandas DataFrame or a mapping whose columns are named as in a CSV: "time[s]", "accel_x[m/s^2]", ….
    Shapes: readings (N, 3), raw; time (N,), s, not decreasing; temperature (N,), degC; pose (N,) integers, 0
    where the unit moves. "time_ns" (integers) in place of "time" is exact. Rows with NaN readings are
    dropped, as empty fields are.

    units: unit of each sensor, {"gyroscope": "deg/s"}; else m/s^2, rad/s and uT must be stated, too:
    a unit is never guessed. rate_hz: in place of time, for even times.
    name stands for the file in messages and results.
    """

    def __init__(self, data, units=None, *, rate_hz=None, name="recording", serial=""):
        self.name, self.serial = name, serial
        self.sensors = {}
        units = dict(units or {})
        if not hasattr(data, "keys"):
            raise _fail(f"{name}: expected a mapping of arrays, as {{\"time\": t, \"accelerometer\": a}}, or a "
                        f"DataFrame; not {type(data).__name__}")
        if any("[" in str(key) for key in data.keys()):
            data, units = _columns(data, units)
        shared = {key: data[key] for key in ("time", "time_ns", "temperature", "pose") if key in data}
        unknown = [key for key in data.keys() if key not in SENSORS and key not in shared]
        if unknown:
            raise _fail(f"{name}: `{unknown[0]}` is not known; expected {', '.join(SENSORS)}, time, "
                        "time_ns, temperature or pose")
        for sensor in SENSORS:
            if sensor not in data:
                continue
            stated = data[sensor]
            stated = dict(stated) if hasattr(stated, "keys") else {"readings": stated}
            unit = stated.pop("unit", None) or units.get(sensor)
            if unit is None:
                raise _fail(f"{name}: the {sensor} has no unit; state it, as in "
                            f"units={{\"{sensor}\": \"{_EXAMPLE[sensor]}\"}}")
            self.sensors[sensor] = self._stream(sensor, {**shared, **stated}, unit, rate_hz)
        self._core_of = None

    def _stream(self, sensor, stated, unit, rate_hz):
        import numpy as np
        readings = np.ascontiguousarray(stated["readings"], dtype=np.float64)
        if readings.ndim != 2 or readings.shape[1] != 3:
            raise _fail(f"{self.name}: {sensor} has the shape {readings.shape}; expected (N, 3)")
        stream = {"unit": unit, "readings": readings}
        if rate_hz is not None:
            if "time" in stated or "time_ns" in stated:
                raise _fail(f"{self.name}: rate_hz and time are both stated; leave one out")
            if not rate_hz > 0:
                raise _fail(f"{self.name}: rate_hz is {rate_hz}; expected > 0")
            stated = {**stated, "time": np.arange(len(readings)) / rate_hz}
        if "time_ns" in stated:
            stream["time_ns"] = np.ascontiguousarray(stated["time_ns"])
            if stream["time_ns"].dtype.kind not in "iu":
                raise _fail(f"{self.name}: time_ns must be integers; state seconds as time")
        elif "time" in stated:
            time = np.asarray(stated["time"], dtype=np.float64)
            missing = ~np.isfinite(time)
            if missing.any():
                raise _fail(f"{self.name}: {sensor}, row {missing.argmax()}: time is {time[missing][0]}")
            stream["time_ns"] = np.rint(time * 1e9).astype(np.int64)
        for key in ("temperature", "pose"):
            if key in stated:
                stream[key] = np.ascontiguousarray(stated[key], dtype=np.float64)
        for key in ("time_ns", "temperature", "pose"):
            if key in stream and stream[key].shape != (len(readings),):
                raise _fail(f"{self.name}: {sensor} has {len(readings)} readings, but {key} has the shape "
                            f"{stream[key].shape}")
        return stream

    def __getattr__(self, sensor):
        if sensor in SENSORS:
            stream = self.__dict__.get("sensors", {}).get(sensor)
            return None if stream is None else stream["readings"]
        raise AttributeError(sensor)

    def time(self, sensor):
        """(N,), s; None without times."""
        time_ns = self.sensors[sensor].get("time_ns")
        return None if time_ns is None else time_ns * 1e-9

    def temperature(self, sensor):
        """(N,), degC; None where there is none."""
        return self.sensors[sensor].get("temperature")

    def save(self, folder):
        """Writes folder/recording.yaml and its CSV; returns the path of recording.yaml."""
        return self._core().save(folder)

    def _core(self):
        """The same for C++, which copies it."""
        if self._core_of is None:
            core = _truetriad.ArrayRecording(self.name, self.serial)
            for sensor, stream in self.sensors.items():
                core.add(sensor, stream["unit"], stream["readings"], stream.get("time_ns"),
                         stream.get("temperature"), stream.get("pose"))
            core.settle()
            self._core_of = core
        return self._core_of

    def __repr__(self):
        parts = (f"{sensor} {len(stream['readings'])} x 3 {stream['unit']}"
                 for sensor, stream in self.sensors.items())
        return f"<truetriad.Recording {self.name}: {', '.join(parts)}>"


_EXAMPLE = {"accelerometer": "m/s^2", "gyroscope": "rad/s", "magnetometer": "uT"}


def _columns(table, units):
    """Columns named as in a self-describing CSV, as data and units."""
    import numpy as np
    data, axes = {}, {}
    for column in table.keys():
        found = _column(column)
        if not found:
            raise _fail(f"column `{column}` is not known; expected names as in a CSV (docs/recordings.md), "
                        "or leave it out")
        prefix, axis, other, unit, pose = found
        values = np.asarray(table[column])
        if prefix:
            axes.setdefault(_PREFIXES[prefix], {})[axis] = (values, unit)
        elif other == "time":
            if unit not in _SECONDS:
                raise _fail(f"column `{column}`: unknown unit of time; expected s, ms, us or ns")
            if unit == "ns" and values.dtype.kind in "iu":
                data["time_ns"] = values
            else:
                data["time"] = values * _SECONDS[unit]
        elif other:
            if unit not in ("degC", "K"):
                raise _fail(f"column `{column}`: unknown unit of temperature; expected degC or K")
            data["temperature"] = values - 273.15 if unit == "K" else values
        else:
            data[pose] = values
    for sensor, columns in axes.items():
        if sorted(columns) != ["x", "y", "z"] or len({unit for _, unit in columns.values()}) != 1:
            raise _fail(f"the {sensor} needs columns x, y and z in one unit; found "
                        + ", ".join(f"{axis}[{unit}]" for axis, (_, unit) in sorted(columns.items())))
        data[sensor] = np.column_stack([columns[axis][0] for axis in "xyz"])
        units.setdefault(sensor, columns["x"][1])
    return data, units
