// SPDX-License-Identifier: Apache-2.0
'use strict';

// A recording as truetriad reads it: DIR/recording.yaml and the CSV files that it names.

const fs = require('fs');
const os = require('os');
const path = require('path');
const { BadInput, UsageError, count, printable } = require('./arguments.js');

const kTriads = { accelerometer: 'accel', gyroscope: 'gyro', magnetometer: 'mag' };

// Rows that come out of order by no more than this many are put in order of time.
const kReach = 1024;
// A clock that jumps by more than a day at either end of a recording was not read, but damaged.
const kLongestJumpNs = 86_400_000_000_000n;
const kLastTimeNs = (1n << 63n) - 1n;
const kChunk = 1 << 18;

/** A float32 with the fewest digits that give it back. */
function float32Text(value) {
  return String(Number(value.toPrecision(9)));
}

/** The CSV of one triad. */
class Table {
  /** `file`: name of the CSV; `isFloat32`: readings are no wider than that. */
  constructor(folder, triad, file, isFloat32) {
    this.triad = triad;
    this.file = file;
    this.rows = 0;
    this.withoutNumbers = 0;
    this.outOfOrder = 0;
    this.wrongTimes = 0;
    this.withTemperature = 0;
    this.firstNs = 0n;
    this.lastNs = -kLastTimeNs;
    this.text = isFloat32 ? float32Text : String;
    this.waiting = [];
    this.sorted = true;
    this.lines = [];
    this.length = 0;
    this.descriptor = fs.openSync(path.join(folder, file), 'wx');
    const prefix = kTriads[triad];
    this.push(`time_ns,${prefix}_x,${prefix}_y,${prefix}_z,temperature\n`);
  }

  /** Adds a row; time in ns as a BigInt, temperature in degC or NaN. */
  add(timeNs, x, y, z, temperature = NaN) {
    if (!Number.isFinite(x) || !Number.isFinite(y) || !Number.isFinite(z)) {
      ++this.withoutNumbers;
      return;
    }
    if (timeNs > kLastTimeNs || timeNs < -kLastTimeNs) {
      ++this.wrongTimes;
      return;
    }
    if (this.rows > 0 && timeNs < this.lastNs) {
      ++this.outOfOrder;
      return;
    }
    const waiting = this.waiting;
    if (waiting.length > 0 && timeNs < waiting[waiting.length - 1][0]) this.sorted = false;
    waiting.push([timeNs, x, y, z, temperature]);
    if (waiting.length >= 2 * kReach) this.release(kReach);
  }

  /** Writes the first `number` of the waiting rows. */
  release(number) {
    if (!this.sorted) this.waiting.sort((a, b) => (a[0] < b[0] ? -1 : a[0] > b[0] ? 1 : 0));
    this.sorted = true;
    const rows = this.waiting.splice(0, number);
    for (let i = 0; i < rows.length; ++i) {
      const next = i + 1 < rows.length ? rows[i + 1] : this.waiting[0];
      if (this.rows === 0 && next && next[0] - rows[i][0] > kLongestJumpNs) {
        ++this.wrongTimes;
        continue;
      }
      this.write(rows[i]);
    }
  }

  write([timeNs, x, y, z, temperature]) {
    if (this.rows === 0) this.firstNs = timeNs;
    this.lastNs = timeNs;
    ++this.rows;
    let degrees = '';
    if (Number.isFinite(temperature)) {
      degrees = float32Text(temperature);
      ++this.withTemperature;
    }
    this.push(`${timeNs},${this.text(x)},${this.text(y)},${this.text(z)},${degrees}\n`);
  }

  push(line) {
    this.lines.push(line);
    this.length += line.length;
    if (this.length >= kChunk) this.flush();
  }

  flush() {
    const text = Buffer.from(this.lines.join(''), 'latin1');
    for (let at = 0; at < text.length;) at += fs.writeSync(this.descriptor, text, at);
    this.lines = [];
    this.length = 0;
  }

  close() {
    // Everything is in order once there is nothing more to come.
    if (!this.sorted) this.waiting.sort((a, b) => (a[0] < b[0] ? -1 : a[0] > b[0] ? 1 : 0));
    this.sorted = true;
    // A clock far ahead stays to the end.
    let whole = this.waiting.length;
    for (let i = 1; i < this.waiting.length; ++i) {
      if (this.waiting[i][0] - this.waiting[i - 1][0] <= kLongestJumpNs) continue;
      if (i * 2 > this.waiting.length || this.rows > 0) {
        whole = i;
        break;
      }
    }
    this.wrongTimes += this.waiting.length - whole;
    this.waiting.length = whole;
    this.release(whole);
    this.flush();
    fs.closeSync(this.descriptor);
    this.descriptor = -1;
  }

  /** "accelerometer.csv: 17070 rows over 68.7 s; …", for people. */
  summary() {
    const seconds = (Number(this.lastNs - this.firstNs) * 1e-9).toFixed(3);
    let text = `${this.file}: ${count(this.rows, 'row', 'rows')}`;
    if (this.rows > 0) text += ` over ${seconds} s`;
    const lost = [
      [this.withoutNumbers, 'fewer than three valid numbers'],
      [this.outOfOrder, 'time stamp far out of order'],
      [this.wrongTimes, 'invalid time stamp'],
    ];
    for (const [number, why] of lost) {
      if (number > 0) text += `; ${count(number, 'row', 'rows')} skipped (${why})`;
    }
    return text;
  }
}

/** What temporary names of this machine (and container) hold, as src/io/whole_file.cc makes them. */
function numbering() {
  let container = '';
  try {
    container = fs.readlinkSync('/proc/self/ns/pid');
  } catch {
    // Another system.
  }
  let hash = 2166136261; // Fowler, Noll and Vo's FNV-1a.
  for (const byte of Buffer.from(os.hostname() + container)) hash = Math.imul(hash ^ byte, 16777619) >>> 0;
  return String(hash);
}

function isRunning(process_id) {
  try {
    process.kill(process_id, 0);
    return true;
  } catch (error) {
    return error.code !== 'ESRCH';
  }
}

/** Removes folders that writers on this machine left in `parent` when they were killed. */
function sweep(parent) {
  const mark = new RegExp(`\\.tmp-${numbering()}-(\\d+)-\\d+$`);
  for (const name of fs.readdirSync(parent)) {
    const found = mark.exec(name);
    if (!found || isRunning(Number(found[1]))) continue;
    fs.rmSync(path.join(parent, name), { recursive: true, force: true });
  }
}

/** On the disk, not only on its way there. */
function sync(file) {
  const descriptor = fs.openSync(file, 'r');
  try {
    fs.fsyncSync(descriptor);
  } catch (error) {
    if (!['EINVAL', 'ENOTSUP'].includes(error.code)) throw error;
  } finally {
    fs.closeSync(descriptor);
  }
}

/** A text as YAML takes it. */
function quoted(text) {
  return JSON.stringify(printable(text));
}

/**
 * The folder DIR: written beside it under another name, which it loses once everything is whole; or,
 * where DIR exists, moved into it file by file, the manifests last.
 */
class RecordingFolder {
  /** `inputs`: the file that is read, or several. */
  constructor(directory, inputs) {
    this.directory = path.resolve(directory);
    this.inputs = [inputs].flat();
    this.shown = directory;
    if (fs.existsSync(this.directory) && !fs.statSync(this.directory).isDirectory()) {
      throw new BadInput(`${directory}: is a file; give the name of a folder`, 'output-in-the-way');
    }
    const parent = path.dirname(this.directory);
    fs.mkdirSync(parent, { recursive: true });
    sweep(parent);
    this.temporary = path.join(parent, `.${path.basename(this.directory)}.tmp-${numbering()}-${process.pid}-0`);
    fs.mkdirSync(this.temporary, 0o755);
    this.tables = [];
    this.remove = () => fs.rmSync(this.temporary, { recursive: true, force: true });
    process.on('exit', this.remove);
    for (const [signal, number] of [['SIGINT', 2], ['SIGTERM', 15], ['SIGHUP', 1]]) {
      process.once(signal, () => process.exit(128 + number));
    }
  }

  addTable(triad, file, isFloat32 = true) {
    const table = new Table(this.temporary, triad, file, isFloat32);
    this.tables.push(table);
    return table;
  }

  /**
   * Writes a manifest. `streams`: [{ table, unit, siPerCount?, applied? }]; `applied`: a map of
   * { offset, scale, matrix }, 'unknown', or undefined for none; `ids`: { accelerometer: 1310988 }.
   * False: none of them has a row.
   */
  writeManifest(name, { serial, ids = {}, source, frame, streams }) {
    const present = streams.filter((stream) => stream.table.rows > 0);
    if (present.length === 0) return false;
    let text = 'recording: 1\n';
    if (serial) text += `serial: ${quoted(serial)}\n`;
    const stated = Object.entries(ids).map(([triad, id]) => `${triad}: ${id}`);
    if (stated.length > 0) text += `device: {ids: {${stated.join(', ')}}}\n`;
    text += 'source:\n';
    for (const [key, value] of Object.entries(source)) text += `  ${key}: ${quoted(value)}\n`;
    if (frame) text += `frame: ${quoted(frame)}\n`;
    const applied = present.filter((stream) => stream.applied);
    if (applied.length === 0) {
      text += 'applied: none\n';
    } else if (applied.some((stream) => stream.applied === 'unknown')) {
      text += 'applied: unknown\n';
    } else {
      text += 'applied:\n';
      for (const { table, applied: map } of applied) {
        text += `  ${table.triad}:\n`;
        for (const [key, value] of Object.entries(map)) text += `    ${key}: ${JSON.stringify(value)}\n`;
      }
    }
    text += 'streams:\n';
    for (const { table, unit, siPerCount } of present) {
      const prefix = kTriads[table.triad];
      text += `  ${table.triad}:\n    file: ${table.file}\n    time: {column: time_ns, unit: ns}\n`;
      for (const axis of ['x', 'y', 'z']) text += `    ${axis}: ${prefix}_${axis}\n`;
      text += `    unit: ${unit}\n`;
      if (siPerCount) text += `    si_per_count: ${siPerCount}\n`;
      // Not where some rows have none: they would be left out for it.
      if (table.withTemperature === table.rows) {
        text += '    temperature: {column: temperature, unit: degC}\n';
      }
    }
    fs.writeFileSync(path.join(this.temporary, name), text);
    return true;
  }

  closeTables() {
    for (const table of this.tables) {
      table.close();
      if (table.rows === 0) fs.rmSync(path.join(this.temporary, table.file));
    }
  }

  /** A log that was measured cannot be had again: nothing takes its place, under no name of it. */
  checkIsNoInput(target) {
    if (!fs.existsSync(target)) return;
    const there = fs.statSync(target);
    const isInput = this.inputs.map((input) => fs.statSync(input)).some(({ dev, ino }) => dev === there.dev && ino === there.ino);
    if (isInput) {
      throw new UsageError(
        `${target}: would be overwritten, and it is an input; choose another output`, 'conflicting-arguments');
    }
  }

  /** Gives everything its name. */
  commit() {
    const names = fs.readdirSync(this.temporary);
    // The manifests last: until then nobody reads the rest.
    names.sort((a, b) => a.endsWith('.yaml') - b.endsWith('.yaml') || (a < b ? -1 : 1));
    for (const name of names) sync(path.join(this.temporary, name));
    let there = true;
    try {
      there = fs.readdirSync(this.directory).length > 0;
    } catch {
      there = false;
    }
    if (there) {
      for (const name of names) this.checkIsNoInput(path.join(this.directory, name));
      for (const name of names) {
        fs.renameSync(path.join(this.temporary, name), path.join(this.directory, name));
      }
    } else {
      fs.renameSync(this.temporary, this.directory);
    }
    sync(this.directory);
    sync(path.dirname(this.directory));
    this.remove();
  }
}

/** Lets signals through, which wait while JavaScript runs. */
function breathe() {
  return new Promise((resolve) => setImmediate(resolve));
}

/** The converter's name for `source:`. */
function converterName(format) {
  return `truetriad-convert-${format} ${require('../package.json').version}`;
}

module.exports = { RecordingFolder, breathe, converterName };
