// SPDX-License-Identifier: Apache-2.0
'use strict';

// Reads Parquet tables. Columns have the names of a self-describing CSV, "accel_x[m/s^2]", or
// --columns gives them such names. One row group is in memory at a time.

const fs = require('fs');
const path = require('path');
const { Worker } = require('worker_threads');
const { Refusal, Table, count, listOf, note, print, printable, send } = require('./frames.js');

const kMemoryMb = 1024; // Heap limit of the decoder.
const kMostRows = 1 << 24; // Largest row group that is decoded.
// A damaged page can make the decoder loop forever, so it is stopped after a time.
const kLongestMs = 15_000;
const kLongestMsPerRow = 0.03;
const kMostEndless = 3; // After this many stopped row groups, the rest is skipped.
const kTooLong = 'takes too long';
const kPrefixes = { accel: 'accelerometer', gyro: 'gyroscope', mag: 'magnetometer' };
const kUnits = {
  accelerometer: ['m/s^2', 'g', 'mg', 'counts'],
  gyroscope: ['rad/s', 'deg/s', 'counts'],
  magnetometer: ['uT', 'nT', 'mT', 'T', 'G', 'mG', 'counts'],
};
const kNs = { s: 1e9, ms: 1e6, us: 1e3, ns: 1 };

/** The decoder of a file. If its worker has ended, `group` starts another. */
class Decoder {
  constructor(file) {
    this.file = file;
  }

  /** Resolves to the first message: { schema, groups }. */
  async open() {
    this.worker = new Worker(path.join(__dirname, 'parquet_groups.js'), {
      workerData: { file: this.file }, resourceLimits: { maxOldGenerationSizeMb: kMemoryMb } });
    const first = await this.next();
    if (!first.ready) throw new Refusal(`${this.file}: is not a complete Parquet file (${printable(first.fatal ?? first.error ?? '')})`, 'wrong-format');
    return first;
  }

  next(rows = 0) {
    return new Promise((resolve) => {
      const { worker } = this;
      const handlers = {
        message: (message) => finish(message),
        error: (error) => finish({ fatal: String(error.message) }),
        exit: () => finish({ fatal: 'ended' }),
      };
      const timer = setTimeout(() => finish({ fatal: kTooLong }), kLongestMs + rows * kLongestMsPerRow);
      const finish = (result) => {
        clearTimeout(timer);
        for (const [event, handler] of Object.entries(handlers)) worker.off(event, handler);
        if (result.fatal) this.close();
        resolve(result);
      };
      for (const [event, handler] of Object.entries(handlers)) worker.on(event, handler);
    });
  }

  /** Resolves to { columns } or { error } for row group number `group`, which has `rows` rows. */
  async group(group, rows, columns) {
    if (!this.worker) await this.open();
    this.worker.postMessage({ group, columns });
    const result = await this.next(rows);
    return result.fatal ? { error: result.fatal } : result;
  }

  close() {
    this.worker?.on('error', () => {}); // The worker may fail while it is terminated.
    this.worker?.terminate();
    this.worker = null;
  }
}

/** The leaves of the schema: [{ name: "a.b", isTime }]. */
function leaves(schema) {
  const found = [];
  let at = 1;
  const walk = (prefix, number, depth) => {
    for (let i = 0; i < number && at < schema.length; ++i) {
      const element = schema[at++];
      const name = prefix ? `${prefix}.${element.name}` : element.name;
      if (element.children > 0 && depth < 16) walk(name, element.children, depth + 1);
      else found.push({ name, isTime: element.isTime });
    }
  };
  walk('', schema[0]?.children ?? 0, 0);
  return found;
}

/** The parts of a column's name: { role, triad?, axis?, unit }; null: no column of a recording. */
function meaning(name, isTime) {
  const match = /^([a-z_]+)(?:\[([^\]]+)\])?$/.exec(name);
  if (!match) return null;
  const [, word, unit] = match;
  if ((word === 'time' || word === 'timestamp') && isTime && unit === undefined) return { role: 'time', unit: 'ns' };
  if (word === 'time' && kNs[unit]) return { role: 'time', unit };
  if (word === 'temperature' && (unit === 'degC' || unit === 'K')) return { role: 'temperature', unit };
  const axis = /^(accel|gyro|mag)_([xyz])$/.exec(word);
  if (!axis) return null;
  const triad = kPrefixes[axis[1]];
  if (!kUnits[triad].includes(unit)) return null;
  return { role: 'reading', triad, axis: axis[2], unit };
}

/** The columns by role: { time, temperature, triads: { accelerometer: { unit, x, y, z } } }. */
function mapColumns(found, options) {
  const renamed = new Map(found.map(({ name, isTime }) => [name, { column: name, isTime }]));
  for (const pair of (options.others.columns ?? '').split(',').filter((text) => text)) {
    const equals = pair.indexOf('=');
    const [name, column] = [pair.slice(0, equals), pair.slice(equals + 1)];
    const source = found.find((leaf) => leaf.name === column);
    if (equals < 1 || !source) {
      throw new Refusal(`--columns: \`${printable(pair)}\` is not NAME=COLUMN of this file; its columns are ${listOf(found.map((leaf) => leaf.name), 40)}`, 'unknown-name');
    }
    if (!meaning(name, source.isTime)) {
      throw new Refusal(`--columns: \`${printable(name)}\` is not a name with a unit, such as time[ns], accel_x[m/s^2], gyro_y[deg/s], mag_z[uT] or temperature[degC]`, 'invalid-argument');
    }
    renamed.set(name, { column, isTime: source.isTime });
  }
  const map = { time: null, temperature: null, triads: {} };
  for (const [name, { column, isTime }] of renamed) {
    const means = meaning(name, isTime);
    if (!means) continue;
    if (means.role !== 'reading') {
      if (map[means.role]) throw new Refusal(`two columns are the ${means.role}; choose one with --columns`, 'invalid-argument');
      map[means.role] = { column, unit: means.unit, isTime };
      continue;
    }
    const triad = (map.triads[means.triad] ??= { unit: means.unit });
    if (triad.unit !== means.unit || triad[means.axis]) {
      throw new Refusal(`${options.input}: the columns of the ${means.triad} have different units, or one occurs twice`, 'wrong-format');
    }
    triad[means.axis] = column;
  }
  const help = `; its columns are ${listOf(found.map((leaf) => leaf.name), 40)}. State what they are with --columns=time[ns]=…,accel_x[m/s^2]=…`;
  for (const [triad, columns] of Object.entries(map.triads)) {
    for (const axis of ['x', 'y', 'z']) {
      if (!columns[axis]) throw new Refusal(`${options.input}: has no column for ${axis} of the ${triad}${help}`, 'missing-column');
    }
  }
  if (Object.keys(map.triads).length === 0) throw new Refusal(`${options.input}: no column is recognised as readings${help}`, 'missing-column');
  if (!map.time) throw new Refusal(`${options.input}: no column is recognised as time${help}`, 'missing-column');
  return map;
}

/** `value` of a time column in ns; null if it is missing. */
function toNs(value, { unit, isTime }) {
  if (typeof value === 'bigint') return isTime ? value : value * BigInt(kNs[unit]);
  if (typeof value !== 'number' || !Number.isFinite(value) || Math.abs(value) * kNs[unit] > 9e18) return null;
  const whole = Math.floor(value);
  return BigInt(whole) * BigInt(kNs[unit]) + BigInt(Math.round((value - whole) * kNs[unit]));
}

function toNumber(value) {
  return typeof value === 'bigint' ? Number(value) : typeof value === 'number' ? value : null;
}

/** Returns a function that reads the leaf `name` of a row group by row. */
function reader(columns, name) {
  const steps = columns[name] ? [name] : name.split('.');
  const chunks = columns[steps[0]] ?? [];
  let chunk = chunks[0];
  return (row) => {
    if (!chunk || row < chunk.first || row >= chunk.first + chunk.values.length) {
      chunk = chunks.find(({ first, values }) => row >= first && row < first + values.length);
    }
    let value = chunk?.values[row - chunk.first];
    for (let i = 1; i < steps.length; ++i) value = value?.[steps[i]];
    return value;
  };
}

function addRows(columns, rows, map, tables) {
  const time = reader(columns, map.time.column);
  const temperature = map.temperature ? reader(columns, map.temperature.column) : null;
  const axes = Object.entries(map.triads).map(([triad, { x, y, z }]) => [tables[triad], ...[x, y, z].map((name) => reader(columns, name))]);
  let without = 0;
  for (let row = 0; row < rows; ++row) {
    const timeNs = toNs(time(row), map.time);
    if (timeNs === null) {
      ++without;
      continue;
    }
    let degrees = temperature ? toNumber(temperature(row)) ?? NaN : NaN;
    if (map.temperature?.unit === 'K') degrees -= 273.15;
    for (const [table, x, y, z] of axes) {
      const [a, b, c] = [toNumber(x(row)), toNumber(y(row)), toNumber(z(row))];
      // A sensor that is slower than the others may have no reading in this row.
      if (a === null && b === null && c === null) continue;
      table.add(timeNs, a ?? NaN, b ?? NaN, c ?? NaN, degrees);
    }
  }
  return without;
}

async function convert(decoder, options) {
  const { schema, groups } = await decoder.open();
  const found = leaves(schema);
  if (options.list) {
    for (const { name, isTime } of found) print(`${printable(name).padEnd(40)} ${meaning(name, isTime)?.role ?? ''}`);
    note(`${count(groups.reduce((sum, rows) => sum + rows, 0), 'row', 'rows')} in ${count(groups.length, 'row group', 'row groups')}`);
    return;
  }
  const map = mapColumns(found, options);
  const names = [map.time, map.temperature].filter((column) => column).map(({ column }) => column);
  for (const { x, y, z } of Object.values(map.triads)) names.push(x, y, z);
  const whole = new Set(schema.map(({ name }) => name));
  const columns = [...new Set(names.map((name) => (whole.has(name) ? name : name.split('.')[0])))];
  const tables = {};
  for (const [triad, { unit }] of Object.entries(map.triads)) {
    tables[triad] = new Table({ recording: 0, file: `${triad}.csv`, triad, unit, temperature: map.temperature !== null }, false);
  }
  const lost = { groups: 0, rows: 0, endless: 0, why: '' };
  let untimed = 0;
  for (const [group, rows] of groups.entries()) {
    let result = { error: kTooLong };
    if (!(rows >= 0 && rows <= kMostRows)) result = { error: `${rows} rows` };
    else if (lost.endless < kMostEndless) result = await decoder.group(group, rows, columns);
    if (result.error) {
      ++lost.groups;
      lost.rows += Math.max(rows, 0);
      lost.why = result.error;
      if (lost.why === kTooLong) ++lost.endless;
    } else {
      untimed += addRows(result.columns, rows, map, tables);
    }
  }
  const source = {};
  if (lost.groups > 0) {
    source.damage = `${count(lost.groups, 'row group', 'row groups')} of ${groups.length} with ${lost.rows} rows cannot be read (${printable(lost.why).slice(0, 200)})`;
    note(source.damage);
  }
  if (untimed > 0) note(`${count(untimed, 'row', 'rows')} skipped (no time)`);
  send('M', { recording: 0, format: 'parquet', source, ids: {}, siPerCount: {} });
}

async function run(options) {
  const descriptor = fs.openSync(options.input, 'r');
  const magic = Buffer.alloc(4);
  try {
    if (fs.fstatSync(descriptor).isDirectory()) throw new Refusal(`${options.input}: is a folder`, 'wrong-format');
    fs.readSync(descriptor, magic, 0, 4, 0);
  } finally {
    fs.closeSync(descriptor);
  }
  if (magic.toString('latin1') !== 'PAR1') throw new Refusal(`${options.input}: does not start like a Parquet file`, 'wrong-format');
  const decoder = new Decoder(options.input);
  try {
    await convert(decoder, options);
  } finally {
    decoder.close();
  }
}

module.exports = { run };
