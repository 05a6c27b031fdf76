// SPDX-License-Identifier: Apache-2.0
'use strict';

// ROS 2 messages in an MCAP file: sensor_msgs/msg/Imu in m/s^2 and rad/s, MagneticField in tesla,
// stamped by their headers.

const path = require('path');
const { parse: parseDefinition } = require('@foxglove/rosmsg');
const { MessageReader } = require('@foxglove/rosmsg2-serialization');
const { BadInput, UsageError, count, inputFiles, listOf, printable } = require('./arguments.js');
const { Mcap } = require('./mcap.js');
const { RecordingFolder, breathe, converterName } = require('./recording.js');
const columns = require('./ros_columns.js');

const kFormat = 'mcap';
const kRoles = {
  'sensor_msgs/msg/Imu': 'imu',
  'sensor_msgs/Imu': 'imu',
  'sensor_msgs/msg/MagneticField': 'field',
  'sensor_msgs/MagneticField': 'field',
};

function roleOf(channel) {
  return (channel.schema && kRoles[channel.schema.name]) ?? null;
}

/** `isLaidOut`: messages of every type are of use. */
function openLog(file, isLaidOut = false) {
  return new Mcap(file, (schema) => isLaidOut || schema in kRoles);
}

function isReadable(channel) {
  return channel.encoding === 'cdr' && channel.schema?.encoding === 'ros2msg';
}

/**
 * The files, in the order of their first messages, and the topics of all with their messages:
 * { files: [{ file, damage }], topics: [{ name, type, messages, role, readable }] }.
 */
async function survey(files, isLaidOut) {
  const topics = new Map();
  const read = [];
  for (const file of files) {
    let firstNs = null;
    const log = openLog(file, isLaidOut);
    await log.read((channel, { logNs }) => {
      if (firstNs === null || logNs < firstNs) firstNs = logNs;
      let topic = topics.get(channel.topic);
      if (!topic) {
        topic = { name: channel.topic, type: channel.schema?.name ?? '', messages: 0, role: roleOf(channel),
          readable: isReadable(channel), channel };
        topics.set(channel.topic, topic);
      }
      ++topic.messages;
    });
    read.push({ file, firstNs: firstNs ?? 1n << 64n, damage: log.damage() });
  }
  read.sort((a, b) => (a.firstNs < b.firstNs ? -1 : a.firstNs > b.firstNs ? 1 : 0));
  return { files: read, topics: [...topics.values()].sort((a, b) => (a.name < b.name ? -1 : 1)) };
}

function list(topics) {
  for (const { name, type, messages, role } of topics) {
    process.stdout.write(
      `${printable(name).padEnd(40)} ${printable(type).padEnd(36)} ${String(messages).padStart(8)}${role ? '  readings' : ''}\n`);
  }
}

/** { imu, field }: the topics named, the `instance`-th of each kind, or the only ones. */
function choose(topics, options) {
  const usable = topics.filter((topic) => topic.role);
  for (const name of options.topics) {
    const topic = topics.find((candidate) => candidate.name === name);
    if (!topic) throw new UsageError(`--topic=${printable(name)}: no such topic; the file contains ${listOf(topics.map((t) => t.name))}`, 'unknown-name');
    if (!topic.role) {
      throw new UsageError(`--topic=${printable(name)}: is ${printable(topic.type)}; supported are Imu and MagneticField of sensor_msgs`);
    }
  }
  const chosen = {};
  for (const role of ['imu', 'field']) {
    const all = usable.filter((topic) => topic.role === role);
    const named = options.topics.length > 0 ? all.filter((topic) => options.topics.includes(topic.name)) : all;
    if (options.instance !== null && named.length > 0) {
      if (options.instance >= named.length) continue;
      chosen[role] = named[options.instance];
    } else if (named.length > 1) {
      throw new UsageError(`several topics have the same kind of readings; choose one with --topic: ${listOf(named.map((t) => t.name))}`);
    } else if (named.length === 1) {
      [chosen[role]] = named;
    }
    if (chosen[role] && !chosen[role].readable) {
      throw new BadInput(`${printable(chosen[role].name)}: is not ROS 2 (CDR with a ros2msg schema); convert the log to a ROS 2 bag`);
    }
  }
  if (!chosen.imu && !chosen.field) {
    if (options.instance !== null && usable.length > 0) {
      throw new UsageError(`--instance=${options.instance}: no such instance; there are fewer topics of one kind`);
    }
    throw new BadInput(`${options.input}: contains no complete message of sensor_msgs Imu or MagneticField; topics: ${listOf(topics.map((t) => t.name))}`, 'no-readings');
  }
  return chosen;
}

/** Reads messages of `channel`; throws where its schema is none. */
function readerOf(channel, readers) {
  if (!readers.has(channel)) {
    readers.set(channel, null);
    readers.set(channel, new MessageReader(parseDefinition(channel.schema.text, { ros2: true })));
  }
  return readers.get(channel);
}

/** [x, y, z] of a vector; null where the covariance says that there is none. */
function readings(vector, covariance) {
  return covariance && covariance[0] === -1 ? null : [vector.x, vector.y, vector.z];
}

/** What a message says: { timeNs, stamped, frame, readings: [[triad, [x, y, z]]] }; null: damaged. */
function decode(channel, { logNs, data }, readers) {
  try {
    const message = readerOf(channel, readers).readMessage(data);
    const { stamp, frame_id: frame } = message.header;
    const stampNs = BigInt(stamp.sec) * 1_000_000_000n + BigInt(stamp.nanosec);
    const found =
      roleOf(channel) === 'field'
        ? [['magnetometer', readings(message.magnetic_field)]]
        : [['accelerometer', readings(message.linear_acceleration, message.linear_acceleration_covariance)],
           ['gyroscope', readings(message.angular_velocity, message.angular_velocity_covariance)]];
    return { timeNs: stampNs === 0n ? logNs : stampNs, stamped: stampNs !== 0n,
      frame: printable(frame).slice(0, 100), readings: found.filter(([, values]) => values) };
  } catch {
    return null;
  }
}

/** Takes messages of sensor_msgs into tables. */
function standardTaker(chosen, folder) {
  const tables = {};
  const wanted = [...(chosen.imu ? ['accelerometer', 'gyroscope'] : []), ...(chosen.field ? ['magnetometer'] : [])];
  for (const triad of wanted) tables[triad] = folder.addTable(triad, `${triad}.csv`, false);
  const readers = new Map();
  return {
    tables,
    units: { accelerometer: 'm/s^2', gyroscope: 'rad/s', magnetometer: 'T' },
    topics: [chosen.imu, chosen.field].filter((topic) => topic).map((topic) => topic.name),
    wants: (channel) => Boolean(roleOf(channel)) && chosen[roleOf(channel)]?.name === channel.topic,
    take(channel, message) {
      const decoded = decode(channel, message, readers);
      if (!decoded) return null;
      for (const [triad, [x, y, z]] of decoded.readings) tables[triad].add(decoded.timeNs, x, y, z);
      return decoded;
    },
  };
}

/** The topics that --columns names. */
function chooseLaidOut(roles, topics) {
  for (const { topic: name } of Object.values(roles)) {
    const topic = topics.find((candidate) => candidate.name === name);
    if (!topic) {
      throw new UsageError(`--columns: no topic ${printable(name)}; the file contains ${listOf(topics.map((t) => `${t.name} (${t.type})`))}`, 'unknown-name');
    }
    if (!topic.readable) {
      throw new BadInput(`${printable(name)}: is not ROS 2 (CDR with a ros2msg schema); convert the log to a ROS 2 bag`);
    }
  }
}

/** Takes the fields that --columns names into tables; the first message of a topic must have them. */
function laidOutTaker(options, topics) {
  const roles = columns.parseColumns(options.others.columns);
  if (options.topics.length > 0 || options.instance !== null) {
    throw new UsageError('--topic and --instance do not go with --columns, which names its topics', 'conflicting-arguments');
  }
  chooseLaidOut(roles, topics);
  const sensors = Object.entries(roles).filter(([role]) => role !== 'temperature');
  const readers = new Map();
  const checked = new Set();
  let units = null;
  let degrees = NaN;
  const check = (topic, message) => {
    if (checked.has(topic)) return;
    checked.add(topic);
    for (const [role, { topic: name, fields, time }] of Object.entries(roles)) {
      if (name !== topic) continue;
      const isThere = columns.isNamed(message, fields, role === 'temperature' ? 1 : 3);
      const hasTime = !time || columns.timeAt(message, time, 1) !== null;
      if (!isThere || !hasTime) {
        const wanted = role === 'temperature' ? 'number' : 'three readings';
        const kind = isThere ? 'a time' : role === 'temperature' ? 'a number' : 'three numbers';
        const isUnnamed = !isThere && !fields;
        throw new UsageError(
          `--columns: ${isUnnamed ? `name the ${wanted} of` : `\`${printable(isThere ? time : fields)}\` is not ${kind} of`} ` +
            `${printable(topic)}, whose first message has ${listOf(columns.fieldsOf(message), 40)}; as in acc, gx+gy+gz or data:4-6`, 'unknown-name');
      }
    }
  };
  const taker = {
    tables: {},
    units: {},
    topics: [...new Set(Object.values(roles).map(({ topic }) => topic))],
    wants: (channel) => taker.topics.includes(channel.topic),
    open(folder) {
      for (const [role] of sensors) taker.tables[role] = folder.addTable(role, `${role}.csv`, false);
    },
    take(channel, { logNs, data }) {
      let message;
      try {
        message = readerOf(channel, readers).readMessage(data);
      } catch {
        return null;
      }
      check(channel.topic, message);
      if (!units) {
        // A time of ROS has a unit already.
        const needsTime = sensors.some(([, { topic, time }]) => time && topic === channel.topic && !columns.isTime(columns.at(message, time)));
        units = columns.parseUnits(options.others.units ?? '', roles, needsTime);
        Object.assign(taker.units, units);
      }
      const warmth = roles.temperature;
      if (warmth && warmth.topic === channel.topic) {
        degrees = columns.numberAt(message, warmth.fields) - (units.temperature === 'K' ? 273.15 : 0);
      }
      let stamped = true;
      for (const [role, { topic, fields, time }] of sensors) {
        if (topic !== channel.topic) continue;
        if (time && !columns.isTime(columns.at(message, time)) && !units.time) {
          Object.assign(units, columns.parseUnits(options.others.units ?? '', roles, true));
        }
        const vector = columns.vectorAt(message, fields);
        let timeNs = columns.timeAt(message, time, columns.kNsPer[units.time] ?? 1);
        if (!vector || timeNs === null) return null;
        if (timeNs === 0n && (!time || !units.time)) {
          timeNs = logNs;
          stamped = false;
        }
        taker.tables[role].add(timeNs, ...vector, degrees);
      }
      return { stamped, frame: printable(columns.at(message, 'header.frame_id') ?? '').slice(0, 100) };
    },
  };
  return taker;
}

/** Lets `taker` take what it wants of every file. */
async function takeAll(files, isLaidOut, taker) {
  const said = { frames: new Set(), damaged: 0, unstamped: 0, damage: [] };
  for (const { file } of files) {
    const log = openLog(file, isLaidOut);
    await log.read((channel, message) => {
      if (!taker.wants(channel)) return;
      const taken = taker.take(channel, message);
      if (!taken) {
        ++said.damaged;
        return;
      }
      if (!taken.stamped) ++said.unstamped;
      if (said.frames.size < 4) said.frames.add(taken.frame);
    });
    if (log.damage()) said.damage.push(files.length > 1 ? `${file}: ${log.damage()}` : log.damage());
  }
  return said;
}

async function run(options, note) {
  const isLaidOut = options.others.columns !== undefined;
  if (!isLaidOut && options.others.units) throw new UsageError('--units needs --columns', 'missing-argument');
  const { files, topics } = await survey(inputFiles(options, '.mcap'), isLaidOut);
  if (options.list) {
    for (const { file, damage } of files) if (damage) note(`${file}: ${damage}`);
    list(topics);
    return;
  }
  if (topics.length === 0) {
    const damages = files.map(({ damage }) => damage).filter((text) => text);
    throw new BadInput(`${options.input}: contains no topic that can be read${damages.length > 0 ? `: ${damages.join('; ')}` : ''}`, 'no-readings');
  }
  const laidOut = isLaidOut ? laidOutTaker(options, topics) : null;
  const chosen = isLaidOut ? null : choose(topics, options);
  const folder = new RecordingFolder(options.output, files.map(({ file }) => file));
  if (laidOut) laidOut.open(folder);
  const taker = laidOut ?? standardTaker(chosen, folder);
  const { frames, damaged, unstamped, damage } = await takeAll(files, isLaidOut, taker);
  folder.closeTables();
  const source = { format: 'mcap', file: path.basename(options.input), converter: converterName(kFormat), topics: taker.topics.join(' ') };
  if (files.length > 1) source.bags = String(files.length);
  if (isLaidOut) source.columns = options.others.columns;
  if (damage.length > 0) source.damage = damage.join('; ');
  if (unstamped > 0) source.time = `of receipt for ${unstamped} messages without a stamp`;
  const written = folder.writeManifest('recording.yaml', {
    source,
    frame: [...frames].filter((frame) => frame).join(' '),
    streams: Object.entries(taker.tables).map(([triad, table]) => ({ table, unit: taker.units[triad] })),
  });
  if (!written) {
    const why = damage.length > 0 ? `: ${damage.join('; ')}` : '';
    throw new BadInput(`${options.input}: the log contains no complete reading${why}`, 'no-readings');
  }
  await breathe();
  folder.commit();
  for (const table of Object.values(taker.tables)) note(table.summary());
  if (damaged > 0) note(`${count(damaged, 'message', 'messages')} could not be decoded`);
  if (unstamped > 0) note(`${count(unstamped, 'message has', 'messages have')} no time stamp; used the time of receipt`);
  for (const text of damage) note(files.length > 1 ? text : `${options.input}: ${text}`);
  process.stdout.write(`${path.join(options.output, 'recording.yaml')}\n`);
}

module.exports = {
  format: kFormat,
  input: 'a ROS 2 bag (.mcap)',
  takesSeveral: true,
  takesTopics: true,
  takesInstance: true,
  others: ['columns', 'units'],
  run,
  details:
    'Converts one topic of sensor_msgs/msg/Imu and one of sensor_msgs/msg/MagneticField; if there\n' +
    'are several, choose with --topic, or with --instance (from 0, in the order of --list). A message\n' +
    'does not state what the driver corrected: check that it publishes raw readings.\n' +
    '\nOther messages: --columns=accelerometer=/topic:fields,gyroscope=… says which fields are the\n' +
    'readings (acc, gx+gy+gz, or data:4-6, counted from 1), `@field` behind them which is their time,\n' +
    'temperature=/topic:field; --units=us,m/s^2,rad/s,uT,degC. Several bags, or a folder of them, are\n' +
    'one recording.\n',
};
