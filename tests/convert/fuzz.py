#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs a converter on damaged variants of a valid log.

    fuzz.py COMMAND LOG COUNT [--seed=N] [--inspect=TRUETRIAD] [--layout-of=BAG] [ARGUMENT]...

Bits flipped, bytes overwritten, cut out, put in or doubled, the end cut off, lengths replaced by lies.
COMMAND is a converter, or "truetriad convert --from=mat", where a library may be brought down. With --layout-of, LOG is the --layout of a bag that is whole. Each run must end by itself within 20 s of processor time, with
exit code 0, 1 or 2 and a message where it is not 0, without a sanitizer's report, with bounded memory, and
leave a recording that can be read to its end, or nothing. Prints how many of which; exit code 1 when one did not, with the variant kept in fuzz-failures/.
"""

import os
import random
import re
import resource
import shlex
import shutil
import signal
import struct
import subprocess
import sys
import tempfile

LONGEST_S = 20
MEMORY_KIB = 1_500_000  # A sanitizer's own included.
LIES = [0, 1, 0x7f, 0xff, 0x7fff, 0xffff, 0x7fffffff, 0xffffffff, 0x80000000, 0x00ffffff, 0x01000000]


def damaged(data, chance):
    data = bytearray(data)
    for _ in range(chance.choice([1, 1, 1, 2, 4, 16])):
        if not data:
            break
        kind = chance.randrange(8)
        # Headers are few bytes of a log, and most of its structure.
        near_start = chance.random() < 0.4
        at = chance.randrange(min(len(data), 4096) if near_start else len(data))
        size = min(chance.choice([1, 2, 4, 16, 100, 1000, 10000]), len(data) - at)
        if kind == 0:
            data[at] ^= 1 << chance.randrange(8)
        elif kind == 1:
            data[at:at + size] = chance.randbytes(size)
        elif kind == 2:
            del data[at:at + size]
        elif kind == 3:
            data[at:at] = chance.randbytes(size)
        elif kind == 4:
            data[at:at] = data[at:at + size]
        elif kind == 5:
            del data[at:]
        elif kind == 6:
            data[at:at + size] = bytes(size)
        else:
            width, code = chance.choice([(1, "<B"), (2, "<H"), (4, "<I"), (4, ">I"), (2, ">H")])
            lie = chance.choice(LIES) & (256**width - 1)
            data[at:at + width] = struct.pack(code, lie)
    return bytes(data)


def run(command, errors):
    """Exit code (negative: a signal), seconds of processor time, peak memory in KiB."""
    environment = dict(os.environ, ASAN_OPTIONS="exitcode=99:allocator_may_return_null=1:"
                       "detect_leaks=1", UBSAN_OPTIONS="halt_on_error=1:exitcode=99")
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=errors, env=environment,
                               preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (LONGEST_S, LONGEST_S)))
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return process.returncode, usage.ru_utime + usage.ru_stime, usage.ru_maxrss


def complaint(code, memory, said, folder, name):
    out = os.path.join(folder, "out")
    left = [entry for entry in os.listdir(folder) if entry not in ("out", name, "stderr")]
    if code in (-signal.SIGXCPU, -signal.SIGKILL):
        return "did not end"
    if code not in (0, 1, 2):
        return f"ended with {code}"
    if "Sanitizer" in said or "runtime error" in said:
        return "sanitizer report"
    if memory > MEMORY_KIB:
        return f"took {memory} KiB"
    if left:
        return f"left {left}"
    if code == 0 and not os.path.exists(os.path.join(out, "recording.yaml")):
        return "said it was good and wrote nothing"
    if code != 0 and (os.path.exists(out) or not said.strip()):
        return "failed, but left a recording or no message"
    return None


def unreadable(truetriad, folder):
    """Readings may say nothing, or their corrections be unknown; but each row must be one."""
    done = subprocess.run([truetriad, "inspect", f"--input={folder}/out/recording.yaml"],
                          capture_output=True, text=True)
    if done.returncode not in (0, 2, 3) or re.search(r"\.csv:\d+:", done.stderr):
        return f"inspect said {done.returncode}: {done.stderr}"
    return None


def main():
    converter, log, count = shlex.split(sys.argv[1]), sys.argv[2], int(sys.argv[3])
    seed, inspect, bag, more = 1, None, None, []
    for argument in sys.argv[4:]:
        if argument.startswith("--seed="):
            seed = int(argument[7:])
        elif argument.startswith("--inspect="):
            inspect = argument[10:]
        elif argument.startswith("--layout-of="):
            bag = argument[12:]
        else:
            more.append(argument)
    valid = open(log, "rb").read()
    codes, complaints, ended, slowest, largest = {}, 0, 0, 0.0, 0
    for number in range(count):
        with tempfile.TemporaryDirectory() as folder:
            name = "log" + os.path.splitext(log)[1]
            path = os.path.join(folder, name)
            with open(path, "wb") as file:
                file.write(damaged(valid, random.Random(seed * 1_000_003 + number)))
            with open(os.path.join(folder, "stderr"), "wb") as errors:
                damaged_input = [bag, f"--layout={path}"] if bag else [path]
                code, seconds, memory = run(
                    [*converter, *damaged_input, f"--output={folder}/out", *more], errors)
            said = open(os.path.join(folder, "stderr"), "rb").read().decode("utf-8", "replace")
            ended += "was stopped by signal" in said
            wrong = complaint(code, memory, said, folder, name)
            if not wrong and code == 0 and inspect:
                wrong = unreadable(inspect, folder)
            codes[code] = codes.get(code, 0) + 1
            slowest, largest = max(slowest, seconds), max(largest, memory)
            if wrong:
                complaints += 1
                os.makedirs("fuzz-failures", exist_ok=True)
                kept = f"fuzz-failures/{os.path.basename(converter[0])}-{seed}-{number}"
                shutil.copy(path, kept)
                print(f"{kept}: {wrong}\n{said[:3000]}")
    counts = ", ".join(f"{n} with exit code {c}" for c, n in sorted(codes.items(), key=str))
    library = f" ({ended} of them after the library was brought down)" if ended else ""
    print(f"{count} variants: {counts}{library}; slowest {slowest:.2f} s, most memory "
          f"{largest // 1024} MiB; {complaints} failures")
    return 1 if complaints else 0


sys.exit(main())
