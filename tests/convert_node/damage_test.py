#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Damaged variants of real logs: every converter ends, in bounded time and memory, with 0, 1 or 2,
a whole recording or none, and a message rather than a stack.

Usage: damage_test.py VARIANTS [ulog|mcap|parquet]... Environment as of convert_test.py.
"""
import os
import random
import resource
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import writers

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "convert"))
import bags  # noqa: E402

PROGRAMS = Path(os.environ["PROGRAMS"])
DATASETS = Path(os.environ["DATASETS"])
SKIPPED = 77
LONGEST_S = 60
MOST_RSS_MB = 600
SEED = 20260131

SOURCES = (("ulog", DATASETS / "e-ulog-px4" / "sample_log_small.ulg", []),
           ("ulog", DATASETS / "e-ulog-px4" / "sample.ulg", ["--topic=sensor_combined"]),
           ("ulog", "appended.ulg", []),
           ("mcap", DATASETS / "e-rosbag2-format" / "test_bag_mcap.mcap", []),
           ("mcap", "driver.mcap", ["--units=us,counts,rad/s,degC", "--columns=accelerometer=/driver:low.acc@t_us,"
                                    "gyroscope=/driver:gx+gy+gz@t_us,temperature=/driver:low.temp"]),
           ("parquet", Path(__file__).resolve().parent / "table.parquet", []))


def damaged(data, chance):
    """`data` with one to four kinds of damage."""
    data = bytearray(data)
    for _ in range(chance.randint(1, 4)):
        if not data:
            break
        # Heads and tails hold what the rest hangs on.
        at = chance.choice((chance.randrange(len(data)), chance.randrange(min(len(data), 4096)),
                            len(data) - 1 - chance.randrange(min(len(data), 4096))))
        kind = chance.randrange(7)
        length = min(chance.choice((1, 2, 4, 8, 100, 5000)), len(data) - at)
        if kind == 0:
            for _ in range(chance.choice((1, 3, 30))):
                data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
        elif kind == 1:
            data[at:at + length] = bytes(length)
        elif kind == 2:
            data[at:at + length] = b"\xff" * length
        elif kind == 3:
            data[at:at + length] = chance.randbytes(length)
        elif kind == 4:
            del data[at:at + length]
        elif kind == 5:
            data[at:at] = chance.randbytes(length)
        elif chance.random() < 0.5:
            del data[at:]
        else:
            data[at] = chance.randrange(256)
    return bytes(data)


def run(arguments, folder):
    """(exit code, stderr, seconds of processor time, MB at most)"""
    with open(folder / "err", "w+b") as err, open(os.devnull, "wb") as nothing:
        process = subprocess.Popen([str(a) for a in arguments], stdout=nothing, stderr=err, preexec_fn=lambda:
                                   resource.setrlimit(resource.RLIMIT_CPU, (LONGEST_S, LONGEST_S)))
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        err.seek(0)
        text = err.read().decode(errors="replace")
    return process.returncode, text, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def main():
    variants = int(sys.argv[1])
    if not (PROGRAMS / "truetriad-convert-ulog").exists():
        print("skipped: the converters are not built: node or npm is missing")
        return SKIPPED
    failures = 0
    made = tempfile.TemporaryDirectory()
    (Path(made.name) / "appended.ulg").write_bytes(writers.appended_ulog()[0])
    bags.write_custom("mcap", Path(made.name) / "driver.mcap", 0, 400, most=50, is_checked=False)
    for kind, source, flags in SOURCES:
        if sys.argv[2:] and kind not in sys.argv[2:]:
            continue
        source = Path(made.name) / source  # One that is shared has a whole path.
        if not source.exists():
            print(f"skipped: {source} is not there")
            continue
        data = source.read_bytes()
        codes, slowest, largest = {}, 0.0, 0.0
        for i in range(variants):
            seed = f"{SEED}/{source.name}/{i}"
            folder = Path(tempfile.mkdtemp())
            broken = folder / f"broken{source.suffix}"
            broken.write_bytes(damaged(data, random.Random(seed)))
            out = folder / "out"
            code, text, seconds, megabytes = run(
                [PROGRAMS / f"truetriad-convert-{kind}", broken, f"--output={out}", *flags], folder)
            codes[code] = codes.get(code, 0) + 1
            slowest, largest = max(slowest, seconds), max(largest, megabytes)
            wrong = []
            if code not in (0, 1, 2):
                wrong.append(f"exit code {code}")
            if (code == 0) != (out / "recording.yaml").exists():
                wrong.append("a recording where there should be none, or none")
            if [p for p in folder.iterdir() if p.name.startswith(".out")]:
                wrong.append("something half done is left")
            if "\n    at " in text or (code != 0 and f"truetriad-convert-{kind}: " not in text):
                wrong.append("no message for people")
            if megabytes > MOST_RSS_MB:
                wrong.append(f"{megabytes:.0f} MB")
            # What was written can be read, or refused, but never ends in a crash.
            if code == 0 and i % 20 == 0:
                inspected = run([os.environ["TRUETRIAD"], "inspect", f"--input={out / 'recording.yaml'}"], folder)[0]
                if inspected not in (0, 2, 3):
                    wrong.append(f"inspect: {inspected}")
            if wrong:
                failures += 1
                print(f"FAILED: seed {seed}: {'; '.join(wrong)}\n{text[-2000:]}")
            shutil.rmtree(folder)
        print(f"{source.name}: {variants} variants, exit codes {dict(sorted(codes.items(), key=str))}, "
              f"at most {slowest:.1f} s and {largest:.0f} MB")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
