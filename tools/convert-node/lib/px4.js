// SPDX-License-Identifier: Apache-2.0
'use strict';

// Which topics of a PX4 log hold readings, and what they are. PX4: msg/Sensor*.msg, msg/Vehicle*.msg.

const { Refusal, Table, count, listOf, note, print, printable, send } = require('./frames.js');
const { Ulog } = require('./ulog.js');

const kInvalidRelativeTime = 0x7fffffff;
// Fewer readings a second do not follow a hand's turn.
const kSlowestHz = 5;
const kHowToLog = 'SDLOG_MODE 2 logs unarmed, and sensor comparison in SDLOG_PROFILE raw readings at 10 Hz';

/** Streams of a topic. `fields`: the three readings; `relative`: µs to add to the time. */
const kTopics = {
  sensor_accel: [{ triad: 'accelerometer', unit: 'm/s^2', fields: ['x', 'y', 'z'] }],
  sensor_gyro: [{ triad: 'gyroscope', unit: 'rad/s', fields: ['x', 'y', 'z'] }],
  sensor_mag: [{ triad: 'magnetometer', unit: 'G', fields: ['x', 'y', 'z'] }],
  sensor_accel_fifo: [{ triad: 'accelerometer', unit: 'm/s^2', fields: ['x', 'y', 'z'], fifo: true }],
  sensor_gyro_fifo: [{ triad: 'gyroscope', unit: 'rad/s', fields: ['x', 'y', 'z'], fifo: true }],
  sensor_combined: [
    { triad: 'accelerometer', unit: 'm/s^2', array: 'accelerometer_m_s2',
      relative: 'accelerometer_timestamp_relative', corrected: true },
    { triad: 'gyroscope', unit: 'rad/s', array: 'gyro_rad', corrected: true },
    { triad: 'magnetometer', unit: 'G', array: 'magnetometer_ga',
      relative: 'magnetometer_timestamp_relative', corrected: true },
  ],
  vehicle_acceleration: [{ triad: 'accelerometer', unit: 'm/s^2', array: 'xyz', corrected: 'filtered' }],
  vehicle_angular_velocity: [{ triad: 'gyroscope', unit: 'rad/s', array: 'xyz', corrected: 'filtered' }],
  vehicle_magnetometer: [{ triad: 'magnetometer', unit: 'G', array: 'magnetometer_ga', corrected: true }],
};
const kRawTopics = ['sensor_accel', 'sensor_gyro', 'sensor_mag', 'sensor_accel_fifo', 'sensor_gyro_fifo'];

/** What a row of `subscription` means for `stream`; null when its layout has no such fields. */
function decoder(subscription, stream) {
  const { fields } = subscription.layout;
  const field = (name, length = 1) => {
    const found = fields.get(name);
    return found && found.length >= length ? found : null;
  };
  const reader = (found, i = 0) => (message) => {
    const at = 2 + found.at + i * found.step;
    return at + found.step <= message.length ? Number(found.read(message, at)) : NaN;
  };
  // A combined topic states the times of its sensors relative to its own.
  const isCombined = fields.has('accelerometer_timestamp_relative');
  const time = (!isCombined && field('timestamp_sample')) || field('timestamp');
  if (!time || time.step !== 8) return null;
  const decode = {
    unit: stream.unit,
    timeUs: (message) => BigInt(time.read(message, 2 + time.at)),
    axes: null,
    temperature: null,
    relative: stream.relative && field(stream.relative) ? reader(field(stream.relative)) : null,
    scale: null,
    device: field('device_id') ? reader(field('device_id')) : null,
  };
  if (field('temperature') && !stream.fifo) decode.temperature = reader(field('temperature'));
  if (stream.array) {
    const array = field(stream.array, 3);
    if (!array) return null;
    decode.axes = [0, 1, 2].map((i) => reader(array, i));
    return decode;
  }
  // Old firmware corrected in its drivers; the counts beside it are what the chip said.
  const raw = stream.fields.map((name) => field(`${name}_raw`));
  const found = raw.every((axis) => axis) ? raw : stream.fields.map((name) => field(name));
  if (!found.every((axis) => axis)) return null;
  if (stream.fifo) {
    const [dt, scale, samples] = ['dt', 'scale', 'samples'].map((name) => field(name));
    if (!dt || !scale || !samples) return null;
    decode.fifo = { axes: found, dtUs: reader(dt), scale: reader(scale), samples: reader(samples) };
    return decode;
  }
  decode.axes = found.map((axis) => reader(axis));
  if (found === raw) {
    decode.unit = 'counts';
    decode.scale = field('scaling') ? reader(field('scaling')) : null;
  }
  return decode;
}

const byNameAndInstance = (a, b) => (a.name < b.name ? -1 : a.name > b.name ? 1 : a.instance - b.instance);

/** The topics with readings that the log holds: [{ name, instance, id, rows, subscription }]. */
function present(log) {
  const found = [];
  for (const [id, subscription] of log.subscriptions) {
    if (subscription.rows === 0 || !subscription.layout) continue;
    const streams = kTopics[subscription.name];
    if (!streams || !streams.some((stream) => decoder(subscription, stream))) continue;
    found.push({ id, name: subscription.name, instance: subscription.instance, rows: subscription.rows });
  }
  return found.sort(byNameAndInstance);
}

function list(log) {
  const all = [...log.subscriptions.values()].filter((subscription) => subscription.rows > 0).sort(byNameAndInstance);
  print('topic                          instance      rows');
  for (const { name, instance, rows } of all) {
    const use = !kTopics[name] ? '' : kRawTopics.includes(name) ? '  readings' : '  corrected readings';
    print(`${printable(name).padEnd(30)} ${String(instance).padStart(8)} ${String(rows).padStart(9)}${use}`);
  }
}

/** The topics to convert. */
function choose(log, file, topics) {
  const found = present(log);
  const names = [...new Set(found.map((topic) => topic.name))];
  if (topics.length > 0) {
    for (const topic of topics) {
      if (!kTopics[topic]) {
        throw new Refusal(`--topic=${printable(topic)}: is not among ${listOf(Object.keys(kTopics), 20)}`, 'unknown-name');
      }
      if (!names.includes(topic)) {
        throw new Refusal(`--topic=${topic}: ${file} has no such readings; it contains ${listOf(names)}`, 'unknown-name');
      }
    }
    const triads = topics.flatMap((topic) => kTopics[topic].map((stream) => stream.triad));
    if (new Set(triads).size < triads.length) {
      throw new Refusal(`--topic=${topics.join(',')}: give one topic for each kind of sensor`, 'invalid-argument');
    }
    return found.filter((topic) => topics.includes(topic.name));
  }
  let raw = found.filter((topic) => kRawTopics.includes(topic.name));
  // Of the two that say the same, the one with every reading.
  for (const topic of ['sensor_accel', 'sensor_gyro']) {
    if (raw.some(({ name }) => name === `${topic}_fifo`)) raw = raw.filter(({ name }) => name !== topic);
  }
  if (raw.length > 0) return raw;
  const corrected = names.filter((name) => !kRawTopics.includes(name));
  throw new Refusal(
    corrected.length > 0
      ? `${file}: contains only readings corrected by the firmware (${listOf(corrected)}); log ` +
        `sensor_accel, sensor_gyro and sensor_mag (${kHowToLog}), or convert these with --topic=${corrected[0]}`
      : `${file}: contains no readings of an accelerometer, gyroscope or magnetometer; topics: ${listOf(
        [...new Set([...log.subscriptions.values()].filter((s) => s.rows > 0).map((s) => s.name))])}`, 'wrong-format');
}

function product(a, b) {
  return a.map((row) => [0, 1, 2].map((j) => row[0] * b[0][j] + row[1] * b[1][j] + row[2] * b[2][j]));
}

/** Rotation of the board, body <- sensor; null: one that is not among `rotations`. */
function boardRotation(parameters, rotations) {
  const rotation = rotations[parameters.get('SENS_BOARD_ROT') ?? 0];
  if (!rotation) return null;
  const [roll, pitch, yaw] = ['X', 'Y', 'Z'].map(
    (axis) => ((parameters.get(`SENS_BOARD_${axis}_OFF`) ?? 0) * Math.PI) / 180);
  const about = (angle, i, j) => {
    const matrix = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
    matrix[i][i] = matrix[j][j] = Math.cos(angle);
    matrix[i][j] = -Math.sin(angle);
    matrix[j][i] = Math.sin(angle);
    return matrix;
  };
  // Roll, then pitch, then yaw.
  const offset = product(about(yaw, 0, 1), product(about(pitch, 2, 0), about(roll, 1, 2)));
  return product(offset, rotation);
}

const kSensors = {
  accelerometer: { name: 'ACC', thermal: 'TC_A' },
  gyroscope: { name: 'GYRO', thermal: 'TC_G' },
  magnetometer: { name: 'MAG', thermal: 'TC_M' },
};

/**
 * The set of parameters of each of `devices`: that with its number, else the first that is nobody's, else
 * -1. PX4: src/lib/sensor_calibration/Utilities.cpp (FindAvailableCalibrationIndex).
 */
function slotsOf(parameters, prefix, devices) {
  const ids = [0, 1, 2, 3].map((n) => parameters.get(`${prefix}${n}_ID`) || 0);
  return new Map(devices.map((device) => {
    const free = ids.indexOf(0);
    if (!ids.includes(device) && free >= 0) ids[free] = device;
    return [device, ids.indexOf(device)];
  }));
}

/** The devices of a kind of sensor that `topics` are of, by their instances. */
function devicesOf(log, topics, triad) {
  return topics.filter(({ name }) => kTopics[name].length === 1 && kTopics[name][0].triad === triad)
    .map(({ id, name }) => {
      const subscription = log.subscriptions.get(id);
      return decoder(subscription, kTopics[name][0])?.device?.(subscription.first);
    }).filter((device) => device > 0);
}

/**
 * The turn from the axes of the board into those of the magnetometer `device`, whose parameters are `slot`;
 * undefined: the log does not say.
 */
function magnetometerTurn({ parameters, latest, changed }, device, slot, rotations) {
  const id = latest.get(`CAL_MAG${slot}_ID`);
  const number = latest.get(`CAL_MAG${slot}_ROT`);
  const isOther = id !== undefined && id !== device;
  if (isOther || [...changed].some((key) => key === `CAL_MAG${slot}_ROT` || key.startsWith('SENS_BOARD'))) return undefined;
  if (number === -1) return rotations[0]; // It is on the board.
  const board = boardRotation(parameters, rotations);
  const sensor = rotations[number];
  // Both are into the body's axes.
  return sensor && board ? product([0, 1, 2].map((i) => sensor.map((row) => row[i])), board) : undefined;
}

/**
 * What the firmware has done to the primary sensor of `triad`, as behind `applied.<triad>:`; 'unknown'
 * where its parameters do not tell. corrected = matrix · ((reading − offset) ∘ scale).
 */
function applied(log, triad, rotations) {
  const { parameters, changed } = log;
  const { name, thermal } = kSensors[triad];
  if (parameters.get(`${thermal}_ENABLE`)) return 'unknown';
  const primary = parameters.get(`CAL_${name}_PRIME`);
  const slot = [0, 1, 2, 3].find((n) => primary && parameters.get(`CAL_${name}${n}_ID`) === primary);
  if (slot === undefined) return 'unknown';
  const prefix = `CAL_${name}${slot}_`;
  // A mounting of its own, currents, or a matrix: not undone here.
  if (triad === 'magnetometer' && (parameters.get(`${prefix}ROT`) ?? -1) > 0) return 'unknown';
  for (const key of ['XODIAG', 'YODIAG', 'ZODIAG', 'XCOMP', 'YCOMP', 'ZCOMP']) {
    if (parameters.get(prefix + key)) return 'unknown';
  }
  const values = (what, otherwise) => ['X', 'Y', 'Z'].map((axis) => parameters.get(prefix + axis + what) ?? otherwise);
  const offset = values('OFF', NaN);
  const scale = values('SCALE', 1);
  const matrix = boardRotation(parameters, rotations);
  const fixed = [...changed].every((key) => !key.startsWith(prefix) && !key.startsWith('SENS_BOARD'));
  if (!matrix || !fixed || !offset.every(Number.isFinite) || !scale.every((s) => s > 0)) return 'unknown';
  const text = (value) => Number(value.toPrecision(9));
  return { offset: offset.map(text), scale: scale.map(text), matrix: matrix.map((row) => row.map((entry) => entry + 0)) };
}

/** What stands behind `applied.<triad>:` in a manifest. */
function appliedText(map) {
  if (map === undefined) return '';
  if (map === 'unknown') return ' unknown\n';
  return `\n${Object.entries(map).map(([key, value]) => `    ${key}: ${JSON.stringify(value)}\n`).join('')}`;
}

/** Streams that will be written: one a sensor of each chosen topic. `slots`: of magnetometers. */
function openStreams(log, topics, slots, rotations) {
  const opened = new Map(); // message id -> streams
  for (const topic of topics) {
    const subscription = log.subscriptions.get(topic.id);
    for (const stream of kTopics[topic.name]) {
      const decode = decoder(subscription, stream);
      if (!decode) continue;
      const suffix = topic.instance > 0 ? `-${topic.instance}` : '';
      const device = decode.device ? decode.device(subscription.first) : 0;
      const turn = topic.name !== 'sensor_mag' ? undefined
        : magnetometerTurn(log, device, slots.get(device) ?? topic.instance, rotations);
      const isTurned = turn && turn.some((row, i) => row[i] !== 1);
      const map = !stream.corrected ? (isTurned ? { matrix: turn } : undefined)
        : stream.corrected === 'filtered' ? 'unknown' : applied(log, stream.triad, rotations);
      const table = new Table(
        { recording: topic.instance, file: `${stream.triad}${suffix}.csv`, triad: stream.triad, unit: decode.unit,
          temperature: decode.temperature !== null, applied: appliedText(map) }, true);
      const entry = { file: log.file, topic, decode, table, device: undefined, deviceBefore: 0, scales: new Set(),
        lastNs: null, repeated: 0, applied: map, turn };
      opened.set(topic.id, [...(opened.get(topic.id) ?? []), entry]);
    }
  }
  return opened;
}

/** A row of `entry` is of `device`. Damage makes a number up, but not twice in turn. */
function takeDevice(entry, device) {
  if (device > 0 && device === entry.deviceBefore) {
    entry.device ??= device;
    if (device !== entry.device) {
      const { file, topic } = entry;
      throw new Refusal(`${file}: ${topic.name}#${topic.instance} is of device ${entry.device} and then of ${device}, ` +
        "which are not one sensor; where logs were joined, give each vehicle's log by itself", 'other-device');
    }
  }
  entry.deviceBefore = device;
}

function takeRow(entry, message) {
  const { decode, table } = entry;
  takeDevice(entry, decode.device ? decode.device(message) : 0);
  let timeUs = decode.timeUs(message);
  if (decode.fifo) {
    const { axes, dtUs, scale, samples } = decode.fifo;
    const number = Math.min(samples(message), axes[0].length);
    const spacingNs = Math.round(dtUs(message) * 1000);
    const factor = scale(message);
    if (!(spacingNs > 0) || !(factor > 0)) return;
    for (let i = 0; i < number; ++i) {
      const timeNs = timeUs * 1000n - BigInt((number - 1 - i) * spacingNs);
      const [x, y, z] = axes.map((axis) => {
        const at = 2 + axis.at + i * axis.step;
        return at + axis.step <= message.length ? factor * axis.read(message, at) : NaN;
      });
      table.add(timeNs, x, y, z);
    }
    return;
  }
  if (decode.relative) {
    const relative = decode.relative(message);
    if (relative === kInvalidRelativeTime || Number.isNaN(relative)) return;
    timeUs += BigInt(relative);
  }
  const timeNs = timeUs * 1000n;
  // A combined topic repeats the reading of a slower sensor.
  if (decode.relative && timeNs === entry.lastNs) {
    ++entry.repeated;
    return;
  }
  entry.lastNs = timeNs;
  if (decode.scale && entry.scales.size < 2) entry.scales.add(decode.scale(message));
  const [x, y, z] = decode.axes;
  table.add(timeNs, x(message), y(message), z(message), decode.temperature ? decode.temperature(message) : NaN);
}

/** What to log, or to convert, instead of readings that come too rarely; empty where they do not. */
function tooSlow(log, entries) {
  const slow = entries.filter(({ table }) => table.rows - 1 < kSlowestHz * table.seconds);
  if (slow.length === 0) return '';
  const most = 10 * Math.max(...slow.map(({ table }) => table.rows));
  const faster = [...log.subscriptions.values()].find(({ name, rows }) => rows > most && kTopics[name]?.[0].corrected);
  return `${listOf([...new Set(slow.map(({ topic }) => topic.name))])}: fewer than ${kSlowestHz} readings a second are ` +
    `too slow for a calibration; ${kHowToLog}` +
    (faster ? `; ${faster.name} has ${faster.rows} rows, corrected by the firmware: --topic=${faster.name}` : '');
}

/** The numbers of a recording's sensors: those of their topics, or of the primary sensor. */
function deviceIds(log, entries) {
  const ids = {};
  for (const { table: { triad }, device, applied: map } of entries) {
    const isPrimary = map && map !== 'unknown';
    const id = device ?? (isPrimary ? log.parameters.get(`CAL_${kSensors[triad].name}_PRIME`) : 0);
    if (id > 0) ids[triad] = id;
  }
  return ids;
}

/** The manifest of the sensors of `instance`; `devices`: those of the log by their kinds. */
function sendManifest(log, instance, entries, devices) {
  const source = {};
  if (log.text('ver_sw')) source.firmware = log.text('ver_sw');
  if (log.text('ver_hw')) source.hardware = log.text('ver_hw');
  source.topics = [...new Set(entries.map(({ topic }) => `${topic.name}#${topic.instance}`))].join(' ');
  if (log.damage()) source.damage = log.damage();
  if (log.dropouts > 0) source.dropouts = `${log.dropouts}, ${log.dropoutMs} ms`;
  const turn = entries.map((entry) => entry.turn).find((matrix) => matrix);
  const ids = deviceIds(log, entries);
  const among = (prefix) => Object.fromEntries(Object.entries(ids).map(([triad, id]) =>
    [triad, slotsOf(log.latest, prefix(kSensors[triad]), [...devices[triad], id]).get(id)]));
  const scaled = entries.filter(({ scales }) => scales.size === 1 && [...scales][0] > 0);
  send('M', JSON.stringify({
    recording: instance, format: 'px4-ulog', serial: log.text('sys_uuid'), source,
    firmware: 'px4', ids, slots: among(({ name }) => `CAL_${name}`), thermalSlots: among(({ thermal }) => thermal),
    magnetometerTurn: turn && turn.flat(), frame: 'board-frd', siPerCount: Object.fromEntries(scaled.map(({ table, scales }) => [table.number, [...scales][0]])) }));
}

async function run(options) {
  const log = new Ulog(options.input);
  log.read((subscription, message) => {
    subscription.first ??= Buffer.from(message);
  });
  if (log.damage()) note(`${options.input}: ${log.damage()}`);
  if (options.list) {
    list(log);
    return;
  }
  if (log.dropouts > 0) note(`${options.input}: ${count(log.dropouts, 'dropout', 'dropouts')}, ${log.dropoutMs} ms in all`);
  if (log.changed.has('sys_uuid')) {
    throw new Refusal(`${options.input}: has logs of several vehicles (sys_uuid); give each vehicle's log by itself`, 'other-device');
  }
  let topics = choose(log, options.input, options.topics);
  const devices = Object.fromEntries(Object.keys(kSensors).map((triad) => [triad, devicesOf(log, topics, triad)]));
  if (options.instance !== undefined) {
    const instances = [...new Set(topics.map((topic) => topic.instance))];
    topics = topics.filter((topic) => topic.instance === options.instance);
    if (topics.length === 0) {
      throw new Refusal(`--instance=${options.instance}: there are ${instances.join(', ')}`, 'invalid-argument');
    }
  }
  topics.sort((a, b) => a.instance - b.instance);
  const opened = openStreams(log, topics, slotsOf(log.latest, 'CAL_MAG', devices.magnetometer), options.rotations);
  // The same file again; what it defines is known, and the same messages are believed.
  const again = new Ulog(options.input);
  again.read((subscription, message) => {
    for (const entry of opened.get(message.readUInt16LE(0)) ?? []) takeRow(entry, message);
  });
  const entries = [...opened.values()].flat();
  for (const instance of new Set(entries.map(({ topic }) => topic.instance))) {
    sendManifest(again, instance, entries.filter(({ topic }) => topic.instance === instance), devices);
  }
  for (const { table, topic, repeated, applied: map, device, turn } of entries) {
    const parts = [];
    const { thermal } = kSensors[table.triad];
    const terms = [0, 1, 2, 3].find((n) => device && log.latest.get(`${thermal}${n}_ID`) === device);
    if (log.latest.get(`${thermal}_ENABLE`) === 1 && kRawTopics.includes(topic.name) && terms !== undefined) {
      parts.push(`not corrected by the vehicle's temperature calibration (${thermal}_ENABLE), which exported parameters replace (${thermal}${terms}_ID)`);
    }
    if (repeated > 0) parts.push(`${count(repeated, 'repeated reading', 'repeated readings')} left out`);
    if (map && turn) parts.push('turned into the axes of the board by CAL_MAGn_ROT');
    else if (map) parts.push(map === 'unknown' ? 'corrected by the firmware, how is not known' : 'corrected by the firmware with the parameters of the log');
    if (parts.length > 0) note(`${topic.name}#${topic.instance}, ${table.triad}: ${parts.join('; ')}`);
  }
  const slow = tooSlow(again, entries);
  if (slow) note(slow);
}

module.exports = { run };
