#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs every command of truetriad that stands in a code block of README.md and docs/, in the order of
the pages, in a folder that has what a clone has. Environment: SOURCE, TRUETRIAD.

Arguments: pages to run alone (README.md runs before them, since others build on it).
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

# Not run: what stands for something else, and what the page shows for another reason.
PLACEHOLDERS = re.compile(r"\b(LOG|DIR|FILE|NAME|EXPERIMENT|SCENARIO|PROGRAM|CSV|FOLDER)\b|…|\[-|=mine\.yaml")
SKIPPED = {
    "out/golden/calibration.yaml out/today/recording.yaml --repeatability=gyroscope.bias=2e-4 --store":
        "of another page's recordings",
    "--require-golden": "of another page's recordings",
    "--from=dataflash": "the log is not shipped",
}


def pages(source):
    """README.md, then docs in the order in which it names them."""
    readme = source / "README.md"
    found = [readme]
    for name in re.findall(r"\((docs/[a-z-]+\.md)", readme.read_text()):
        if source / name not in found:
            found.append(source / name)
    return found


def commands(page):
    """(line, command) of the code blocks: indented, a command a line, `\\` goes on, loops are one."""
    lines = page.read_text().splitlines()
    found, i = [], 0
    while i < len(lines):
        text, first = lines[i], i + 1
        i += 1
        if not re.match(r" {4,}(build/truetriad|mkdir|cp|for) ", text):
            continue
        while text.endswith("\\") or (text.lstrip().startswith("for ") and "done" not in text.split()):
            text += "\n" + lines[i]
            i += 1
        found.append((first, "\n".join(part.strip() for part in text.split("\n"))))
    return found


def why_not(command):
    if PLACEHOLDERS.search(command):
        return "stands for others"
    return next((why for part, why in SKIPPED.items() if part in command), None)


def main():
    source, program = Path(os.environ["SOURCE"]), Path(os.environ["TRUETRIAD"])
    wanted = pages(source)
    if len(sys.argv) > 1:
        wanted = [page for page in wanted if page.name in sys.argv[1:] + ["README.md"]]
    failures, ran, skipped = [], 0, 0
    with tempfile.TemporaryDirectory() as folder:
        # Not links: experiments name recordings relative to themselves.
        for name in ("configs", "datasets"):
            shutil.copytree(source / name, Path(folder) / name)
        (Path(folder) / "build").mkdir()
        os.symlink(program, Path(folder) / "build/truetriad")
        environment = dict(os.environ, TRUETRIAD_LIBEXEC=str(program.parent))
        for page in wanted:
            for line, command in commands(page):
                where = f"{page.relative_to(source)}:{line}"
                if why := why_not(command):
                    print(f"{where}: not run ({why}): {command.splitlines()[0]}")
                    skipped += 1
                    continue
                begin = time.monotonic()
                done = subprocess.run(["bash", "-c", command], cwd=folder, env=environment, text=True,
                                      capture_output=True)
                ran += 1
                seconds = time.monotonic() - begin
                if seconds > 5:
                    print(f"{where}: {seconds:.0f} s")
                if done.returncode != 0:
                    failures.append(where)
                    print(f"{where}: exit code {done.returncode}: {command}\n"
                          f"{done.stdout[:1500]}{done.stderr[-1500:]}")
    print(f"{ran} commands, {skipped} not run, {len(failures)} failed: {' '.join(failures)}")
    return 1 if failures or ran < 60 and len(sys.argv) == 1 else 0


if __name__ == "__main__":
    sys.exit(main())
