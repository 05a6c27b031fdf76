// SPDX-License-Identifier: Apache-2.0
'use strict';

// The frame of an MCAP file, read once from begin to end with one chunk in memory at a time. A chunk
// that is cut, damaged or too large is passed over and counted; where the records themselves cannot
// be followed, reading goes on at the next chunk that the file's index names.

const fs = require('fs');
const { Refusal, clamped, note, send } = require('./frames.js');

const kMagic = Buffer.from([0x89, 0x4d, 0x43, 0x41, 0x50, 0x30, 0x0d, 0x0a]);
const kRecordHead = 9; // Opcode and length.
const kFooterSize = kRecordHead + 20 + kMagic.length;
const kLargestChunk = 1 << 29;
const kOp = { footer: 0x02, schema: 0x03, channel: 0x04, message: 0x05, chunk: 0x06, chunkIndex: 0x08, dataEnd: 0x0f };

/** Fields of a record one after another; throws where they end. */
class Cursor {
  constructor(bytes) {
    this.bytes = bytes;
    this.at = 0;
  }

  take(size) {
    if (size > this.bytes.length - this.at) throw new RangeError('the record is cut');
    this.at += size;
    return this.bytes.subarray(this.at - size, this.at);
  }

  u16() { return this.take(2).readUInt16LE(0); }
  u32() { return this.take(4).readUInt32LE(0); }
  u64() { return this.take(8).readBigUInt64LE(0); }
  text() { return this.take(this.u32()).toString('utf8'); }
  rest() { return this.bytes.subarray(this.at); }
}

/** The records in `bytes` one after another, [opcode, content]; null at last where one is cut. */
function* recordsIn(bytes) {
  for (let at = 0; at < bytes.length;) {
    const size = at + kRecordHead <= bytes.length ? bytes.readBigUInt64LE(at + 1) : -1n;
    if (size < 0n || size > BigInt(bytes.length - at - kRecordHead)) {
      yield null;
      return;
    }
    const end = at + kRecordHead + Number(size);
    yield [bytes[at], bytes.subarray(at + kRecordHead, end)];
    at = end;
  }
}

let crcTable = null;

/** CRC-32 of `bytes` (IEEE 802.3). */
function crc32(bytes) {
  if (!crcTable) {
    crcTable = new Int32Array(256);
    for (let i = 0; i < 256; ++i) {
      let value = i;
      for (let bit = 0; bit < 8; ++bit) value = value & 1 ? (value >>> 1) ^ 0xedb88320 : value >>> 1;
      crcTable[i] = value;
    }
  }
  let crc = -1;
  for (let i = 0; i < bytes.length; ++i) crc = crcTable[(crc ^ bytes[i]) & 0xff] ^ (crc >>> 8);
  return (crc ^ -1) >>> 0;
}

async function loadDecompressors() {
  const lz4 = require('@foxglove/wasm-lz4');
  const zstd = require('@foxglove/wasm-zstd');
  await Promise.all([lz4.isLoaded, zstd.isLoaded]);
  return { lz4: (bytes, size) => lz4(bytes, size), zstd: (bytes, size) => zstd.decompress(bytes, size) };
}

class Mcap {
  constructor(file) {
    this.file = file;
    this.schemas = new Map(); // id -> { name, encoding, text }
    this.channels = new Map(); // id -> { topic, encoding, schema }
    this.damaged = new Map(); // what -> how many
  }

  count(what) {
    this.damaged.set(what, (this.damaged.get(what) ?? 0) + 1);
  }

  /** Calls `onMessage(channel, logNs, data)` for every message. */
  async read(onMessage) {
    this.onMessage = onMessage;
    this.decompressors ??= await loadDecompressors();
    this.descriptor = fs.openSync(this.file, 'r');
    try {
      this.size = fs.fstatSync(this.descriptor).size;
      const head = this.bytes(0, kMagic.length);
      if (!head || !head.equals(kMagic)) {
        throw new Refusal(`${this.file}: does not start like an MCAP file; it is another format, or its start is missing`, 'wrong-format');
      }
      let at = kMagic.length;
      while (at !== null && at < this.size) at = this.records(at);
    } finally {
      fs.closeSync(this.descriptor);
    }
  }

  /** `size` bytes at `at`; null where the file ends before. */
  bytes(at, size) {
    if (at + size > this.size) return null;
    const bytes = Buffer.allocUnsafe(size);
    for (let got = 0; got < size;) {
      const more = fs.readSync(this.descriptor, bytes, got, size - got, at + got);
      if (more === 0) return null;
      got += more;
    }
    return bytes;
  }

  /** Reads records from `at` on. Where to go on after some that cannot be followed; null: the end. */
  records(begin) {
    for (let at = begin; at < this.size;) {
      const head = this.bytes(at, kRecordHead);
      if (!head) {
        this.count('cut record(s)');
        return null;
      }
      const opcode = head[0];
      const length = head.readBigUInt64LE(1);
      const known = (opcode >= 0x01 && opcode <= 0x0f) || opcode >= 0x80;
      const whole = length <= BigInt(this.size - at - kRecordHead);
      if (!known || !whole) {
        // A file that was not closed ends in a chunk of which a part is there.
        if (known && opcode === kOp.chunk) {
          const rest = Math.min(this.size - at - kRecordHead, kLargestChunk);
          this.chunk(this.bytes(at + kRecordHead, rest), true);
        }
        this.count(whole ? 'unreadable place(s)' : 'cut record(s)');
        return this.nextChunk(at);
      }
      const size = Number(length);
      if (opcode === kOp.footer || opcode === kOp.dataEnd) return null;
      if ([kOp.schema, kOp.channel, kOp.message, kOp.chunk].includes(opcode)) {
        if (size > kLargestChunk) {
          this.count('record(s) too large');
        } else {
          const bytes = this.bytes(at + kRecordHead, size);
          if (opcode === kOp.chunk) this.chunk(bytes, false);
          else this.record(opcode, bytes);
        }
      }
      at += kRecordHead + size;
    }
    return null;
  }

  chunk(bytes, isCut) {
    let what = isCut ? 'cut chunk(s)' : 'damaged chunk(s)';
    try {
      const cursor = new Cursor(bytes);
      cursor.take(16); // Times of its messages.
      const size = Number(cursor.u64());
      const crc = cursor.u32();
      const compression = cursor.text();
      cursor.u64();
      let records = cursor.rest();
      if (size > kLargestChunk) {
        what = 'chunk(s) too large';
        throw new RangeError(what);
      }
      if (compression !== '') {
        const decompress = this.decompressors[compression];
        if (!decompress) {
          what = `chunk(s) in unknown compression ${compression.slice(0, 20).replace(/[^A-Za-z0-9]/g, '?')}`;
          throw new RangeError(what);
        }
        if (isCut) throw new RangeError(what);
        const plain = decompress(records, size);
        records = Buffer.from(plain.buffer, plain.byteOffset, plain.byteLength);
      }
      if (!isCut && crc !== 0 && crc32(records) !== crc) throw new RangeError(what);
      for (const found of recordsIn(records)) {
        if (found) this.record(...found);
        else if (!isCut) this.count('cut record(s)');
      }
    } catch (error) {
      if (error.syscall) throw error; // Nobody reads the pipe.
      this.count(what);
    }
  }

  record(opcode, bytes) {
    try {
      const cursor = new Cursor(bytes);
      if (opcode === kOp.schema) {
        const id = cursor.u16();
        const name = cursor.text();
        const encoding = cursor.text();
        const text = cursor.text();
        if (!this.schemas.has(id)) this.schemas.set(id, { name, encoding, text });
      } else if (opcode === kOp.channel) {
        const id = cursor.u16();
        const schema = this.schemas.get(cursor.u16());
        const topic = cursor.text();
        const encoding = cursor.text();
        if (!this.channels.has(id)) this.channels.set(id, { topic, encoding, schema });
      } else if (opcode === kOp.message) {
        const channel = this.channels.get(cursor.u16());
        cursor.u32(); // Sequence.
        const logNs = clamped(cursor.u64());
        cursor.u64(); // When it was published.
        if (channel) this.onMessage(channel, logNs, cursor.rest());
        else this.count('message(s) of an unknown channel');
      }
    } catch (error) {
      if (!(error instanceof RangeError)) throw error;
      this.count('damaged record(s)');
    }
  }

  /** Where the first chunk after `at` begins that the index at the end of the file names. */
  nextChunk(at) {
    const footer = this.bytes(Math.max(this.size - kFooterSize, 0), kFooterSize);
    if (!footer || footer[0] !== kOp.footer || !footer.subarray(-kMagic.length).equals(kMagic)) return null;
    const begin = footer.readBigUInt64LE(kRecordHead);
    const size = BigInt(this.size - kFooterSize) - begin;
    if (begin === 0n || size <= 0n || size > BigInt(kLargestChunk)) return null;
    const summary = this.bytes(Number(begin), Number(size));
    let next = null;
    for (const found of recordsIn(summary)) {
      if (found?.[0] !== kOp.chunkIndex || found[1].length < 24) continue;
      const offset = Number(found[1].readBigUInt64LE(16));
      if (offset > at && offset < Number(begin) && (next === null || offset < next)) next = offset;
    }
    return next;
  }
}

/** "sensor_msgs/msg/Imu", and what the channel is where it is none of ROS 2. */
function typeOf({ encoding, schema }) {
  const isRos2 = encoding === 'cdr' && ['ros2msg', 'ros2idl'].includes(schema?.encoding);
  return isRos2 ? schema.name : `${schema?.name ?? 'nothing'} as ${encoding}, not ROS 2 (CDR)`;
}

/** The topics that have messages, in the order of their names; C++ gives them numbers. */
function sendTopics(log, topics) {
  for (const { channel, type, messages, first, last } of [...topics.values()].sort((a, b) => (a.channel.topic < b.channel.topic ? -1 : 1))) {
    const definition = channel.schema?.encoding === 'ros2msg' ? channel.schema.text : '';
    send('C', JSON.stringify({ name: channel.topic, type, messages, definition,
      first: Number(first), last: Number(last) }));
  }
  const damage = [...log.damaged].map(([what, number]) => `${number} ${what}`).join(', ');
  if (damage) note(`${log.file}: ${damage}`);
}

/** Sends the topics; or, of those that are `wanted`, [[name, type, number], …], the messages. */
async function run({ input, wanted }) {
  const log = new Mcap(input);
  const topics = new Map();
  const head = Buffer.alloc(2 + 8);
  const numbers = new Map((wanted ?? []).map(([name, type, number]) => [`${name} ${type}`, number]));
  await log.read((channel, logNs, data) => {
    const type = typeOf(channel);
    const key = `${channel.topic} ${type}`;
    if (!wanted) {
      if (!topics.has(key)) topics.set(key, { channel, type, messages: 0, first: logNs, last: logNs });
      const topic = topics.get(key);
      ++topic.messages;
      if (logNs < topic.first) topic.first = logNs;
      if (logNs > topic.last) topic.last = logNs;
    } else if (numbers.has(key)) {
      head.writeUInt16LE(numbers.get(key), 0);
      head.writeBigInt64LE(logNs, 2);
      send('P', data, head);
    }
  });
  if (wanted) send('D', JSON.stringify(Object.fromEntries(log.damaged)));
  else sendTopics(log, topics);
}

module.exports = { run };
