# SPDX-License-Identifier: Apache-2.0
"""The results of all verbs but calibrate and simulate."""


class Covariance:
    """names: parameters, as "accelerometer.bias.x". matrix: (n, n) float64, in the product of their units;
    singular if entries are fixed or tied."""

    def __init__(self, names, matrix):
        self.names = names
        self.matrix = matrix

    def __getitem__(self, pair):
        """The covariance of two parameters: covariance["accelerometer.bias.x", "accelerometer.bias.y"]."""
        a, b = pair
        return float(self.matrix[self._index(a), self._index(b)])

    def sigma(self, name):
        """The standard deviation of a parameter."""
        return self[name, name] ** 0.5

    def _index(self, name):
        try:
            return self.names.index(name)
        except ValueError:
            raise KeyError(name) from None

    def __len__(self):
        return len(self.names)

    def __array__(self, dtype=None):
        return self.matrix if dtype is None else self.matrix.astype(dtype)

    def __repr__(self):
        return f"<truetriad.Covariance of {len(self)} parameters>"


class _Answer:
    """The result of a verb: print() shows the text of the command line, answer["key"] and to_dict() hold its --json."""

    def __init__(self, core):
        self._core = core
        self._dict = None

    @property
    def text(self):
        return self._core.text

    def to_dict(self):
        if self._dict is None:
            import json
            self._dict = json.loads(self._core.json)
        return self._dict

    def report(self, path):
        """Writes the report as one HTML page."""
        self._core.report(path)

    def __getitem__(self, key):
        return self.to_dict()[key]

    def __str__(self):
        return self.text

    def __repr__(self):
        return f"<truetriad.{type(self).__name__}: {self.text.splitlines()[0]}>"


class Evaluation(_Answer):
    """How well a calibration corrects a recording."""

    @property
    def verdict(self):
        """"as-predicted", "worse", "no-test" (made from this recording), "no-prediction" or
        "not-evaluated"."""
        return self["verdict"]


class Comparison(_Answer):
    """Two calibrations, compared in one body frame."""

    @property
    def verdict(self):
        """"agree", "differ" or "not-compared"."""
        return self["agreement"]


class Plan(_Answer):
    """The poses to take, and the sigmas of a calibration from them."""

    @property
    def met(self):
        """Whether all is determined, the rehearsed calibration succeeds, and every wanted sigma is reached."""
        return self["met"]


class AllanDeviation(_Answer):
    """Noise of each axis of a unit at rest."""
