// SPDX-License-Identifier: Apache-2.0
'use strict';

// Writes a Parquet file from a typed table in JSON lines of `truetriad fleet export`: a line with
// the columns, [{"name": …, "type": "STRING" | "INT64" | "DOUBLE" | "TIMESTAMP"}, …], then a list
// for each row. One row group is in memory at a time.

const fs = require('fs');
const readline = require('readline');
const { Refusal, printable } = require('./frames.js');

const kProgram = 'truetriad-export-parquet';
const kCellsAGroup = 1 << 19;
const kMostRows = 10_000; // Most rows of a row group.
const kValues = {
  STRING: (value) => value,
  DOUBLE: (value) => value,
  INT64: (value) => BigInt(value), // In JSON an INT64 is a text, since JSON's numbers cannot hold every one.
  TIMESTAMP: (value) => new Date(value),
};

function parse(words) {
  const found = { input: '', output: '' };
  for (const word of words) {
    if (word.startsWith('--output=')) found.output = word.slice('--output='.length);
    else if (word.startsWith('-')) throw new Refusal(`${word} is not a flag`, 'unknown-flag');
    else found.input = word;
  }
  if (!found.input || !found.output) throw new Refusal(`expected ${kProgram} TABLE --output=FILE`, 'missing-argument');
  return found;
}

function readColumns(line, file) {
  let columns = null;
  try {
    columns = JSON.parse(line);
  } catch {
    // A line that is not JSON is rejected below, like a line without columns.
  }
  const isColumn = (column) => typeof column?.name === 'string' && column.type in kValues;
  if (!Array.isArray(columns) || columns.length === 0 || !columns.every(isColumn)) {
    throw new Refusal(`${file}:1: is no list of columns`, 'wrong-format');
  }
  return columns;
}

/** The columns of `rows` in the form that the writer needs. */
function columnData(columns, rows) {
  return columns.map(({ name, type }, place) => ({
    name,
    data: rows.map((row) => (row[place] === null || row[place] === undefined ? null : kValues[type](row[place]))),
  }));
}

async function write(options, temporary) {
  const { ParquetWriter, fileWriter, schemaFromColumnData } = await import('hyparquet-writer');
  const lines = readline.createInterface({ input: fs.createReadStream(options.input), crlfDelay: Infinity });
  let [columns, writer, rows, number, most] = [null, null, [], 0, kMostRows];
  const flush = () => {
    if (rows.length > 0) writer.write({ columnData: columnData(columns, rows), rowGroupSize: rows.length });
    rows = [];
  };
  for await (const line of lines) {
    ++number;
    if (!columns) {
      columns = readColumns(line, options.input);
      most = Math.max(1, Math.min(kMostRows, Math.floor(kCellsAGroup / columns.length)));
      const schema = schemaFromColumnData({ columnData: columns.map(({ name, type }) => ({ name, type, data: [] })) });
      writer = new ParquetWriter({ writer: fileWriter(temporary), schema, createdBy: 'truetriad' });
      continue;
    }
    const row = JSON.parse(line);
    if (!Array.isArray(row) || row.length !== columns.length) {
      throw new Refusal(`${options.input}:${number}: is no row of ${columns.length} fields`, 'wrong-format');
    }
    rows.push(row);
    if (rows.length === most) flush();
  }
  if (!columns) throw new Refusal(`${options.input}: is empty`, 'wrong-format');
  flush();
  writer.finish();
  const descriptor = fs.openSync(temporary, 'r');
  fs.fsyncSync(descriptor);
  fs.closeSync(descriptor);
  fs.renameSync(temporary, options.output);
}

/** Returns the exit code: 0 success, 1 usage, 2 bad input. */
async function main() {
  let temporary = '';
  try {
    const options = parse(process.argv.slice(2));
    temporary = `${options.output}.tmp-${process.pid}`;
    await write(options, temporary);
  } catch (error) {
    if (temporary) fs.rmSync(temporary, { force: true });
    process.stderr.write(`${kProgram}: ${printable(error.message)}\n`);
    process.exitCode = ['unknown-flag', 'missing-argument'].includes(error.code) ? 1 : 2;
  }
}

module.exports = { main };
