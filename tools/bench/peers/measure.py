#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs commands in turns, A B C A B C…, and prints the medians of each command's times and memory.

    measure.py --runs=25 "NAME: COMMAND" "NAME: COMMAND"…

Prints one tab-separated line per command: name, CPU (user and system) in ms, wall in ms, peak
resident memory in MB. Each run is a whole process. A first run of each command fills the page cache
and does not count. A command whose name is in brackets, `(NAME): …`, may fail; any other failure
gives exit code 1.
"""
import argparse
import os
import shlex
import statistics
import sys
import time


def run(command):
    """CPU [ms], wall [ms], peak [MB] and exit code of one process."""
    null = os.open(os.devnull, os.O_WRONLY)
    start = time.monotonic()
    actions = [(os.POSIX_SPAWN_DUP2, null, 1), (os.POSIX_SPAWN_DUP2, null, 2)]
    pid = os.posix_spawnp(command[0], command, os.environ, file_actions=actions)
    _, status, usage = os.wait4(pid, 0)
    wall = time.monotonic() - start
    os.close(null)
    return (
        1e3 * (usage.ru_utime + usage.ru_stime),
        1e3 * wall,
        usage.ru_maxrss / 1024,
        os.waitstatus_to_exitcode(status),
    )


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=25)
    parser.add_argument("commands", nargs="+", metavar="NAME: COMMAND")
    arguments = parser.parse_args()
    commands = [text.split(": ", 1) for text in arguments.commands]
    measured = {name: [] for name, _ in commands}
    for turn in range(arguments.runs + 1):
        for name, command in commands:
            *numbers, code = run(shlex.split(command))
            if code != 0 and not name.startswith("("):
                sys.exit(f"measure.py: exit code {code} of: {command}")
            if turn > 0:
                measured[name].append(numbers)
    for name, rows in measured.items():
        cpu, wall, peak = (statistics.median(column) for column in zip(*rows))
        print(f"{name}\t{cpu:.1f}\t{wall:.1f}\t{peak:.1f}")


if __name__ == "__main__":
    main()
