# SPDX-License-Identifier: Apache-2.0
"""Inputs of tools/bench/states and prices. Each source writes recordings with their true parameters; `run`
calibrates each recording with each program and judges the results as tests/trust/trial.cc does."""
import ast
import hashlib
import json
import math
import multiprocessing
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time
import zlib

os.environ["OPENBLAS_NUM_THREADS"] = "1"
try:
    import numpy as np
    import yaml
except ImportError as missing:
    print(f"{sys.argv[0]}: {sys.executable}: {missing}; it needs Debian's python3-numpy, python3-scipy and "
          "python3-yaml, as /usr/bin/python3 has them", file=sys.stderr)
    sys.exit(77)

ROOT = pathlib.Path(__file__).resolve().parents[2]
LONGEST_S = 120  # The slowest recording takes 6 s.
ALLOWED_SIGMAS = 5.0  # As in tests/trust.
# A fault is mild if it is at most one sigma of the accuracy that users need: a third of the
# strictest bias limit of configs/limits. No preset limits a magnetometer's bias, so its value is
# the limit of the residual in configs/experiments.
NEEDED = {"accelerometer": 0.196 / 3, "gyroscope": 8.73e-3 / 3, "magnetometer": 0.5}
UNIT_OF = {"m/s2": "accelerometer", "rad/s": "gyroscope", "uT": "magnetometer"}
SENSORS = {"accelerometer": "a", "gyroscope": "g", "magnetometer": "m"}

# Scenario, experiment, overrides, and whether the combination is part of the clean fleet (twelve
# are, with 300 units each in tests/trust) or another working regime. {here} is the unit's folder.
FLEETS = [
    ("fleet", "nine-axis", [], True), ("consumer-9dof", "nine-axis", [], True),
    ("late-magnetometer", "nine-axis", [], True), ("fleet", "joint", [], True),
    ("fleet", "accelerometer-only", [], True), ("fleet", "magnetometer-only", [], True),
    ("fleet", "magnetometer-gyroscope", [], True), ("tumble", "tumble", [], True),
    ("tumble-by-hand", "tumble", [], True),
    ("turntable-rates", "rate-table", ["rates.file={here}/rates.yaml", "turns=none"], True),
    ("turntable-attitudes", "rates-without-axis", ["rates.file={here}/rates.yaml"], True),
    ("thermal-soak", "thermal-soak", ["poses.file={here}/poses.yaml"], True),
    ("fleet", "joint", ["reference.field.strength_ut=unknown"], False),
    ("fleet", "joint", ["reference.field.dip_deg=62"], False),
    ("fleet", "joint", ["reference.gravity_mps2={value: 9.80665, sigma: 0.005}"], False),
    ("fleet", "joint", ["sensors.accelerometer.quadratic=true"], False),
    ("fleet", "joint", ["sensors.accelerometer.noise.excess=none",
                        "sensors.magnetometer.noise.excess=none"], False),
    ("fleet", "joint", ["robust.loss=none"], False),
    ("fleet", "turntable", ["poses={file: '{here}/poses.yaml'}",
                            "attitudes.file={here}/attitudes.csv"], False),
    ("fleet", "nine-axis", ["sensors.gyroscope.g_sensitivity=true"], False),
]
UNITS_A_CHUNK = 25  # Units with one seed. All at once, a chamber's recordings would take 2 GB.
FLEET_SEED = 4242


def digest(folder):
    """Hash of a recording's bytes, to show whether two results have the same input."""
    total = hashlib.sha256()
    for path in sorted(pathlib.Path(folder).glob("*.csv*")):
        total.update(path.read_bytes())
    return total.hexdigest()[:8]


def look_up(tree, name):
    """The value of the parameter that a covariance calls `name`; None if `tree` has no such value."""
    words = name.split(".")
    if words[0] == "reference":
        return tree.get("reference", {}).get(words[1])
    node = tree["sensors"].get(words[0])
    for word in words[1:]:
        if isinstance(node, dict):
            node = node.get(word)
        elif isinstance(node, list) and word.isdigit():
            node = node[int(word) - 1] if int(word) <= len(node) else None
        elif isinstance(node, list):
            for letter in word:
                node = node["xyz".index(letter)]
    return node if isinstance(node, (int, float)) else None


def gauge_rotation(gauge, lead):
    """The rotation into the body frame that a gauge attaches to the leading sensor, as in src/model/gauge.cc.
    If the matrix `lead` is already in this frame, the rotation is the identity."""
    if gauge == "fixture":
        return np.eye(3)
    sign = -1.0 if lead[0, 0] < 0 else 1.0
    if gauge == "symmetric":
        u, _, vt = np.linalg.svd(lead)
        signs = np.full(3, sign)
        if np.linalg.det(vt.T @ np.diag(signs) @ u.T) < 0:
            signs[2] = -signs[2]
        return vt.T @ np.diag(signs) @ u.T
    first, second = (0, 1) if gauge == "accel-x" else (2, 1)
    a = sign * lead[first] / np.linalg.norm(lead[first])
    b = lead[second] - a * (a @ lead[second])
    b *= sign / np.linalg.norm(b)
    rotation = np.empty((3, 3))
    rotation[:, first], rotation[:, second] = a, b
    rotation[:, 2 - first] = (1 if first == 0 else -1) * np.cross(a, b)
    return rotation


def true_of(truth, found, rest_errors):
    """The truth in the form of the result `found`: in its gauge, and with the mean biases over the rests that
    the result used."""
    true = json.loads(json.dumps(truth))
    lead = true["sensors"].get(found.get("gauge_sensor"))
    quality = found["quality"]
    if lead:
        turn = gauge_rotation(found["gauge"], np.array(lead["sensitivity"]))
        for sensor in true["sensors"].values():
            matrices = [("sensitivity", sensor), ("g_sensitivity", sensor)]
            terms = sensor.get("thermal", {}).get("sensitivity", [])
            for key, holder in matrices + [(i, terms) for i in range(len(terms))]:
                if key in holder or isinstance(key, int):
                    holder[key] = (np.array(holder[key]) @ turn).tolist()
    for name, errors in (rest_errors or {}).items():
        if name not in true["sensors"] or len(errors) != quality["poses"] or len(errors) < 3:
            continue
        left = {one["pose"] for one in quality.get("rejected_poses", []) if one["sensor"] == name}
        kept = [error for pose, error in enumerate(errors, 1) if pose not in left]
        if kept:
            bias = true["sensors"][name]["bias"] + np.mean(kept, 0) - np.mean(errors, 0)
            true["sensors"][name]["bias"] = bias.tolist()
    return true


def take_out_scale(names, covariance, found, true):
    """If the field strength is nominal: takes the common scale of the gains out of `true` and `covariance`."""
    at = [names.index(f"magnetometer.sensitivity.{a}{b}") for a in "xyz" for b in "xyz"]
    gains = np.array(found["sensors"]["magnetometer"]["sensitivity"])
    of_true = np.array(true["sensors"]["magnetometer"]["sensitivity"])
    factor = np.cbrt(abs(np.linalg.det(gains) / np.linalg.det(of_true)))
    true["sensors"]["magnetometer"]["sensitivity"] = (of_true * factor).tolist()
    change = np.eye(len(names))
    change[np.ix_(at, at)] -= np.outer(gains.ravel(), np.linalg.inv(gains).T.ravel() / 3)
    return change @ covariance @ change.T


def judge(found, truth, rest_errors):
    """z by parameter, then chi2 of all and its dimension. References are left out: they are not the unit's."""
    names = found["covariance"]["parameters"]
    covariance = np.array(found["covariance"]["matrix"])
    true = true_of(truth, found, rest_errors)
    if found["reference"].get("field_nominal") and "magnetometer.sensitivity.xx" in names:
        covariance = take_out_scale(names, covariance, found, true)
    largest = {}
    for name, variance in zip(names, covariance.diagonal()):
        group = name.rsplit(".", 1)[0]
        largest[group] = max(largest.get(group, 0), variance)
    at, errors = [], []
    for i, name in enumerate(names):
        value, right = look_up(found, name), look_up(true, name)
        # A parameter that the truth does not list is zero, such as a quadratic term.
        right = 0.0 if right is None and not name.startswith("reference") else right
        is_free = covariance[i, i] > 1e-20 * largest[name.rsplit(".", 1)[0]]  # As in compare.cc.
        if value is not None and right is not None and is_free and not name.startswith("reference"):
            at.append(i)
            errors.append(value - right)
    if not at:
        return {}, 0.0, 0
    sigmas = np.sqrt(covariance[at, at])
    z = np.array(errors) / sigmas
    values, vectors = np.linalg.eigh(covariance[np.ix_(at, at)] / np.outer(sigmas, sigmas))
    is_kept = values > 1e-9 * values[-1]
    chi2 = float(np.sum((vectors.T @ z)[is_kept] ** 2 / values[is_kept]))
    return {names[i]: float(one) for i, one in zip(at, z)}, chi2, int(is_kept.sum())


def rounded(value, digits):
    return float(f"{value:.{digits}g}")


def parameters_of(found, z):
    """[value, sigma, z if known] by name; values are rounded to a thousandth of their sigma."""
    listed = {}
    covariance = found.get("covariance") or {"parameters": [], "matrix": []}
    for i, name in enumerate(covariance["parameters"]):
        sigma, value = math.sqrt(max(covariance["matrix"][i][i], 0.0)), look_up(found, name)
        if value is None:
            continue
        value = round(value, 3 - math.floor(math.log10(sigma))) if sigma > 0 else rounded(value, 6)
        entry = [value, rounded(sigma, 4)]
        listed[name] = entry + [rounded(z[name], 3)] if name in z else entry
    return listed


def read_result(code, stdout, output, truth, trial):
    """The result of one program for one recording."""
    found, path = None, pathlib.Path(output) / "calibration.json"
    if path.exists():
        found = json.loads(path.read_text())
    try:
        said = json.loads(stdout)
    except ValueError:
        said = {}
    findings = found["status"].get("findings") or [] if found else said.get("findings") or []
    result = {"exit": code, "codes": sorted({f"{f['severity']}:{f['code']}" for f in findings})}
    if "error" in said:
        result["codes"].append(f"refusal:{said['error'].get('code', 'error')}")
    if code in (2, 3):
        return {**result, "outcome": "refused"}
    if code not in (0, 4) or found is None:
        return {**result, "outcome": "wrong", "codes": ["failure:crashed"]}
    z = {}
    if truth:
        z, chi2, size = judge(found, truth, trial.get("rest_errors"))
        worst = max(z, key=lambda name: abs(z[name]), default=None)
        is_right = worst and abs(z[worst]) <= ALLOWED_SIGMAS and not trial.get("must_be_refused")
        result |= {"outcome": "right" if is_right else "wrong", "worst": worst,
                   "chi2": rounded(chi2, 4), "size": size}
    else:
        result["outcome"] = "right"  # Without a truth, "right" means only usable.
    return {**result, "p": parameters_of(found, z)}


def calibrate(program, arguments, output, truth=None, trial={}, folder=None, environment={}):
    shutil.rmtree(output, ignore_errors=True)
    command = [program, "calibrate", *arguments, f"--output={output}", "--report=false", "--json"]
    try:
        ran = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST_S, cwd=folder,
                             env=os.environ | environment)
    except subprocess.TimeoutExpired:
        return {"exit": -1, "outcome": "wrong", "codes": ["failure:timeout"]}
    return read_result(ran.returncode, ran.stdout, output, truth, trial)


def with_each(programs, about, arguments, output, **judged):
    """The row of a recording: `about`, and the result of each program. If `programs` is a function, it makes
    the results: programs(name, of) calls of(program, **environment)."""
    def of(program, **environment):
        return calibrate(program, arguments, output, environment=environment, **judged)
    results = programs(about["id"], of) if callable(programs) else {
        state: of(program) for state, program in programs.items()}
    return {**about, "of": results}


def read_truth(path):
    """A truth.yaml without its covariance, which is zero and large."""
    text = pathlib.Path(path).read_text().split("\ncovariance:")[0]
    return yaml.load(text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))


# Each source has a function that lists its jobs, and a function that yields the rows of one job.

def trust_jobs(plan, wants_faults, wants_clean):
    wanted = [(False, *plan["trust"])] * wants_faults + [(True, *plan["clean"])] * wants_clean
    return [("trust", seed, min(10, first + count - seed), is_clean)
            for is_clean, first, count in wanted for seed in range(first, first + count, 10)]


def is_mild_trial(trial):
    """Whether the fault adds at most NEEDED to a bias or the field. Biases must be known from three rests."""
    fault = trial["kind"].split(" (")[0].split(",")[0]
    if trial["second"] or not trial["can_be_seen"]:
        return False
    if fault in ("hard iron moved", "field moved", "uneven field"):  # Severity is in uT.
        return trial["severity"] <= NEEDED["magnetometer"]
    errors = trial["rest_errors"].items()
    return fault in ("drift", "bias step", "wandering") and bool(errors) and all(
        len(own) >= 3 and np.abs(np.array(own) - np.mean(own, 0)).max() <= NEEDED[name] for name, own in errors)


def trust_rows(options, folder, first, count, is_clean):
    writer = pathlib.Path(options["writer"]) / "tests" / "trust" / "truetriad_trust"
    subprocess.run([writer, f"--first={first}", f"--runs={count}", "--threads=1", f"--write={folder}",
                    f"--clean={str(is_clean).lower()}"], check=False, capture_output=True)
    for seed in range(first, first + count):
        own = f"{folder}/{seed}"
        if not os.path.exists(f"{own}/trial.json"):
            continue  # The trial could not be simulated.
        trial = json.loads(pathlib.Path(f"{own}/trial.json").read_text())
        source = "regimes" if is_clean else "trust"
        about = {"id": f"{source}/{seed}", "kind": trial["kind"], "seen": trial["can_be_seen"],
                 "clean": is_clean, "mild": not is_clean and is_mild_trial(trial),
                 "severity": trial["severity"], "second": trial["second"], "digest": digest(own)}
        yield with_each(options["programs"], about, [f"--config={own}/experiment.yaml"], f"{own}/out",
                        truth=read_truth(f"{own}/truth.yaml"), trial=trial)


def generator_modules(folder):
    """`sim`; all kinds; those of motion; those that no recording can show; those that `joint` cannot show."""
    sys.path.insert(0, str(folder))
    import sim  # noqa: PLC0415  (the generators' folder is known only now)
    from suite3 import SC, SC2, SC3  # noqa: PLC0415
    from suite4 import SC4  # noqa: PLC0415
    sets = {}
    for node in ast.parse((pathlib.Path(folder) / "run.py").read_text()).body:
        name = node.targets[0].id if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name) else ""
        if name.startswith("UNKNOWABLE"):
            sets[name] = ast.literal_eval(node.value)
    return sim, {**SC, **SC2, **SC3, **SC4}, set(SC4), sets["UNKNOWABLE"], sets["UNKNOWABLE_JOINT"]


def generator_jobs(plan, folder):
    if not (folder / "run.py").exists():
        return []
    first, count = plan["generators"]
    kinds = sorted(generator_modules(folder)[1])[::plan["generator_stride"]]
    return [("generators", kind, seed) for seed in range(first, first + count) for kind in kinds]


def is_mild_text(kind, severity):
    """Whether the severity states an error in uT, m/s2 or rad/s that users tolerate. Clipping is never mild."""
    stated = re.search(r"([\d.]+(?:e[-+]?\d+)?) (uT|m/s2|rad/s)\b(?! per)", severity)
    return (bool(stated) and "clip" not in kind
            and float(stated[1]) <= NEEDED[UNIT_OF[stated[2]]])


def truth_of(made):
    """The truth of a generator in the form of a calibration."""
    return {"reference": {"dip_rad": float(made["dip"])}, "sensors": {
        name: {"bias": np.array(made[key][0]).tolist(), "sensitivity": np.array(made[key][1]).tolist()}
        for name, key in SENSORS.items()}}


def generator_rows(options, folder, kind, seed):
    sim, kinds, of_motion, unknowable, unknowable_joint = generator_modules(options["generators"])
    made = kinds[kind](np.random.default_rng([zlib.crc32(kind.encode()), seed]))
    sim.write(made["u"], f"{folder}/in.csv", fmt=made.get("fmt", "%.9g"), keep=made.get("keep"))
    truth = truth_of(made["truth"])
    for configuration in ["motion"] if kind in of_motion else ["nine", "joint"]:
        config = f"{folder}/{configuration}.yaml"
        sim.cfg(config, ("accelerometer", "magnetometer") if configuration == "joint"
                else tuple(SENSORS), extra={"poses": {"motion": {"spacing_s": 0.1}}}
                if configuration == "motion" else None)
        is_clean = "control" in kind or kind == "mo_pauses"
        about = {"id": f"generators/{kind}/{seed}/{configuration}", "kind": f"{kind} ({configuration})",
                 "seen": not (kind in unknowable - {"control"}
                              or configuration == "joint" and kind in unknowable_joint),
                 "clean": is_clean, "mild": not is_clean and is_mild_text(kind, made["sev"]),
                 "severity": made["sev"], "digest": digest(folder)}
        yield with_each(options["programs"], about, [f"--config={config}", f"--input={folder}/in.csv"],
                        f"{folder}/out", truth=truth)


# Clean logs: rates of 10 to 400 Hz, steps of 0.1 to 20 sigma, sensors that are polled 1 to 20 times a
# reading, and stamps that are exact, jitter, or are those of the bursts in which rows arrive.
RATES_HZ = np.array([10, 12.5, 20, 25, 40, 50, 52, 100, 104, 119, 125, 160, 200, 208, 250, 333, 400])
LEAST_HZ = {"accelerometer": 2.5, "gyroscope": 10.0, "magnetometer": 2.5}  # Of readings that differ.
STREAMS = {"accelerometer": "a", "gyroscope": "gy", "magnetometer": "mg"}
FEWEST_READINGS = 12  # Of each sensor in each rest.


def log_uniform(random, low, high):
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def log_jobs(plan, folder):
    first, count = plan["logs"]
    return [("logs", seed) for seed in range(first, first + count)] if (folder / "sim.py").exists() else []


def stamps_of(random, unit, how):
    """What a logger writes as the times of the readings of `unit`, and how it errs, in words."""
    if how == "jitter":
        share = 10 ** random.uniform(-2.5, -0.7)
        return np.maximum.accumulate(unit.t + random.normal(0, share / unit.fs, unit.N)), f"jitter {share:.3f}"
    if how == "burst":
        size, at = int(random.integers(2, 33)), np.arange(unit.N)
        last = np.minimum((at // size + 1) * size - 1, unit.N - 1)
        late = np.abs(random.normal(0, 1e-4, unit.N // size + 2))[at // size]
        return np.maximum.accumulate(unit.t[last] + late + at % size * 20e-6), f"bursts of {size}"
    return unit.t, "exact stamps"


def log_of(sim, random):
    """A unit without a fault whose readings and stamps are as a logger has them; its sensors; what it is."""
    rate = log_uniform(random, 10, 400)
    if random.random() < 0.6:
        rate = float(min(RATES_HZ, key=lambda one: abs(np.log(one / rate))))
    kind = ("nine", "joint", "six")[random.integers(3)] if random.random() < 0.5 else "nine"
    polls = {}
    for sensor, least in LEAST_HZ.items():
        times = round(log_uniform(random, 1, 20)) if random.random() < 0.5 else 1
        polls[sensor] = max(1, min(times, int(rate / least)))
    rest_s = max(random.uniform(1.5, 4), FEWEST_READINGS * max(polls.values()) / rate)
    move_s = random.uniform(1, 3)
    sigmas = tuple(10 ** random.uniform(*power) for power in ((-2.5, -1.3), (-3.5, -2.3), (-1, 0)))
    unit = sim.make(random, poses=int(random.integers(20, 31)), fs=rate, static=rest_s, move=move_s, sig=sigmas)
    sim.read(unit)
    words = [f"{rate:.0f} Hz", f"rests of {rest_s:.1f} s"]
    for (sensor, key), sigma in zip(STREAMS.items(), sigmas):
        held = getattr(unit, key)[np.arange(unit.N) // polls[sensor] * polls[sensor]]
        step = log_uniform(random, 0.1, 20)
        setattr(unit, key, np.round(held / (step * sigma)) * (step * sigma))
        words.append(f"{sensor} polled {polls[sensor]} times in steps of {step:.1f} sigma")
    unit.time, stamps = stamps_of(random, unit, random.choice(["exact", "exact", "jitter", "burst"]))
    left_out = {"nine": None, "joint": "gyroscope", "six": "magnetometer"}[kind]
    if left_out:
        setattr(unit, STREAMS[left_out], None)
    return unit, tuple(one for one in STREAMS if one != left_out), ", ".join([*words, stamps])


def log_rows(options, folder, seed):
    sim = generator_modules(options["generators"])[0]
    unit, sensors, words = log_of(sim, np.random.default_rng([777, seed]))
    sim.write(unit, f"{folder}/in.csv")
    sim.cfg(f"{folder}/log.yaml", sensors)
    truth = truth_of(sim.truthof(unit))
    about = {"id": f"logs/{seed}", "kind": f"clean log, {len(sensors)} sensors", "seen": True, "clean": True,
             "mild": False, "severity": words, "digest": digest(folder)}
    yield with_each(options["programs"], about, [f"--config={folder}/log.yaml", f"--input={folder}/in.csv"],
                    f"{folder}/out", truth=truth)


def fleet_jobs(plan, wants_fleet):
    scenarios = list(dict.fromkeys(scenario for scenario, *_ in FLEETS))
    chunks = range(-(-plan["units"] // UNITS_A_CHUNK) if wants_fleet else 1)
    return [("fleet", scenario, chunk, min(UNITS_A_CHUNK, plan["units"] - UNITS_A_CHUNK * chunk))
            for chunk in chunks for scenario in scenarios]


def fleet_rows(options, folder, scenario, chunk, units):
    seed = FLEET_SEED + chunk
    subprocess.run([options["simulator"], "simulate", f"--config={ROOT}/configs/scenarios/{scenario}.yaml",
                    f"--set=count={units},seed={seed}", f"--output={folder}/units", "--jobs=1"],
                   check=True, capture_output=True)
    manifests = sorted(pathlib.Path(folder, "units").rglob("recording.yaml"))
    for number, manifest in enumerate(manifests):
        here = str(manifest.parent)
        truth, bytes_of = read_truth(f"{here}/truth.yaml"), digest(here)
        for own, experiment, overrides, is_fleet in FLEETS:
            if own != scenario or not (is_fleet or chunk == 0):  # One chunk of a regime is enough.
                continue
            source = "fleet" if is_fleet else "regimes"
            kind = " ".join([f"{scenario} by {experiment}", *([] if is_fleet else overrides)])
            about = {"id": f"{source}/{kind}/{seed}.{number}", "kind": kind, "seen": True, "clean": True,
                     "mild": False, "digest": bytes_of}
            device = truth["device"]
            sets = [f"device={{serial: {device['serial']}, model: {device['model']}}}", *overrides]
            arguments = [f"--config={options['configs']}/experiments/{experiment}.yaml", f"--input={manifest}",
                         "--set=" + ",".join(sets).replace("{here}", here)]
            yield with_each(options["programs"], about, arguments, f"{here}/out", truth=truth)
        shutil.rmtree(here)


TUMBLE_UNIT = """recording: 1
streams:
  accelerometer: {{ file: {0}, time: {{ column: 0, unit: s }}, x: 1, y: 2, z: 3, unit: m/s^2 }}
  gyroscope: {{ file: {0}, time: {{ column: 0, unit: s }}, x: 4, y: 5, z: 6, unit: rad/s }}
  magnetometer: {{ file: {0}, time: {{ column: 0, unit: s }}, x: 7, y: 8, z: 9, unit: uT }}
"""


def prepare_recordings(folder, shared):
    """Makes a copy of the checkout's configs, in which experiments find the shared recordings and tables."""
    tree = pathlib.Path(folder) / "checkout"
    shutil.copytree(ROOT / "configs", tree / "configs")
    os.symlink(ROOT / "datasets", tree / "datasets")
    os.symlink(shared.resolve(), pathlib.Path(folder) / "shared")
    if (shared / "datasets").exists():
        subprocess.run([sys.executable, ROOT / "tools/scripts/shared_tables.py",
                        f"--datasets={shared}/datasets", f"--output={tree}/out/recordings"], check=True)
    return tree


def recording_jobs(tree, shared):
    """Every experiment on its own input; some experiments also on other units of the same data set."""
    experiments = tree / "configs" / "experiments"
    jobs = [("recordings", str(path.relative_to(experiments).with_suffix("")), None)
            for path in sorted(experiments.rglob("*.yaml"))]
    for name in ("mpu9150", "mpu9150-gyroscope"):
        jobs += [("recordings", f"recordings/{name}", str(path))
                 for path in sorted((tree / "configs" / "recordings").glob("mpu9150-imu[12].yaml"))]
    for name in ("sap5", "sap6"):
        jobs += [("recordings", f"recordings/{name}", str(path))
                 for path in sorted((tree / "out" / "recordings").glob(f"{name}_*.csv"))]
    for path in sorted((shared / "datasets" / "s-tumble-public-simulator").glob("unit*.csv.gz")):
        manifest = tree / "configs" / "recordings" / f"s-tumble-{path.name.split('.')[0]}.yaml"
        manifest.write_text(TUMBLE_UNIT.format(path.resolve()))
        jobs.append(("recordings", "tumble", str(manifest)))
    return jobs


def recording_rows(options, folder, experiment, log):
    name = experiment + (f" of {pathlib.Path(log).stem}" if log else "")
    arguments = [f"--config={options['configs']}/experiments/{experiment}.yaml"]
    if log:
        arguments.append(f"--input={log}")
        if "s-tumble" in log:  # Its magnetometer readings are relative to the field.
            arguments.append("--set=units=trust,reference.field.strength_ut=1")
    yield with_each(options["programs"], {"id": f"recordings/{name}", "kind": name, "seen": True,
                                          "clean": False, "mild": False}, arguments, f"{folder}/out")


def case_jobs(shared):
    return [("cases", path.parent.name) for path in sorted((shared / "cases").glob("*/README.md"))]


# Replaces truetriad: runs it and keeps each call's output, since the next may use the same folder.
WRAPPER = """#!/bin/sh
[ "$1" = calibrate ] && json=--json
number=$(grep -c "" "{1}/ran")
"{0}" "$@" $json > "{1}/$number.said" 2> /dev/null
code=$?
printf '%s\\t%s\\n' "$code" "$*" >> "{1}/ran"
for one; do
  [ "$before" = -o ] && output=$one
  case "$one" in --output=*) output=${{one#--output=}} ;; esac
  before=$one
done
[ -d "$output" ] && cp -r "$output" "{1}/$number.made"
exit $code
"""


def case_rows(options, folder, name):
    """Runs a case's command: the text in README.md from `Command: ` up to two blanks."""
    source, rows = options["shared"] / "cases" / name, {}
    command = re.search(r"^Command: (.*?)(?:  .*)?$", (source / "README.md").read_text(), re.M)[1]
    for state, program in options["programs"].items():
        own = pathlib.Path(folder) / state
        shutil.copytree(source, own / "case")
        (own / "truetriad").write_text(WRAPPER.format(program, own))
        (own / "truetriad").chmod(0o755)
        (own / "ran").touch()
        subprocess.run(["bash", "-c", command], cwd=own / "case", capture_output=True, timeout=LONGEST_S,
                       check=False, env={**os.environ, "PATH": f"{own}:{os.environ['PATH']}"})
        for number, line in enumerate((own / "ran").read_text().splitlines()):
            code, arguments = line.split("\t")
            made, said = own / f"{number}.made", (own / f"{number}.said").read_text()
            truth = source / "truth.json"
            true = json.loads(truth.read_text()) if truth.exists() and made.exists() else None
            if true:
                true = {"reference": {}, "sensors": {
                    sensor: {"bias": true[key][0], "sensitivity": true[key][1]}
                    for sensor, key in SENSORS.items() if key in true}}
            row = rows.setdefault(arguments, {"id": f"cases/{name}: {arguments}", "kind": name, "seen": True,
                                              "clean": False, "mild": False, "of": {}})
            row["of"][state] = (read_result(int(code), said, made, true, {}) if arguments.startswith("calibrate") else
                                {"exit": int(code), "codes": [], "outcome": "right" if code == "0" else "refused"})
    yield from rows.values()


# The runs of docs/performance.md. Their instructions are counted: counts do not depend on the
# machine.
COSTS = {
    "nine-axis unit": ["--config={configs}/experiments/nine-axis.yaml"],
    "Xsens pair": ["--config={configs}/experiments/recordings/xsens-imu-tk-pair.yaml"],
    "tumble of a minute": ["--config={configs}/experiments/tumble.yaml", "--input={folder}/tumble/recording.yaml",
                           "--set=device.serial=A0004"],
    "10,000 poses": ["--config={folder}/table.yaml"],
}
VALGRIND = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null"]
TABLE = "experiment: 1\ninput: table.csv\nsensors: { accelerometer: { model: full } }\nposes: every_row\n"


def write_cost_inputs(options, folder, name):
    if name == "tumble of a minute":
        subprocess.run([options["simulator"], "simulate", f"--config={ROOT}/configs/scenarios/tumble.yaml",
                        f"--output={folder}/tumble"], check=True, capture_output=True)
    if name != "10,000 poses":
        return
    random = np.random.default_rng(1)
    up = random.normal(size=(10_000, 3))
    up *= 9.80665 / np.linalg.norm(up, axis=1)[:, None]
    np.savetxt(f"{folder}/table.csv", up * [1.01, 0.99, 1.005] + [0.1, -0.2, 0.05]
               + random.normal(0, 0.01, up.shape), fmt="%.6f", delimiter=",", comments="",
               header="accel_x[m/s^2],accel_y[m/s^2],accel_z[m/s^2]")
    pathlib.Path(folder, "table.yaml").write_text(TABLE)


def cost_rows(options, folder, name):
    write_cost_inputs(options, folder, name)
    arguments = [one.format(configs=options["configs"], folder=folder) for one in COSTS[name]]
    counted = {}
    counter = VALGRIND if shutil.which("valgrind") else ["true"]
    for state, program in options["programs"].items():
        command = [*counter, program, "calibrate", *arguments, f"--output={folder}/{state}", "--report=false"]
        ran = subprocess.run(command, capture_output=True, text=True, check=False)
        count = re.search(r"Collected : (\d+)", ran.stderr)
        # A refusal costs less, and does not show the cost of a calibration.
        counted[state] = int(count[1]) if count and ran.returncode in (0, 4) else None
    yield {"id": f"cost/{name}", "of": counted}


ROWS = {"trust": trust_rows, "generators": generator_rows, "logs": log_rows, "fleet": fleet_rows, "recordings": recording_rows,
        "cases": case_rows, "cost": cost_rows}


def run(options, job):
    """All rows of a job, made in a temporary folder."""
    with tempfile.TemporaryDirectory(prefix="states-", dir=options["folder"]) as folder:
        return list(ROWS[job[0]](options, folder, *job[1:]))


# Running them.

# (First seed, count) of sources. --quick is part of the whole, so its rows pair with a whole
# record.
WHOLE = {"trust": (30_000, 1000), "clean": (200_000, 210), "generators": (0, 2), "generator_stride": 1,
         "logs": (1000, 500), "units": 300, "costs": list(COSTS)}
QUICK = {"trust": (30_000, 200), "clean": (200_000, 14), "generators": (0, 1), "generator_stride": 4,
         "logs": (1000, 50), "units": 3, "costs": ["nine-axis unit"]}


def program_of(state):
    path = pathlib.Path(state).resolve()
    path = path / "build" / "truetriad" if path.is_dir() else path
    if not os.access(path, os.X_OK):
        sys.exit(f"{state}: neither a checkout with build/truetriad nor a program nor a record (.xz)")
    return str(path)


def jobs_of(plan, options, wanted):
    jobs = {"trust": trust_jobs(plan, "trust" in wanted, "regimes" in wanted),
            "generators": generator_jobs(plan, options["generators"]),
            "logs": log_jobs(plan, options["generators"]),
            "recordings": recording_jobs(options["tree"], options["shared"]),
            "cases": case_jobs(options["shared"]),
            "fleet": fleet_jobs(plan, "fleet" in wanted),
            "cost": [("cost", name) for name in plan["costs"]]}
    chosen = {"trust": {"trust", "regimes"}, "fleet": {"fleet", "regimes"}}
    # The longest jobs come first, so that no core waits for them at the end.
    return [job for source in ("cost", "fleet", "trust", "generators", "logs", "recordings", "cases")
            if chosen.get(source, {source}) & wanted for job in jobs[source]]


OPTIONS = {}  # Set before the workers are forked, so that they inherit it.


def run_job(job):
    try:
        return run(OPTIONS, job)
    except Exception as error:  # If one job fails, the others go on.
        print(f"{job}: {error!r}", file=sys.stderr, flush=True)
        return None


def run_all(jobs, count):
    """Runs the jobs; returns their rows and the number of jobs that failed."""
    rows, lost, begin = [], 0, time.time()
    with multiprocessing.get_context("fork").Pool(count) as pool:
        for done, made in enumerate(pool.imap_unordered(run_job, jobs), 1):
            rows += made or []
            lost += made is None
            if done % 50 == 0 or done == len(jobs):
                print(f"{done} of {len(jobs)} jobs, {len(rows)} rows, {time.time() - begin:.0f} s",
                      file=sys.stderr, flush=True)
    return rows, lost
