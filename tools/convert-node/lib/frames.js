// SPDX-License-Identifier: Apache-2.0
'use strict';

// Lines for the pipe: a letter, then either JSON or the numbers of a row. E: an error, N: a note for
// the user, O: a line of --list, T: a table, W: a row, M: a manifest, X: the end.

const fs = require('fs');

const kPipe = 3;
const kWrittenAtOnce = 1 << 18;
const kLastTimeNs = (1n << 63n) - 1n;
// A step of the clock by one day or more is damage.
const kLongestJumpNs = 86_400_000_000_000n;
// A longer interval means a rate below 5 Hz: 0.2 s, plus a tenth as tolerance.
const kLongStepNs = 220_000_000n;

let waiting = '';

/** The error that refuses a log. `code`: as in docs/reasons.md. */
class Refusal extends Error {
  constructor(message, code) {
    super(message);
    this.code = code;
  }
}

/** `text` with each character that could control a terminal replaced by `?`. */
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

function end() {
  const bytes = Buffer.from(waiting);
  for (let at = 0; at < bytes.length;) at += fs.writeSync(kPipe, bytes, at);
  waiting = '';
}

function sendText(kind, text) {
  waiting += `${kind}${text}\n`;
  if (waiting.length > kWrittenAtOnce) end();
}

const send = (kind, value) => sendText(kind, JSON.stringify(value));

/** Limits a time to 64 bits, which a damaged time may exceed. */
function clamped(timeNs) {
  return timeNs > kLastTimeNs ? kLastTimeNs : timeNs < -kLastTimeNs ? -kLastTimeNs : timeNs;
}

const note = (text) => send('N', text);
const print = (line) => send('O', line);

let tables = 0;

/** Nine digits, which read back to the same float32. */
const float32 = (value) => value.toPrecision(9);

/** The CSV of one triad. */
class Table {
  /** `about`: { recording, file, triad, unit, applied, temperature }; `isFloat32`: readings are float32. */
  constructor(about, isFloat32) {
    this.number = tables++;
    this.triad = about.triad;
    this.text = isFloat32 ? float32 : String;
    this.rows = 0;
    this.longSteps = 0; // Intervals of a rate below 5 Hz.
    this.lastNs = null;
    send('T', about);
  }

  /** Adds a row; time in ns as a BigInt, temperature in degC or NaN. */
  add(timeNs, x, y, z, temperature = NaN) {
    const step = this.lastNs === null ? 0n : timeNs - this.lastNs;
    if (step > kLongStepNs && step < kLongestJumpNs) ++this.longSteps;
    this.lastNs = timeNs;
    ++this.rows;
    sendText('W', `${this.number} ${clamped(timeNs)} ${this.text(x)} ${this.text(y)} ${this.text(z)} ${float32(temperature)}`);
  }
}

module.exports = { Refusal, Table, count, end, listOf, note, print, printable, send };
