// SPDX-License-Identifier: Apache-2.0
'use strict';

// ROS 2 messages in an MCAP file: sensor_msgs/msg/Imu in m/s^2 and rad/s, MagneticField in tesla,
// stamped by their headers.

const path = require('path');
const { parse: parseDefinition } = require('@foxglove/rosmsg');
const { MessageReader } = require('@foxglove/rosmsg2-serialization');
const { BadInput, UsageError, count, listOf, printable } = require('./arguments.js');
const { Mcap } = require('./mcap.js');
const { RecordingFolder, breathe, converterName } = require('./recording.js');

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

function openLog(file) {
  return new Mcap(file, (schema) => schema in kRoles);
}

function isReadable(channel) {
  return channel.encoding === 'cdr' && channel.schema?.encoding === 'ros2msg';
}

/** Topics with their messages: [{ name, type, messages, role, readable }]. */
async function topicsOf(log) {
  const topics = new Map();
  await log.read((channel) => {
    let topic = topics.get(channel.topic);
    if (!topic) {
      topic = { name: channel.topic, type: channel.schema?.name ?? '', messages: 0, role: roleOf(channel),
        readable: isReadable(channel) };
      topics.set(channel.topic, topic);
    }
    ++topic.messages;
  });
  return [...topics.values()].sort((a, b) => (a.name < b.name ? -1 : 1));
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

async function run(options, note) {
  const log = openLog(options.input);
  const topics = await topicsOf(log);
  if (options.list) {
    if (log.damage()) note(`${options.input}: ${log.damage()}`);
    list(topics);
    return;
  }
  const chosen = choose(topics, options);
  const folder = new RecordingFolder(options.output, options.input);
  const tables = {};
  const units = { accelerometer: 'm/s^2', gyroscope: 'rad/s', magnetometer: 'T' };
  const wanted = [...(chosen.imu ? ['accelerometer', 'gyroscope'] : []), ...(chosen.field ? ['magnetometer'] : [])];
  for (const triad of wanted) tables[triad] = folder.addTable(triad, `${triad}.csv`, false);

  const readers = new Map();
  const frames = new Set();
  let damaged = 0;
  let unstamped = 0;
  const again = openLog(options.input);
  await again.read((channel, message) => {
    const role = roleOf(channel);
    if (!role || chosen[role]?.name !== channel.topic) return;
    const decoded = decode(channel, message, readers);
    if (!decoded) {
      ++damaged;
      return;
    }
    if (!decoded.stamped) ++unstamped;
    if (frames.size < 4) frames.add(decoded.frame);
    for (const [triad, [x, y, z]] of decoded.readings) tables[triad].add(decoded.timeNs, x, y, z);
  });
  folder.closeTables();
  const names = [chosen.imu, chosen.field].filter((topic) => topic).map((topic) => topic.name);
  const source = { format: 'mcap', file: path.basename(options.input), converter: converterName(kFormat), topics: names.join(' ') };
  if (again.damage()) source.damage = again.damage();
  if (unstamped > 0) source.time = `of receipt for ${unstamped} messages without a stamp`;
  const written = folder.writeManifest('recording.yaml', {
    source,
    frame: [...frames].filter((frame) => frame).join(' '),
    streams: Object.entries(tables).map(([triad, table]) => ({ table, unit: units[triad] })),
  });
  if (!written) throw new BadInput(`${options.input}: the log contains no complete reading`, 'no-readings');
  await breathe();
  folder.commit();
  for (const table of Object.values(tables)) note(table.summary());
  if (damaged > 0) note(`${count(damaged, 'message', 'messages')} could not be decoded`);
  if (unstamped > 0) note(`${count(unstamped, 'message has', 'messages have')} no time stamp; used the time of receipt`);
  if (again.damage()) note(`${options.input}: ${again.damage()}`);
  process.stdout.write(`${path.join(options.output, 'recording.yaml')}\n`);
}

module.exports = {
  format: kFormat,
  input: 'a ROS 2 bag (.mcap)',
  takesTopics: true,
  takesInstance: true,
  run,
  details:
    'Converts one topic of sensor_msgs/msg/Imu and one of sensor_msgs/msg/MagneticField; if there\n' +
    'are several, choose with --topic, or with --instance (from 0, in the order of --list). A message\n' +
    'does not state what the driver corrected: check that it publishes raw readings.\n',
};
