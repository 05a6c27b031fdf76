# SPDX-License-Identifier: Apache-2.0
"""What a Calibration shows in a notebook. pandas and matplotlib are imported only when they are needed."""
import html

SENSORS = ("accelerometer", "gyroscope", "magnetometer")
# Column numbers in a row of quality.pose_residuals.
POSE, SENSOR, ERROR, ERROR_BEFORE = 0, 1, 5, 6


def _repr_html_(self):
    """The verdict; for each sensor, bias and gain of each axis with their sigmas."""
    rows = ""
    sensors = self.to_dict()["sensors"] if self.usable else {}
    for name, sensor in sensors.items():
        raw, true = sensor["input_unit"], sensor["output_unit"]
        for what, unit in (("bias", raw), ("sensitivity", "1" if raw == true else f"{raw} / ({true})")):
            pairs = zip(sensor[what], sensor["sigma"][what])
            if what == "sensitivity":
                pairs = ((row[i], sigmas[i]) for i, (row, sigmas) in enumerate(pairs))
            cells = "".join(f"<td>{value:.6g} ± {sigma:.2g}</td>" for value, sigma in pairs)
            rows += f"<tr><th>{name} {what}</th>{cells}<td>{html.escape(unit)}</td></tr>"
    table = f"<table><tr><th></th><th>x</th><th>y</th><th>z</th><th>unit</th></tr>{rows}</table>" if rows else ""
    return f"<p><b>{html.escape(self.text.splitlines()[0])}</b></p>{table}"


def _value(tree, name):
    """The value of the parameter that the covariance lists as `name`; NaN if there is none."""
    words = name.split(".")
    node = tree if words[0] == "reference" else tree["sensors"]
    for word in words:
        if isinstance(node, dict):
            node = node.get(word)
        elif isinstance(node, list) and word.isdigit():
            node = node[int(word) - 1] if int(word) <= len(node) else None
        elif isinstance(node, list):
            for letter in word:
                node = node["xyz".index(letter)]
    return node if isinstance(node, (int, float)) else float("nan")


def to_frame(self):
    """A pandas DataFrame: a row for each parameter of the covariance, with `value` and `sigma`."""
    import pandas
    tree, covariance = self.to_dict(), self.covariance
    return pandas.DataFrame(
        {"value": [_value(tree, name) for name in covariance.names], "sigma": covariance.matrix.diagonal() ** 0.5},
        index=pandas.Index(covariance.names, name="parameter"))


def plot(self):
    """A matplotlib figure for accelerometer and magnetometer: by how much the length of each pose's reading differs
    from gravity or the field, before and after calibration."""
    import matplotlib.pyplot as plt
    rows = [row for row in self.to_dict()["quality"].get("pose_residuals", []) if row[ERROR] is not None]
    shown = [name for name in SENSORS if name != "gyroscope" and any(row[SENSOR] == name for row in rows)]
    figure, all_axes = plt.subplots(max(len(shown), 1), 1, squeeze=False, figsize=(8, 3 * max(len(shown), 1)))
    for axes, name in zip(all_axes[:, 0], shown):
        own = [row for row in rows if row[SENSOR] == name]
        for column, label in ((ERROR_BEFORE, "before"), (ERROR, "after")):
            of = [(row[POSE], abs(row[column])) for row in own if row[column]]
            axes.semilogy([pose for pose, _ in of], [error for _, error in of], ".", label=label)
        axes.set_xlabel("pose")
        axes.set_ylabel(f"{name}: error of\nthe length [{self.to_dict()['sensors'][name]['output_unit']}]")
        axes.legend()
    figure.tight_layout()
    return figure
