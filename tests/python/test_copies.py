# SPDX-License-Identifier: Apache-2.0
"""Pickles and copies; type stubs and docstrings of everything that is there."""
import ast
import copy
import inspect
import pathlib
import pickle
import pydoc

import numpy as np
import pytest

import truetriad

DEMO = "datasets/demo/recording.csv"


@pytest.fixture(scope="module")
def demo():
    return truetriad.calibrate(DEMO)


def again(thing):
    return pickle.loads(pickle.dumps(thing))


def test_a_pickled_calibration_is_the_same(demo, tmp_path):
    assert again(demo).to_yaml() == demo.to_yaml() and str(again(demo)) == str(demo)
    raw = np.random.default_rng(1).normal(size=(4, 3))
    assert np.array_equal(again(demo.gyroscope).correct(raw), demo.gyroscope.correct(raw))
    with open(DEMO) as file:
        (tmp_path / "log.csv").write_text("".join(file.readlines()[:600]))
    unusable = truetriad.calibrate(tmp_path / "log.csv")
    assert not unusable.usable and again(unusable).to_yaml() == unusable.to_yaml()


def test_what_cannot_change_is_its_own_copy(demo):
    for thing in (demo, demo.accelerometer, demo.findings[0]):
        assert copy.copy(thing) is thing and copy.deepcopy(thing) is thing


def test_recordings_and_answers_are_copied_and_pickled(demo):
    recording, _ = truetriad.simulate("configs/scenarios/consumer-9dof.yaml")
    expected = truetriad.calibrate(recording).to_yaml().split("created:")[0]
    for same in (again(recording), copy.copy(recording), copy.deepcopy(recording)):
        assert np.array_equal(same.magnetometer, recording.magnetometer)
        assert truetriad.calibrate(same).to_yaml().split("created:")[0] == expected
    comparison = truetriad.compare(demo, demo)
    assert again(comparison).to_dict() == comparison.to_dict() and str(copy.copy(comparison)) == str(comparison)
    assert again(demo.covariance).names == demo.covariance.names


def test_errors_are_pickled():
    with pytest.raises(truetriad.BadInput) as caught:
        truetriad.load("nothing.yaml")
    error = again(caught.value)
    assert (error.code, error.file, str(error)) == (caught.value.code, "nothing.yaml", str(caught.value))


def test_classes_without_a_constructor_are_not_made():
    for name in ("Calibration", "Sensor", "Finding"):
        with pytest.raises(TypeError):
            getattr(truetriad, name)()


def test_covariance_may_not_be_without_a_copy(demo):
    copied = np.array(demo.covariance)
    copied[:] = 0
    assert np.asarray(demo.covariance).any()


def stub(name):
    return ast.parse((pathlib.Path(truetriad.__file__).parent / name).read_text())


def members(body):
    """Names that a stub states, and the arguments of functions: None of what is none."""
    found = {}
    for node in body:
        if isinstance(node, ast.FunctionDef):
            is_property = any(getattr(d, "id", "") == "property" for d in node.decorator_list)
            names = [a.arg for a in node.args.args + node.args.kwonlyargs if a.arg != "self"]
            found[node.name] = None if is_property else names
        elif isinstance(node, ast.AnnAssign):
            found[node.target.id] = None
        elif isinstance(node, ast.ClassDef):
            found[node.name] = None
    return found


def arguments(function):
    try:
        return [name for name in inspect.signature(function).parameters if name != "self"]
    except ValueError:  # Of C++: as the first line of its docstring states it.
        line = (function.__doc__ or "").splitlines()[0]
        names = ast.parse(f"def f{line[line.index('('):line.rindex(')') + 1]}: ...".replace("::", ".")).body[0].args
        return [a.arg for a in names.args + names.kwonlyargs if a.arg != "self"]


@pytest.mark.parametrize("name, module", [("__init__.pyi", truetriad), ("_answers.pyi", truetriad._answers),
                                          ("_recording.pyi", truetriad._recording),
                                          ("_truetriad.pyi", truetriad._truetriad)])
def test_stubs_agree_with_the_module(name, module):
    tree = stub(name)
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            assert members([node])[node.name] == arguments(getattr(module, node.name)), node.name
        if not isinstance(node, ast.ClassDef):
            continue
        class_ = getattr(module, node.name)
        stated = members(node.body)
        there = {key for base in class_.__mro__[:-1] for key in vars(base)
                 if not key.startswith("_") and base.__module__.startswith("truetriad")
                 and (base is class_ or base.__name__ not in members(tree.body))}
        assert there <= stated.keys(), (node.name, there - stated.keys())
        for member, names in stated.items():
            if names is not None and not member.startswith("__"):
                assert names == arguments(getattr(class_, member)), (node.name, member)


def test_every_public_name_has_help(demo):
    assert set(truetriad.__all__) <= set(members(stub("__init__.pyi").body)) | {
        alias.asname for node in stub("__init__.pyi").body if isinstance(node, ast.ImportFrom)
        for alias in node.names}
    for name in truetriad.__all__:
        thing = getattr(truetriad, name)
        assert thing.__doc__ and pydoc.render_doc(thing), name
        for member, value in vars(thing).items() if inspect.isclass(thing) else ():
            if not member.startswith("_") and (callable(value) or isinstance(value, property)):
                assert value.__doc__, f"{name}.{member}"


def test_everything_has_a_repr_of_its_own(demo):
    recording = truetriad.Recording({"accelerometer": np.ones((2, 3))}, {"accelerometer": "g"}, rate_hz=1)
    for thing in (demo, demo.accelerometer, demo.findings[0], demo.covariance, recording,
                  truetriad.compare(demo, demo)):
        assert " object at " not in repr(thing)
