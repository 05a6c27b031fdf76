# SPDX-License-Identifier: Apache-2.0
"""The verbs of the command line, as functions."""
import os

from . import Calibration, _truetriad
from ._answers import AllanDeviation, Comparison, Evaluation, Plan
from ._recording import SENSORS, Recording, _fail, _is_number


def calibrate(recording=None, config=None, *, set=None, units=None, folder=None, progress=None):
    """Calibrates as `truetriad calibrate` does: the same recording and config give the same bytes.

    recording: path of a log, a Recording, what a Recording is made of (arrays, a DataFrame; with units=),
        or a list of these: sessions of one unit. None: the recordings that the config names.
    config: None (every sensor in the recording, with defaults), path of an experiment, or a dict with its
        keys (docs/experiments.md; paths in it are relative to the current folder).
    set: {"reference.gravity_mps2": 9.81}, keys that replace those of the config, as --set.
    folder: where the result will lie, as -o: the result states paths of recordings relative to this folder.
        Only without a config; default: LOG.truetriad.
    progress: called with the share of the recording that is read, 0…1, a few times a second.

    Returns a Calibration. Data that do not determine it raise no exception: usable is then False and
    findings say why. Raises BadInput, Usage, or NotEnough if the recording leads to no experiment.
    """
    files, recordings = _inputs(recording, units)
    folder = None if folder is None else _path(folder, "folder")
    return _truetriad.calibrate(files, recordings, _document(config, set), folder, _callable(progress))


def load(path):
    """Reads calibration.yaml."""
    return _truetriad.load(_path(path, "path"))


def evaluate(calibration, recording, *, units=None, poses="", progress=None):
    """Evaluates a calibration (or the path of one) on a recording from which it was not made.

    poses: where the poses are, as --poses: "detect", "every_row", "column:NAME", ….
    Raises NotEnough if no poses are found.
    """
    files, recordings = _inputs(recording, units)
    if len(files) + len(recordings) != 1:
        raise _fail("evaluate takes one recording")
    return Evaluation(_truetriad.evaluate(_calibration(calibration), files, recordings, str(poses), _callable(progress)))


def compare(a, b):
    """Whether two calibrations (or those at two paths) agree, in sigmas, both stated in one body frame."""
    return Comparison(_truetriad.compare(_calibration(a), _calibration(b)))


def plan(config, measured=None, *, set=None, progress=None):
    """Which poses to take, and how good the calibration will be. config: as for calibrate, with the key `plan:`.
    measured: path of a recording of poses that are already taken; progress is called while it is read."""
    measured = b"" if measured is None else _path(measured, "measured")
    return Plan(_truetriad.plan(_document(config, set), measured, _callable(progress)))


def allan(recording, rate_hz=None, *, sensor="gyroscope", unit="rad/s", progress=None):
    """Allan deviation of a unit at rest: noise density, bias instability, random walk of each axis.

    recording: path of a log, a Recording, or an array (N, 3): readings of `sensor` in `unit` at rate_hz.
    """
    if recording is None or hasattr(recording, "keys") and not hasattr(recording, "columns"):
        raise _fail("allan takes the path of a log, a Recording, or an array (N, 3); make a Recording of a mapping")
    if rate_hz is not None and not (_is_number(rate_hz) and 0 < rate_hz < float("inf")):
        raise _fail(f"rate_hz is {rate_hz!r}; expected a number > 0")
    if _is_path(recording) or isinstance(recording, Recording):
        files, recordings = _inputs(recording, None)
    else:
        if rate_hz is None:
            raise _fail("allan of an array needs rate_hz")
        if sensor not in SENSORS:
            raise _fail(f"sensor is `{sensor}`; expected {', '.join(SENSORS)}")
        files, recordings = _inputs(Recording({sensor: recording}, {sensor: unit}), None)
    return AllanDeviation(_truetriad.allan(files, recordings, float(rate_hz or 0.0), _callable(progress)))


def simulate(scenario, *, set=None, unit=0, progress=None):
    """Simulates what a unit with known errors records. scenario: path, or dict with its keys (docs/simulation.md).

    unit: one of the scenario's `count` units, from 0. Returns the Recording and a Calibration with the true values.
    """
    unit = _unit_of(unit)
    serial, streams, truth = _truetriad.simulate(_document(scenario, set), unit, _callable(progress))
    data = {}
    for sensor, of_readings, readings, time_ns, temperature in streams:
        data[sensor] = {"unit": of_readings, "readings": readings, "time_ns": time_ns}
        if temperature is not None:
            data[sensor]["temperature"] = temperature
    return Recording(data, name="simulation", serial=serial), truth


def _inputs(recording, units):
    """The input as (paths of files, recordings in memory); at least one of the two is empty."""
    if recording is None:
        return [], []
    several = list(recording) if isinstance(recording, (list, tuple)) else [recording]
    files = [_path(one, "recording") for one in several if _is_path(one)]
    if files and len(files) == len(several):
        if units:
            raise _fail("units= applies to arrays only; a file states its own units")
        return files, []
    if files:
        raise _fail("files and arrays cannot be mixed; read the files, or save the arrays")
    recordings, names = [], []
    for k, one in enumerate(several):
        if not isinstance(one, Recording):
            one = Recording(one, units, name="recording" if len(several) == 1 else f"recording-{k + 1}")
        if one.name in names:
            raise _fail(f"two recordings have the name `{one.name}`; give each its own, as in "
                        "Recording(…, name=\"cold\")")
        names.append(one.name)
        recordings.append(one._core())
    return [], recordings


def _is_path(value):
    return isinstance(value, (str, bytes, os.PathLike))


def _path(value, what):
    """The path as bytes, since names of files need not be UTF-8."""
    if not _is_path(value):
        raise _fail(f"{what} is of the type {type(value).__name__}; expected a path")
    name = os.fsencode(value)
    if not name or b"\0" in name:
        raise _fail(f"{what} is {value!r}; expected the name of a file")
    return name


def _callable(progress):
    if progress is not None and not callable(progress):
        raise _fail(f"progress is {progress!r}; expected a function that takes the share done, 0 to 1")
    return progress


def _unit_of(unit):
    import operator
    try:
        unit = operator.index(unit)
    except TypeError:
        raise _fail(f"unit is {unit!r}; expected an integer from 0") from None
    if not 0 <= unit < 2**31:
        raise _fail(f"unit is {unit}; units are numbered from 0 to the scenario's `count` - 1")
    return unit


def _plain(value):
    """Converts a value that JSON does not know (a path, a number or an array of NumPy) to one that it knows."""
    if _is_path(value):
        return os.fsdecode(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    raise _fail(f"a config has numbers, texts, lists and dicts; not {type(value).__name__}: {value!r}")


def _document(config, overrides):
    if overrides is not None and not hasattr(overrides, "items"):
        raise _fail(f"set is {overrides!r}; expected a mapping, as {{\"reference.gravity_mps2\": 9.81}}")
    if _is_path(config):
        path, text = _path(config, "config"), None
    elif config is None:
        path, text = None, None
    elif hasattr(config, "keys"):
        # One value per line, so that the line of an error identifies the value. JSON is YAML.
        path, text = None, _json(dict(config), indent=1)
    else:
        raise _fail(f"a config is a path or a dict; not {type(config).__name__}")
    return _truetriad.Document(path, text, [str(key).encode("utf-8", "surrogateescape") + b"=" + _json(value)
                                            for key, value in (overrides or {}).items()])


def _json(value, indent=None):
    import json
    text = json.dumps(value, indent=indent, ensure_ascii=False, default=_plain)
    return text.encode("utf-8", "surrogateescape")


def _calibration(calibration):
    if isinstance(calibration, Calibration):
        return calibration
    if not _is_path(calibration):
        raise _fail(f"expected a Calibration or the path of one; not {type(calibration).__name__}")
    return load(calibration)
