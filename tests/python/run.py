# SPDX-License-Identifier: Apache-2.0
"""Runs pytest; 77, which CTest takes for skipped, where it or NumPy is not installed."""
import os
import sys

if os.environ.get("TRUETRIAD_SANITIZE") == "ON":
    print("skipped: a module with sanitizers cannot be loaded into a Python without")
    sys.exit(77)
try:
    import numpy  # noqa: F401
    import pytest
except ImportError as missing:
    print(f"skipped: {missing}; install python3-numpy and python3-pytest")
    sys.exit(77)
sys.exit(pytest.main(sys.argv[1:]))
