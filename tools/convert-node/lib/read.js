// SPDX-License-Identifier: Apache-2.0
'use strict';

// Reads a log for the converter that starts this script (tools/convert/scripted.cc). The first
// argument is the request in JSON; the results are written as lines to a pipe.

const { Refusal, end, printable, send } = require('./frames.js');

const kReaders = { ulog: './px4.js', parquet: './parquet.js' };

/** [code, message] of an error; the code is one of docs/reasons.md. */
function reasonOf(error) {
  if (error instanceof Refusal) return [error.code, error.message];
  if (String(error.code).endsWith('MODULE_NOT_FOUND')) {
    return ['missing-program', 'the packages of the converter are not installed; run tools/build.sh programs where npm is installed'];
  }
  // Errors of the system: the file is missing or not readable.
  if (typeof error.code === 'string' && error.syscall) {
    return ['unreadable-file', `${error.path ?? 'a file'}: ${error.code}: ${error.message}`];
  }
  return ['damaged-file', `the log cannot be converted: ${printable(error.message)}`];
}

async function main() {
  try {
    const request = JSON.parse(process.argv[2]);
    await require(kReaders[request.format]).run(request);
    send('X', null);
  } catch (error) {
    const [code, message] = reasonOf(error);
    send('E', { code, message });
  }
  end();
}

main().catch(() => process.exit(2)); // The reader of the pipe is gone.
