// SPDX-License-Identifier: Apache-2.0
'use strict';

// Frames of a pipe: a letter, the length of what follows in 32 bits, and that. E: an error, N: a note
// for people, O: a line of --list, T: a table, W: a row, M: a manifest, C: a topic, P: a message,
// D: damage, X: the end.

const fs = require('fs');

const kPipe = 3;
const kHead = 5;
const kLastTimeNs = (1n << 63n) - 1n;
// A step of a clock by more than a day was not read, but damaged.
const kLongestJumpNs = 86_400_000_000_000n;
// 5 readings a second, whose times may be off by a tenth of that.
const kLongStepNs = 220_000_000n;

const buffer = Buffer.allocUnsafe(1 << 18);
let filled = 0;

/** The log is refused. `code`: why, as in docs/reasons.md. */
class Refusal extends Error {
  constructor(message, code) {
    super(message);
    this.code = code;
  }
}

/** `text` with every character that could do something to a terminal as `?`. */
function printable(text) {
  return String(text).replace(/[^\x20-\x7e]/g, '?');
}

function count(number, one, many) {
  return `${number} ${number === 1 ? one : many}`;
}

/** "a, b and 3 more", for messages. */
function listOf(names, most = 12) {
  const shown = names.slice(0, most).map(printable).join(', ');
  return names.length > most ? `${shown} and ${names.length - most} more` : shown || 'none';
}

function write(bytes, size) {
  for (let at = 0; at < size;) at += fs.writeSync(kPipe, bytes, at, size - at);
}

function end() {
  write(buffer, filled);
  filled = 0;
}

/** Begins a frame of `size` bytes; where they go in the buffer. */
function begin(kind, size) {
  if (filled + kHead + size > buffer.length) end();
  buffer[filled] = kind.charCodeAt(0);
  buffer.writeUInt32LE(size, filled + 1);
  filled += kHead + size;
  return filled - size;
}

/** Sends text, or bytes behind a `head` of bytes. */
function send(kind, body, head = Buffer.alloc(0)) {
  const bytes = typeof body === 'string' ? Buffer.from(body) : body;
  const size = head.length + bytes.length;
  if (kHead + size > buffer.length) {
    // Larger than the buffer: by itself.
    end();
    const frame = Buffer.concat([Buffer.alloc(kHead), head, bytes]);
    frame[0] = kind.charCodeAt(0);
    frame.writeUInt32LE(size, 1);
    write(frame, frame.length);
    return;
  }
  const at = begin(kind, size);
  head.copy(buffer, at);
  bytes.copy(buffer, at + head.length);
}

/** A time that may be damaged, as 64 bits hold it. */
function clamped(timeNs) {
  return timeNs > kLastTimeNs ? kLastTimeNs : timeNs < -kLastTimeNs ? -kLastTimeNs : timeNs;
}

const note = (text) => send('N', text);
const print = (line) => send('O', `${line}\n`);

let tables = 0;

/** A float32 as the number with the fewest digits that gives it back. */
function float32(value) {
  return Number(value.toPrecision(9));
}

/** The CSV of one triad. */
class Table {
  /** `about`: { recording, file, triad, unit, applied, temperature }; `isFloat32`: readings are no wider. */
  constructor(about, isFloat32) {
    this.number = tables++;
    this.triad = about.triad;
    this.narrow = isFloat32 ? float32 : (value) => value;
    this.rows = 0;
    this.longSteps = 0; // Between rows that follow each other more slowly than 5 a second.
    this.lastNs = null;
    send('T', JSON.stringify(about));
  }

  /** Adds a row; time in ns as a BigInt, temperature in degC or NaN. */
  add(timeNs, x, y, z, temperature = NaN) {
    const step = this.lastNs === null ? 0n : timeNs - this.lastNs;
    if (step > kLongStepNs && step < kLongestJumpNs) ++this.longSteps;
    this.lastNs = timeNs;
    ++this.rows;
    const at = begin('W', 2 + 5 * 8);
    buffer.writeUInt16LE(this.number, at);
    buffer.writeBigInt64LE(clamped(timeNs), at + 2);
    buffer.writeDoubleLE(this.narrow(x), at + 10);
    buffer.writeDoubleLE(this.narrow(y), at + 18);
    buffer.writeDoubleLE(this.narrow(z), at + 26);
    buffer.writeDoubleLE(float32(temperature), at + 34);
  }
}

module.exports = { Refusal, Table, clamped, count, end, listOf, note, print, printable, send };
