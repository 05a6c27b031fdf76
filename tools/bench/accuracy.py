#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs all statistical tests and prints the rows of the tables in docs/.

Each test is a process of its own; as many run at a time as there are processors. With --write, the
tables that docs/ marks with `<!-- rows: NAME -->` get the new rows, unless a test failed; a
--filter must then select the tests of all rows of a table.
"""

import argparse
import collections
import concurrent.futures
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
DEFAULT = ROOT / 'build/tests/statistical/truetriad_statistical_test'


def test_names(program, pattern):
  """Full names of the tests that `pattern` (as for --gtest_filter) selects, in their order."""
  listing = subprocess.run([program, '--gtest_list_tests', f'--gtest_filter={pattern}'],
                           check=True, capture_output=True, text=True).stdout
  names, suite = [], ''
  for line in listing.splitlines():
    name = line.split('#')[0].rstrip()
    if name.startswith('  '):
      names.append(suite + name.strip())
    elif name.endswith('.'):
      suite = name
  return names


def run(program, name):
  return subprocess.run([program, f'--gtest_filter={name}'], capture_output=True, text=True,
                        env={**os.environ, 'TRUETRIAD_NIGHTLY': '1'})


def with_rows(text, rows):
  """`text` with the new `rows` in its marked tables."""
  def table(match):
    return match[1] + '\n'.join(rows[match[2]]) + '\n' if match[2] in rows else match[0]
  marked = r'(<!-- rows: (\w+) -->\n\n?\|.*\n\|[-:| ]+\|\n)(?:\|.*\n)*'
  return re.sub(marked, table, text)


def main():
  parser = argparse.ArgumentParser(description=__doc__)
  parser.add_argument('--program', default=DEFAULT, help='the statistical tests')
  parser.add_argument('--filter', default='*', help='tests to run, as for --gtest_filter')
  parser.add_argument('--write', action='store_true', help='put the rows into docs/')
  arguments = parser.parse_args()

  names = test_names(arguments.program, arguments.filter)
  rows, failed = collections.defaultdict(list), []
  with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
    results = pool.map(lambda name: run(arguments.program, name), names)
    for name, result in zip(names, results):
      for line in result.stdout.splitlines():
        if row := re.fullmatch(r'@(\w+) (\|.*\|)', line):
          rows[row[1]].append(row[2])
          print(row[1], row[2], flush=True)
      if result.returncode != 0:
        failed.append(name)
        print(result.stdout, result.stderr, flush=True)
  print(f'{len(names) - len(failed)} of {len(names)} tests passed')
  for name in failed:
    print(f'FAILED {name}')
  if failed:
    return 1
  if arguments.write:
    for page in sorted(ROOT.glob('docs/**/*.md')):
      text = page.read_text(encoding='utf-8')
      if (new := with_rows(text, rows)) != text:
        page.write_text(new, encoding='utf-8')
        print(f'wrote {page.relative_to(ROOT)}')
  return 0


if __name__ == '__main__':
  sys.exit(main())
