#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Turns triads in a JSON or MATLAB v5 file into a CSV that truetriad reads.

    tools/scripts/to_table.py unit.json --accel=grav:m/s^2 --mag=mag:uT --output=unit.csv

A triad is named as PATH:UNIT. PATH is the variable of a .mat file, or the keys of a JSON file
joined by dots. A triad consists of rows of three numbers, or is a flat list x0,y0,z0,x1,..., which
may be padded with NaN. Every row of the result is one reading; numbers keep all their digits.
"""
import argparse
import json
import math
import os
import struct
import sys
import zlib

TRIADS = ("accel", "gyro", "mag")

# Data types of a MATLAB v5 file (MAT-File Format, table 1-1): numbers by `struct` letter;
# containers.
MAT_NUMBERS = {1: "b", 2: "B", 3: "h", 4: "H", 5: "i", 6: "I", 7: "f", 9: "d", 12: "q", 13: "Q"}
MAT_MATRIX = 14
MAT_COMPRESSED = 15
MAT_COMPLEX_FLAG = 0x0800
MAT_FIRST_NUMERIC_CLASS = 6


class BadInput(Exception):
    pass


def mat_elements(data, order):
    """Yields (type, bytes) of the elements in `data`."""
    at = 0
    while at + 8 <= len(data):
        (word,) = struct.unpack_from(order + "I", data, at)
        if word >> 16:  # Small element: size and type share the first word, data follows.
            kind, size, start, end = word & 0xFFFF, word >> 16, at + 4, at + 8
        else:
            kind, (size,) = word, struct.unpack_from(order + "I", data, at + 4)
            start = at + 8
            # All elements except compressed ones are padded to eight bytes.
            end = start + (size if kind == MAT_COMPRESSED else (size + 7) // 8 * 8)
        if start + size > len(data):
            raise BadInput("is cut off inside an element")
        yield kind, data[start : start + size]
        at = end


def mat_numbers(kind, data, order):
    if kind not in MAT_NUMBERS:
        raise BadInput(f"holds data of type {kind}; expected numbers")
    letter = MAT_NUMBERS[kind]
    return struct.unpack(f"{order}{len(data) // struct.calcsize(letter)}{letter}", data)


def read_mat(path):
    """The real numeric matrices of a MATLAB v5 file by name, each a list of rows."""
    with open(path, "rb") as file:
        data = file.read()
    if len(data) < 128 or data[126:128] not in (b"IM", b"MI"):
        raise BadInput("is not a MATLAB v5 file (save it with `save -v6` or `save -v7`)")
    order = "<" if data[126:128] == b"IM" else ">"
    variables = {}
    for kind, body in mat_elements(data[128:], order):
        if kind == MAT_COMPRESSED:
            kind, body = next(mat_elements(zlib.decompress(body), order))
        if kind != MAT_MATRIX:
            continue
        parts = list(mat_elements(body, order))
        (flags, *_) = mat_numbers(*parts[0], order)
        if flags & 0xFF < MAT_FIRST_NUMERIC_CLASS or flags & MAT_COMPLEX_FLAG:
            continue
        shape = mat_numbers(*parts[1], order)
        values = mat_numbers(*parts[3], order)
        if len(shape) == 2:  # Stored by columns.
            variables[parts[2][1].decode("ascii")] = [
                list(values[row :: shape[0]]) for row in range(shape[0])
            ]
    return variables


def find(tree, path):
    for key in path.split("."):
        if not isinstance(tree, dict) or key not in tree:
            known = ", ".join(tree) if isinstance(tree, dict) else "none"
            raise BadInput(f"has no `{path}`; `{key}` is not one of: {known}")
        tree = tree[key]
    return tree


def rows_of(values, path):
    """Rows of three numbers. A flat list is cut into rows, without its padding of NaN."""
    if not isinstance(values, list) or not values:
        raise BadInput(f"`{path}` is not a list of readings")
    if not isinstance(values[0], list):
        values = [value for value in values if not math.isnan(value)]
        if len(values) % 3:
            raise BadInput(f"`{path}` has {len(values)} numbers, which are not whole triads")
        values = [values[i : i + 3] for i in range(0, len(values), 3)]
    for number, row in enumerate(values):
        if len(row) != 3:
            raise BadInput(f"`{path}` row {number} has {len(row)} numbers, expected 3")
    return values


def write_table(source, triads, output):
    """Writes the `triads` {name: "PATH:UNIT"} of the file `source` to the CSV `output`."""
    if source.endswith(".mat"):
        tree = read_mat(source)
    else:
        with open(source, encoding="utf-8") as file:
            tree = json.load(file)
    header, columns = [], []
    for name, place in triads.items():
        path, separator, unit = place.rpartition(":")
        if not separator:
            raise BadInput(f"--{name}={place}: expected PATH:UNIT, as in grav:m/s^2")
        header += [f"{name}_{axis}[{unit}]" for axis in "xyz"]
        columns.append(rows_of(find(tree, path), path))
    if len({len(column) for column in columns}) != 1:
        lengths = ", ".join(f"{name} {len(column)}" for name, column in zip(triads, columns))
        raise BadInput(f"has triads of different lengths ({lengths}); convert them one by one")
    partial = output + ".part"
    with open(partial, "w", encoding="utf-8", newline="\n") as file:
        file.write(",".join(header) + "\n")
        for rows in zip(*columns):
            file.write(",".join(repr(value) for row in rows for value in row) + "\n")
    os.replace(partial, output)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("input", help="a .json or .mat (v5) file")
    parser.add_argument("--output", required=True, help="the CSV to write")
    for name in TRIADS:
        parser.add_argument(f"--{name}", metavar="PATH:UNIT")
    arguments = parser.parse_args()
    triads = {name: getattr(arguments, name) for name in TRIADS if getattr(arguments, name)}
    if not triads:
        parser.error("name at least one triad, as in --accel=grav:m/s^2")
    try:
        write_table(arguments.input, triads, arguments.output)
    except (BadInput, OSError, ValueError, zlib.error, struct.error) as error:
        sys.exit(f"{arguments.input}: {error}")


if __name__ == "__main__":
    main()
