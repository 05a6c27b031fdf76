# SPDX-License-Identifier: Apache-2.0
"""The verbs of the command line, as functions."""
import os

from . import _truetriad
from ._answers import AllanDeviation, Comparison, Evaluation, Plan
from ._recording import Recording, _fail


def calibrate(recording=None, config=None, *, set=None, units=None, folder=None, progress=None):
    """Calibrates as `truetriad calibrate` does: the same recording and config give the same bytes.

    recording: path of a log, a Recording, what a Recording is made of (arrays, a DataFrame; with units=),
        or a list of such, sessions of one unit. None: what the config names.
    config: None (every sensor in the recording, with defaults), path of an experiment, or a dict with its
        keys (docs/experiments.md; paths in it are relative to the current folder).
    set: {"reference.gravity_mps2": 9.81}, keys that replace those of the config, as --set.
    folder: where the result will lie, to which the path of the recording in it is relative, as -o. Without a
        config alone; default: LOG.truetriad.
    progress: called with the share of the recording that is read, 0…1, a few times a second.

    Returns a Calibration. Data that do not determine it are no exception: usable is then False and
    findings say why. Raises BadInput, Usage, or NotEnough where the recording leads to no experiment.
    """
    files, recordings = _inputs(recording, units)
    return _truetriad.calibrate(files, recordings, _document(config, set), folder, progress)


def load(path):
    """Reads calibration.yaml."""
    return _truetriad.load(path)


def evaluate(calibration, recording, *, units=None, poses="", progress=None):
    """How good a calibration (or the path of one) is on a recording that it was not made from.

    poses: where they are, as --poses: "detect", "every_row", "column:NAME", ….
    Raises NotEnough where no poses are found.
    """
    files, recordings = _inputs(recording, units)
    if len(files) + len(recordings) != 1:
        raise _fail("evaluate takes one recording")
    return Evaluation(_truetriad.evaluate(_calibration(calibration), files, recordings, poses, progress))


def compare(a, b):
    """Whether two calibrations (or paths of such) agree, in sigmas, after taking out the gauge."""
    return Comparison(_truetriad.compare(_calibration(a), _calibration(b)))


def plan(config, measured=None, *, set=None, progress=None):
    """Which poses to take, and how good the calibration will be. config: as calibrate's, with `plan:`.
    measured: path of a recording of poses that are already taken."""
    measured = "" if measured is None else os.fspath(measured)
    return Plan(_truetriad.plan(_document(config, set), measured, progress))


def allan(recording, rate_hz=None, *, sensor="gyroscope", unit="rad/s", progress=None):
    """Allan deviation of a unit at rest: noise density, bias instability, random walk of each axis.

    recording: path of a log, a Recording, or an array (N, 3) of one sensor in unit at rate_hz.
    """
    if isinstance(recording, (str, os.PathLike, Recording)):
        files, recordings = _inputs(recording, None)
    else:
        if rate_hz is None:
            raise _fail("allan of an array needs rate_hz")
        files, recordings = _inputs(Recording({sensor: recording}, {sensor: unit}), None)
    return AllanDeviation(_truetriad.allan(files, recordings, rate_hz or 0.0, progress))


def simulate(scenario, *, set=None, unit=0, progress=None):
    """What a unit with known errors records. scenario: path, or a dict with its keys (docs/simulation.md).

    unit: which of the scenario's `count`, from 0. Returns (Recording, Calibration), the second being the truth.
    """
    serial, streams, truth = _truetriad.simulate(_document(scenario, set), unit, progress)
    data = {}
    for sensor, of_readings, readings, time_ns, temperature in streams:
        data[sensor] = {"unit": of_readings, "readings": readings, "time_ns": time_ns}
        if temperature is not None:
            data[sensor]["temperature"] = temperature
    return Recording(data, name="simulation", serial=serial), truth


def _inputs(recording, units):
    """Files, or recordings in memory."""
    if recording is None:
        return [], []
    several = list(recording) if isinstance(recording, (list, tuple)) else [recording]
    files = [os.fspath(one) for one in several if isinstance(one, (str, os.PathLike))]
    if files and len(files) == len(several):
        if units:
            raise _fail("units= is for arrays; a file states its own")
        return files, []
    if files:
        raise _fail("files and arrays cannot be mixed; read the files, or save the arrays")
    recordings = []
    for k, one in enumerate(several):
        if not isinstance(one, Recording):
            one = Recording(one, units, name="recording" if len(several) == 1 else f"recording-{k + 1}")
        recordings.append(one._core())
    return [], recordings


def _document(config, overrides):
    import_json = config is not None and not isinstance(config, (str, os.PathLike)) or overrides
    if import_json:
        import json
    items = [f"{key}={json.dumps(value, ensure_ascii=False)}" for key, value in (overrides or {}).items()]
    if config is None:
        return _truetriad.Document(None, None, items)
    if isinstance(config, (str, os.PathLike)):
        return _truetriad.Document(os.fspath(config), None, items)
    # A line a value, so that an error's line says which. JSON is YAML.
    return _truetriad.Document(None, json.dumps(config, indent=1, ensure_ascii=False), items)


def _calibration(calibration):
    return load(calibration) if isinstance(calibration, (str, os.PathLike)) else calibration
