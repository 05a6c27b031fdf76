# SPDX-License-Identifier: Apache-2.0
import os
import subprocess

import pytest


@pytest.fixture(scope="session")
def program():
    return os.environ["TRUETRIAD_BINARY"]


@pytest.fixture(scope="session")
def run(program):
    """The command line; its exit code must be one of `codes`."""

    def call(*words, codes=(0,), **options):
        done = subprocess.run([program, *map(str, words)], capture_output=True, text=True, **options)
        assert done.returncode in codes, done.stderr
        return done

    return call
