# SPDX-License-Identifier: Apache-2.0
"""Recordings in memory. NumPy is imported when the first Recording is made."""
from types import MappingProxyType

from . import Usage, _truetriad

SENSORS = ("accelerometer", "gyroscope", "magnetometer")
_PREFIXES = {"accel": "accelerometer", "gyro": "gyroscope", "mag": "magnetometer"}
_SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}


def _column(name):
    """The parts of a column's name: ("accel", "x", None, "m/s^2", None) for "accel_x[m/s^2]"; None for other names."""
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

    The arrays are copied, and the copies are read-only: changes to yours later change no calibration.
    Masked values are NaN. time may hold datetime64 or timedelta64.

    units: unit of each sensor, {"gyroscope": "deg/s"}; m/s^2, rad/s and uT must be stated, too: a unit is
    never guessed. rate_hz: in place of time, if times are even.
    name stands for the file in messages and results.
    """

    def __init__(self, data, units=None, *, rate_hz=None, name="recording", serial=""):
        self.name, self.serial = str(name), str(serial)
        if not hasattr(units or {}, "keys"):
            raise _fail(f"{name}: units is {units!r}; expected a mapping, as {{\"accelerometer\": \"g\"}}")
        units = dict(units or {})
        for sensor in units:
            if sensor not in SENSORS:
                raise _fail(f"{name}: units has `{sensor}`; expected {', '.join(SENSORS)}")
        if not hasattr(data, "keys"):
            raise _fail(f"{name}: expected a mapping of arrays, as {{\"time\": t, \"accelerometer\": a}}, or a "
                        f"DataFrame; not {type(data).__name__}")
        if any("[" in str(key) for key in data.keys()):
            data, units = _columns(data, units)
        shared = {key: data[key] for key in ("time", "time_ns", "temperature", "pose") if key in data}
        sensors = {}
        unknown = [key for key in data.keys() if key not in SENSORS and key not in shared]
        if unknown:
            raise _fail(f"{name}: `{unknown[0]}` is not known; expected {', '.join(SENSORS)}, time, "
                        "time_ns, temperature or pose")
        for sensor in SENSORS:
            if sensor not in data:
                continue
            stated = data[sensor]
            # The columns of a table are the readings themselves; the keys of a dict are the keys of _OF_SENSOR.
            is_table = not hasattr(stated, "keys") or hasattr(stated, "columns")
            stated = {"readings": stated} if is_table else dict(stated)
            unknown = [key for key in stated if key not in _OF_SENSOR]
            if unknown or "readings" not in stated:
                raise _fail(f"{name}: the {sensor} has "
                            + (f"`{unknown[0]}`, which is not known" if unknown else "no readings")
                            + f"; expected {', '.join(_OF_SENSOR)}")
            unit = stated.pop("unit", None) or units.get(sensor)
            if not isinstance(unit, (str, type(None))):
                raise _fail(f"{name}: the unit of the {sensor} is {unit!r}; expected a text, as "
                            f"\"{_EXAMPLE[sensor]}\"")
            if unit is None:
                raise _fail(f"{name}: the {sensor} has no unit; state it, as in "
                            f"units={{\"{sensor}\": \"{_EXAMPLE[sensor]}\"}}")
            common = dict(shared)
            if "time" in stated or "time_ns" in stated:  # Instead of the shared time.
                common.pop("time", None), common.pop("time_ns", None)
            sensors[sensor] = MappingProxyType(self._stream(sensor, {**common, **stated}, unit, rate_hz))
        self.sensors = MappingProxyType(sensors)

    def _stream(self, sensor, stated, unit, rate_hz):
        import numpy as np
        what = f"{self.name}: {sensor}"
        readings = _truetriad.numbers(stated["readings"], what)
        if readings.ndim != 2 or readings.shape[1] != 3:
            hint = "; give its transpose, .T" if readings.ndim == 2 and readings.shape[0] == 3 else ""
            raise _fail(f"{what} has the shape {readings.shape}; expected (N, 3){hint}")
        stream = {"unit": unit, "readings": readings}
        if "time" in stated and "time_ns" in stated:
            raise _fail(f"{what}: time and time_ns are both stated; leave one out")
        if rate_hz is not None:
            if "time" in stated or "time_ns" in stated:
                raise _fail(f"{self.name}: rate_hz and time are both stated; leave one out")
            if not _is_number(rate_hz) or not 0 < rate_hz < float("inf"):
                raise _fail(f"{self.name}: rate_hz is {rate_hz!r}; expected a number > 0")
            stream["time_ns"] = _nanoseconds(np.arange(len(readings)) / rate_hz, what)
        elif "time_ns" in stated:
            if np.asarray(stated["time_ns"]).dtype.kind not in "iu":
                raise _fail(f"{what}: time_ns must be integers; give seconds as `time`")
            stream["time_ns"] = _integers(stated["time_ns"], f"{what}, time_ns", np.int64)
        elif "time" in stated:
            stream["time_ns"] = _nanoseconds(stated["time"], what)
        if "temperature" in stated:
            stream["temperature"] = _truetriad.numbers(stated["temperature"], f"{what}, temperature")
            infinite = np.isinf(stream["temperature"])
            if infinite.any():
                raise _fail(f"{what}, row {infinite.argmax()}: the temperature is infinite; use NaN for an "
                            "unknown one")
        if "pose" in stated:
            stream["pose"] = _integers(stated["pose"], f"{what}, pose", np.int32)
        for key in ("time_ns", "temperature", "pose"):
            if key in stream and stream[key].shape != (len(readings),):
                raise _fail(f"{what} has {len(readings)} readings, but {key.split('_')[0]} has the shape "
                            f"{stream[key].shape}")
        for key, values in stream.items():
            if key != "unit":
                stream[key] = np.array(values)
                stream[key].flags.writeable = False
        return stream

    def __getattr__(self, sensor):
        if sensor in SENSORS:
            stream = self.__dict__.get("sensors", {}).get(sensor)
            return None if stream is None else stream["readings"]
        raise AttributeError(sensor)

    def time(self, sensor):
        """Times of the sensor's readings, (N,), s; None without times."""
        time_ns = self.sensors[sensor].get("time_ns")
        return None if time_ns is None else time_ns * 1e-9

    def temperature(self, sensor):
        """Temperatures at the sensor's readings, (N,), degC; None without temperature."""
        return self.sensors[sensor].get("temperature")

    def save(self, folder):
        """Writes folder/recording.yaml and its CSV; returns the path of recording.yaml."""
        return self._core().save(folder)

    def _core(self):
        """The recording as a C++ object, which holds copies of the arrays."""
        key = self.name, self.serial
        made, core = self.__dict__.get("_made", (None, None))
        if made != key:
            core = _truetriad.ArrayRecording(*(str(text).encode("utf-8", "surrogateescape") for text in key))
            for sensor, stream in self.sensors.items():
                core.add(sensor, stream["unit"], stream["readings"], stream.get("time_ns"),
                         stream.get("temperature"), stream.get("pose"))
            core.settle()
            self._made = key, core
        return core

    def __reduce__(self):
        data = {sensor: dict(stream) for sensor, stream in self.sensors.items()}
        return _again, (data, self.name, self.serial)

    def __copy__(self):
        return _again({sensor: dict(stream) for sensor, stream in self.sensors.items()}, self.name, self.serial)

    def __repr__(self):
        parts = (f"{sensor} {len(stream['readings'])} x 3 {stream['unit']}"
                 for sensor, stream in self.sensors.items())
        return f"<truetriad.Recording {self.name}: {', '.join(parts)}>"


def _again(data, name, serial):
    return Recording(data, name=name, serial=serial)


def _is_number(value):
    """Whether value is a single number of Python or NumPy."""
    return isinstance(value, (int, float)) or getattr(value, "shape", None) == () and hasattr(value, "__float__")


def _integers(values, what, type_):
    """The values as an array of type_; refuses values that are no integers or do not fit."""
    import numpy as np
    array = np.asarray(values)
    if array.dtype.kind not in "iu" or np.ma.isMaskedArray(values):
        numbers = _truetriad.numbers(values, what)
        wrong = ~(np.rint(numbers) == numbers)
        if wrong.any():
            raise _fail(f"{what}, row {wrong.argmax()}: {numbers[wrong][0]} is no integer")
        array = numbers
    range_ = np.iinfo(type_)
    if array.size and not range_.min <= array.min() <= array.max() <= range_.max:
        raise _fail(f"{what}: values do not fit into {range_.bits} bits")
    return array.astype(type_)


def _nanoseconds(values, what):
    """Times in s, datetime64 or timedelta64 as (N,) integers, ns."""
    import numpy as np
    array = np.asarray(values)
    if array.dtype.kind in "mM":
        missing = np.isnat(array) | np.ma.getmaskarray(values)
        if missing.any():
            raise _fail(f"{what}, row {missing.argmax()}: time is NaT; drop the row")
        in_ns = array.astype(f"{array.dtype.kind}8[ns]")
        if (in_ns.astype(array.dtype) != array).any():
            raise _fail(f"{what}: times have a finer unit than ns, or are too far from 1970 to be held in ns")
        return in_ns.astype(np.int64)
    time = _truetriad.numbers(values, f"{what}, time")
    wrong = ~(np.abs(time) < 9.2e9)  # In ns, times below this limit fit into 64 bits.
    if wrong.any():
        raise _fail(f"{what}, row {wrong.argmax()}: time is {time[wrong][0]}; expected seconds"
                    ", with none missing")
    return np.rint(time * 1e9).astype(np.int64)


_OF_SENSOR = ("readings", "unit", "time", "time_ns", "temperature", "pose")
_EXAMPLE = {"accelerometer": "m/s^2", "gyroscope": "rad/s", "magnetometer": "uT"}


def _columns(table, units):
    """The data and units of a table with columns named as in a self-describing CSV."""
    import numpy as np
    data, axes = {}, {}
    for column in table.keys():
        found = _column(column)
        if not found:
            raise _fail(f"column `{column}` is not known; expected names as in a CSV (docs/recordings.md), "
                        "or leave it out")
        prefix, axis, other, unit, pose = found
        values = table[column]
        if prefix:
            of_sensor = axes.setdefault(_PREFIXES[prefix], {})
            if axis in of_sensor:
                raise _fail(f"column `{column}` is a second {prefix}_{axis}; leave one out")
            of_sensor[axis] = (_truetriad.numbers(values, f"column `{column}`"), unit)
        elif other == "time":
            if unit not in _SECONDS:
                raise _fail(f"column `{column}`: unknown unit of time; expected s, ms, us or ns")
            if "time" in data or "time_ns" in data:
                raise _fail(f"column `{column}` is a second time column; leave one of the two out")
            if unit == "ns" and np.asarray(values).dtype.kind in "iu":
                data["time_ns"] = values
            elif np.asarray(values).dtype.kind in "mM":  # These types have a unit of their own.
                data["time"] = values
            else:
                data["time"] = _truetriad.numbers(values, f"column `{column}`") * _SECONDS[unit]
        elif other:
            if unit not in ("degC", "K"):
                raise _fail(f"column `{column}`: unknown unit of temperature; expected degC or K")
            if "temperature" in data:
                raise _fail(f"column `{column}` is a second temperature column; leave one of the two out")
            values = _truetriad.numbers(values, f"column `{column}`")
            data["temperature"] = values - 273.15 if unit == "K" else values
        else:
            data[pose] = values
    for sensor, columns in axes.items():
        if sorted(columns) != ["x", "y", "z"] or len({unit for _, unit in columns.values()}) != 1:
            raise _fail(f"the {sensor} needs columns x, y and z in one unit; found "
                        + ", ".join(f"{axis}[{unit}]" for axis, (_, unit) in sorted(columns.items())))
        data[sensor] = np.column_stack([columns[axis][0] for axis in "xyz"])
        unit = columns["x"][1]
        if units.setdefault(sensor, unit) != unit:
            raise _fail(f"the {sensor} is in {unit} by its column names, but in {units[sensor]} by units=; "
                        "leave units= out, or rename the columns")
    return data, units
