#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Converts the shared recordings that truetriad cannot read directly into CSV tables.

    tools/scripts/shared_tables.py --datasets=../shared/datasets --output=out/recordings

The experiments in configs/experiments/recordings and the manifests in configs/recordings look for
the tables in out/recordings.
"""
import argparse
import os
import sys

from to_table import BadInput, write_table

SAP = "a-sap-acc-mag-24pose/"
SAP5 = {"accel": "shots.grav:g", "mag": "shots.mag:uT"}
SAP6 = {"accel": "grav:m/s^2", "mag": "mag:uT"}
KREPA = "b-mag-krepa-json/"
PHONE = "MobileAccData30orientationRawSample01"

# Table: (file in the shared datasets, its triads). If a source states no unit, the unit is counts.
TABLES = {
    **{f"sap5_{unit}": (f"{SAP}sap5_{unit}.json", SAP5) for unit in ("ab", "ai", "bh", "bi", "ee")},
    **{
        f"sap6_{unit}": (f"{SAP}sap6_{unit}.json", SAP6)
        for unit in ("BB", "CF", "HC", "HC_improved")
    },
    "krepa_mag_1": (KREPA + "mag_test_data_1.json", {"mag": "mag:counts"}),
    "krepa_mag_2": (KREPA + "mag_test_data_2.json", {"mag": "mag:counts"}),
    "krepa_accel_1": (KREPA + "accel_test_data_1.json", {"accel": "acc:m/s^2"}),
    "phone_lis3dh": (f"a-phone-lis3dh-34pose/{PHONE}.mat", {"accel": PHONE + ":m/s^2"}),
}


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--datasets", default="../shared/datasets")
    parser.add_argument("--output", default="out/recordings")
    arguments = parser.parse_args()
    os.makedirs(arguments.output, exist_ok=True)
    for table, (source, triads) in TABLES.items():
        path = os.path.join(arguments.datasets, source)
        try:
            write_table(path, triads, os.path.join(arguments.output, table + ".csv"))
        except (BadInput, OSError, ValueError) as error:
            sys.exit(f"{path}: {error}")


if __name__ == "__main__":
    main()
