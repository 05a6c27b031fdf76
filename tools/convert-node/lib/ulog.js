// SPDX-License-Identifier: Apache-2.0
'use strict';

// Reads a PX4 ULog file, a stream of messages, once from beginning to end in bounded memory. The
// format has no checksums, so a message is accepted if it has the length of its definition. After
// damage reading continues at the next position with two acceptable messages in a row.

const fs = require('fs');
const { Refusal, count, printable } = require('./frames.js');

const kMagic = Buffer.from([0x55, 0x4c, 0x6f, 0x67, 0x01, 0x12, 0x35]);
const kSync = Buffer.from([0x2f, 0x73, 0x13, 0x20, 0x25, 0x0c, 0xbb, 0x12]);
const kHeaderSize = 16;
const kLongestMessage = 3 + 65535;
const kWindow = 1 << 20;

const kTypes = {
  int8_t: { size: 1, read: (b, at) => b.readInt8(at) },
  uint8_t: { size: 1, read: (b, at) => b.readUInt8(at) },
  bool: { size: 1, read: (b, at) => b.readUInt8(at) },
  char: { size: 1, read: (b, at) => b.readUInt8(at) },
  int16_t: { size: 2, read: (b, at) => b.readInt16LE(at) },
  uint16_t: { size: 2, read: (b, at) => b.readUInt16LE(at) },
  int32_t: { size: 4, read: (b, at) => b.readInt32LE(at) },
  uint32_t: { size: 4, read: (b, at) => b.readUInt32LE(at) },
  int64_t: { size: 8, read: (b, at) => b.readBigInt64LE(at) },
  uint64_t: { size: 8, read: (b, at) => b.readBigUInt64LE(at) },
  float: { size: 4, read: (b, at) => b.readFloatLE(at) },
  double: { size: 8, read: (b, at) => b.readDoubleLE(at) },
};

// Keys of information messages may have characters that no field has: "perf_counter_preflight-00".
const kInformation = /^([a-zA-Z0-9_/]+)(?:\[(\d{1,5})\])? ([!-~]+)$/;
const kField = /^([a-zA-Z0-9_/]+)(?:\[(\d{1,5})\])? ([a-zA-Z0-9_]+)$/;

function parseField(text, pattern = kField) {
  const match = pattern.exec(text);
  return match && { type: match[1], length: match[2] === undefined ? 1 : Number(match[2]), name: match[3] };
}

/** A logged text has a level, "0" to "7". */
function isLogLevel(byte) {
  return byte >= 0x30 && byte <= 0x37;
}

class Ulog {
  constructor(file) {
    this.file = file;
    this.formats = new Map(); // name -> [{ type, length, name }]
    this.layouts = new Map(); // name -> { size, least, fields: Map(name -> { at, length, read }) }
    this.subscriptions = new Map(); // message id -> { name, instance, layout, rows }
    this.parameters = new Map(); // First values, by which readings were corrected.
    this.latest = new Map(); // Last values, which the vehicle has now.
    this.info = new Map();
    this.changed = new Set(); // Names of parameters and information that have several values.
    this.damagedBytes = 0;
    this.damagedPlaces = 0;
    this.dropouts = 0;
    this.dropoutMs = 0;
    this.barriers = [];
  }

  /**
   * The layout of a message; null if its definition is missing, damaged or contains itself. `visited`:
   * definitions in progress or without a layout, so that each is processed once.
   */
  layout(name, visited = new Set()) {
    const known = this.layouts.get(name);
    if (known) return known;
    const fields = this.formats.get(name);
    if (!fields || visited.has(name)) return null;
    visited.add(name);
    const layout = { size: 0, least: 0, fields: new Map() };
    for (const field of fields) {
      const basic = kTypes[field.type];
      const size = basic ? basic.size : this.layout(field.type, visited)?.size;
      if (!size) return null;
      if (basic) {
        layout.fields.set(field.name, { at: layout.size, length: field.length, step: size, read: basic.read });
      }
      layout.size += size * field.length;
      // Padding at the end of a message is not logged.
      if (!field.name.startsWith('_padding')) layout.least = layout.size;
    }
    this.layouts.set(name, layout);
    return layout;
  }

  /** The key of an I, M, P or Q message and the position of its value; null if the message has no key. */
  static key(message, at) {
    if (message.length <= at) return null;
    const end = at + 1 + message[at];
    if (end > message.length) return null;
    const field = parseField(message.toString('latin1', at + 1, end), kInformation);
    return field && { ...field, valueAt: end };
  }

  /**
   * Whether `part` may be a message of `type` and `size`, or the beginning of a truncated one, to which
   * the firmware appended data on a crash.
   */
  isOne(type, part, size) {
    const isWhole = part.length === size;
    switch (type) {
      case 'D': {
        if (size < 2 || part.length < 2) return size >= 2;
        const subscription = this.subscriptions.get(part.readUInt16LE(0));
        if (!subscription?.layout) return Boolean(subscription) && isWhole;
        return size - 2 >= subscription.layout.least && size - 2 <= subscription.layout.size;
      }
      case 'A':
        return size > 3 && (isWhole ? /^[a-zA-Z0-9_]+$/ : /^[a-zA-Z0-9_]*$/).test(part.toString('latin1', 3));
      case 'F':
        return size > 2 && (isWhole ? /^[a-zA-Z0-9_/]+:[ -~]+$/ : /^[a-zA-Z0-9_/]*(:[ -~]*)?$/).test(part.toString('latin1'));
      case 'P':
      case 'I': {
        if (!isWhole) return Ulog.isKey(part, 0, size);
        const key = Ulog.key(part, 0);
        const basic = key && kTypes[key.type];
        return Boolean(basic) && size === key.valueAt + basic.size * key.length;
      }
      case 'M':
      case 'Q':
        return Ulog.isKey(part, 1, size);
      case 'S':
        return size === kSync.length && part.equals(kSync.subarray(0, part.length));
      case 'O':
      case 'R':
        return size === 2;
      case 'L':
        return size >= 9 && (part.length === 0 || isLogLevel(part[0]));
      case 'C':
        return size >= 11 && (part.length === 0 || isLogLevel(part[0]));
      case 'B':
        return isWhole && size >= 40 && this.formats.size === 0; // This message precedes all others.
      default:
        return false;
    }
  }

  /** Whether `part` may be all or the beginning of a message of `size` bytes with a key at byte `at`. */
  static isKey(part, at, size) {
    if (part.length <= at) return size > at + 1;
    const end = at + 1 + part[at];
    if (part[at] === 0 || end > size) return false;
    if (part.length >= end) return Ulog.key(part, at) !== null;
    return /^[a-zA-Z0-9_/]*(\[\d*(\]( [!-~]*)?)?)?( [!-~]*)?$/.test(part.toString('latin1', at + 1));
  }

  take(type, message, offset) {
    switch (type) {
      case 'F': {
        const text = message.toString('latin1');
        const fields = text.slice(text.indexOf(':') + 1).split(';').filter((field) => field).map((field) => parseField(field));
        // The first definition stays, since a later one may be damaged.
        const name = text.slice(0, text.indexOf(':'));
        if (!fields.includes(null) && !this.formats.has(name)) this.formats.set(name, fields);
        break;
      }
      case 'A': {
        const name = message.toString('latin1', 3);
        const id = message.readUInt16LE(1);
        if (this.subscriptions.has(id)) break;
        this.subscriptions.set(id, { name, instance: message[0], layout: this.layout(name), rows: 0 });
        break;
      }
      case 'P':
      case 'I': {
        const key = Ulog.key(message, 0);
        const value = key.type === 'char' ? message.toString('latin1', key.valueAt)
                                          : kTypes[key.type].read(message, key.valueAt);
        const values = type === 'I' ? this.info : this.parameters;
        if (!values.has(key.name)) values.set(key.name, value);
        else if (values.get(key.name) !== value) this.changed.add(key.name);
        if (type === 'P') this.latest.set(key.name, value);
        break;
      }
      case 'O':
        ++this.dropouts;
        this.dropoutMs += message.readUInt16LE(0);
        break;
      case 'B': {
        const incompatible = message.subarray(8, 16);
        if (incompatible.some((bits, i) => (i === 0 ? bits & ~1 : bits) !== 0)) {
          throw new Refusal(
            `${this.file}: byte ${offset}: uses ULog features that this converter does not support`, 'wrong-format');
        }
        if (incompatible[0] & 1) {
          for (let i = 16; i < 40; i += 8) {
            const at = Number(message.readBigUInt64LE(i));
            if (at > offset && at < this.size) this.barriers.push(at);
          }
          this.barriers.sort((a, b) => a - b);
        }
        break;
      }
      default:
    }
  }

  /** Reads the file; `onRow(subscription, message)`: the fields of a row begin at byte 2. */
  read(onRow) {
    const descriptor = fs.openSync(this.file, 'r');
    try {
      this.size = fs.fstatSync(descriptor).size;
      this.readFrom(descriptor, onRow);
    } finally {
      fs.closeSync(descriptor);
    }
  }

  readFrom(descriptor, onRow) {
    let window = Buffer.alloc(kWindow);
    let start = 0; // Position of the window in the file.
    let filled = 0;
    let at = 0; // Position of the next byte in the window.
    const fill = () => {
      window.copyWithin(0, at, filled);
      start += at;
      filled -= at;
      at = 0;
      while (filled < window.length) {
        const got = fs.readSync(descriptor, window, filled, window.length - filled, start + filled);
        if (got === 0) return;
        filled += got;
      }
    };
    /** The acceptable message that begins at `i` in the window and ends by `limit`; null: none. */
    const messageAt = (i, limit) => {
      if (i + 3 > limit) return null;
      const end = i + 3 + window.readUInt16LE(i);
      if (end > limit) return null;
      const type = String.fromCharCode(window[i + 2]);
      const message = window.subarray(i + 3, end);
      return this.isOne(type, message, message.length) ? { type, message, end } : null;
    };

    /** Refuses a second log in the file. A truncated log may seem to end with a message that contains the second log's start. */
    const refuseAnother = () => {
      const next = window.subarray(0, filled).indexOf(kMagic, start === 0 ? kHeaderSize : 0);
      if (next < 0) return;
      throw new Refusal(`${this.file}: another log begins at byte ${start + next}: logs of several starts of the vehicle were ` +
        'joined; convert each one separately', 'wrong-format');
    };

    fill();
    if (filled < kHeaderSize || !window.subarray(0, kMagic.length).equals(kMagic)) {
      throw new Refusal(`${this.file}: does not start like a ULog file; it is another format, or its start is missing`, 'wrong-format');
    }
    if (window[7] > 1) {
      throw new Refusal(`${this.file}: is ULog version ${window[7]}; supported are versions 0 and 1`, 'wrong-format');
    }
    refuseAnother();
    at = kHeaderSize;
    let inDamage = false;
    for (;;) {
      if (filled - at < 2 * kLongestMessage && start + filled < this.size) {
        fill();
        refuseAnother();
      }
      if (at >= filled) break;
      while (this.barriers.length > 0 && this.barriers[0] <= start + at) this.barriers.shift();
      const limit = this.barriers.length > 0 ? Math.min(filled, this.barriers[0] - start) : filled;
      const found = messageAt(at, limit);
      if (!found && !inDamage && this.barriers.length > 0 && limit === this.barriers[0] - start) {
        const left = window.subarray(at, limit);
        const size = left.length < 2 ? 0 : left.readUInt16LE(0);
        const isBegun = left.length < 3 ||
          (at + 3 + size > limit && this.isOne(String.fromCharCode(left[2]), left.subarray(3), size));
        if (isBegun) {
          at = limit;
          continue;
        }
      }
      // After damage, a byte may look like a type by chance, so two messages in a row are required.
      const proven = found && (!inDamage || found.type === 'S' || found.end === limit ||
                               messageAt(found.end, limit) !== null);
      if (!proven) {
        if (!inDamage) ++this.damagedPlaces;
        inDamage = true;
        ++this.damagedBytes;
        ++at;
        continue;
      }
      inDamage = false;
      if (found.type === 'D') {
        const subscription = this.subscriptions.get(found.message.readUInt16LE(0));
        ++subscription.rows;
        if (onRow && subscription.layout) onRow(subscription, found.message);
      } else {
        this.take(found.type, found.message, start + at);
      }
      at = found.end;
    }
  }

  /** "2 damaged places (113 bytes) skipped", or an empty text. */
  damage() {
    if (this.damagedPlaces === 0) return '';
    return `${count(this.damagedPlaces, 'damaged place', 'damaged places')} (${this.damagedBytes} bytes) skipped`;
  }

  text(key) {
    const value = this.info.get(key);
    return typeof value === 'string' ? printable(value) : '';
  }
}

module.exports = { Ulog };
