// SPDX-License-Identifier: Apache-2.0
'use strict';

// The topics of a PX4 log with readings, and their use. PX4: msg/Sensor*.msg, msg/Vehicle*.msg.

const { Refusal, Table, count, listOf, note, print, printable, send } = require('./frames.js');
const { Ulog } = require('./ulog.js');

const kInvalidRelativeTime = 0x7fffffff;
// A lower rate does not resolve turns by hand.
const kSlowestHz = 5;
// Drivers before these releases (ver_sw_release) corrected readings by CAL_* before publishing them.
const kDriversCorrectBefore = { accelerometer: 0x010b0000, gyroscope: 0x010b0000, magnetometer: 0x010c0000 };
// Development versions of 1.11.0: their drivers may or may not correct.
const kEitherOf = [0x010b0000, 0x010b00ff];
const kHowToLog = 'SDLOG_MODE 2 logs while unarmed; sensor comparison in SDLOG_PROFILE logs raw readings at 10 Hz';

/** The streams of a topic. `fields`: the three readings; `relative`: µs to add to the time. */
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

/** How to read `stream` from a row of `subscription`; null if its layout lacks the fields. */
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
  // A combined topic states the times of its sensors relative to its own time.
  const isCombined = fields.has('accelerometer_timestamp_relative');
  const times = [isCombined ? null : field('timestamp_sample'), field('timestamp')].filter((time) => time?.step === 8);
  if (times.length === 0) return null;
  const decode = {
    unit: stream.unit,
    // Some drivers leave the time of the sample zero.
    timeUs: (message) => {
      const us = BigInt(times[0].read(message, 2 + times[0].at));
      return us > 0n || times.length === 1 ? us : BigInt(times[1].read(message, 2 + times[1].at));
    },
    axes: null,
    temperature: null,
    relative: stream.relative && field(stream.relative) ? reader(field(stream.relative)) : null,
    scale: null,
    turned: null,
    device: field('device_id') ? reader(field('device_id')) : null,
  };
  if (field('temperature') && !stream.fifo) decode.temperature = reader(field('temperature'));
  if (stream.array) {
    const array = field(stream.array, 3);
    if (!array) return null;
    decode.axes = [0, 1, 2].map((i) => reader(array, i));
    return decode;
  }
  // Drivers of old firmware corrected x, y, z; the counts logged beside them are the chip's output.
  const raw = stream.fields.map((name) => field(`${name}_raw`));
  const plain = stream.fields.map((name) => field(name));
  const found = raw.every((axis) => axis) ? raw : plain;
  if (!found.every((axis) => axis)) return null;
  if (stream.fifo) {
    const [dt, scale, samples] = ['dt', 'scale', 'samples'].map((name) => field(name));
    if (!dt || !scale || !samples) return null;
    // Drivers of 2020, which state the chip's rotation, do not apply it here; later ones do.
    const rotation = field('rotation') ? reader(field('rotation')) : () => 0;
    decode.fifo = { axes: found, dtUs: reader(dt), scale: reader(scale), samples: reader(samples), rotation };
    return decode;
  }
  decode.axes = found.map((axis) => reader(axis));
  if (found === raw) {
    // The log states a magnetometer's count in gauss, a recording in uT: 1 G = 100 uT.
    const scaling = field('scaling') && reader(field('scaling'));
    decode.unit = 'counts';
    decode.scale = scaling && ((message) => scaling(message) * (stream.unit === 'G' ? 100 : 1));
    if (plain.every((axis) => axis)) decode.turned = plain.map((axis) => reader(axis));
  }
  return decode;
}

/** Moments of a chip's counts, and of x, y, z, which the driver computed from the counts: rotated and corrected. */
class ChipMoments {
  constructor(decode) {
    this.readers = [...decode.axes, ...decode.turned];
    this.first = null;
    this.rows = 0;
    this.sums = Array(6).fill(0);
    this.products = Array.from({ length: 6 }, () => Array(6).fill(0));
  }

  add(message) {
    const all = this.readers.map((read) => read(message));
    if (!all.every(Number.isFinite)) return;
    this.first ??= all;
    ++this.rows;
    const from = all.map((value, i) => value - this.first[i]);
    from.forEach((value, i) => {
      this.sums[i] += value;
      from.forEach((other, j) => { this.products[i][j] += value * other; });
    });
  }

  covariance(i, j) {
    return this.products[i][j] - (this.sums[i] * this.sums[j]) / this.rows;
  }

  /** Mean squared correlation of x, y, z with the counts rotated by `rotation`; NaN if an axis is constant. */
  agreement(rotation) {
    let sum = 0;
    let axes = 0;
    rotation.forEach((row, i) => {
      const along = row.reduce((total, r, j) => total + r * this.covariance(3 + i, j), 0);
      const counts = row.reduce((total, r, j) => total + row.reduce((t, q, k) => t + r * q * this.covariance(j, k), 0), 0);
      const own = this.covariance(3 + i, 3 + i);
      if (!(own > 0) || !(counts > 0)) return;
      ++axes;
      sum += along > 0 ? (along * along) / (own * counts) : 0;
    });
    return axes === 3 ? sum / axes : NaN;
  }

  /** The rotation of `rotations` from the chip's axes to those of x, y, z; null: the rows do not determine it. */
  turn(rotations) {
    // A wrong rotation is off by 45 degrees or more: its squared correlations, 1/2, 1/2 and 1, have the mean 2/3.
    const kAgrees = 0.8;
    const agreements = rotations.map((rotation) => this.agreement(rotation));
    const best = agreements.indexOf(Math.max(...agreements));
    return agreements[best] >= kAgrees ? rotations[best] : null;
  }
}

/** Adds a row to `moments`, Map(message id -> ChipMoments), if its topic has both counts and x, y, z. */
function takeMoments(moments, subscription, message) {
  const id = message.readUInt16LE(0);
  if (!moments.has(id)) {
    const streams = kTopics[subscription.name];
    const decode = streams?.length === 1 ? decoder(subscription, streams[0]) : null;
    moments.set(id, decode?.turned ? new ChipMoments(decode) : null);
  }
  moments.get(id)?.add(message);
}

const byNameAndInstance = (a, b) => (a.name < b.name ? -1 : a.name > b.name ? 1 : a.instance - b.instance);

/** The log's topics with readings, each with the number of its recording. */
function present(log) {
  const found = [];
  for (const [id, subscription] of log.subscriptions) {
    if (subscription.rows === 0 || !subscription.layout) continue;
    const streams = kTopics[subscription.name];
    const decode = streams?.map((stream) => decoder(subscription, stream)).find((one) => one);
    if (!decode) continue;
    const { name, instance, first } = subscription;
    found.push({ id, name, instance, recording: instance, device: decode.device ? decode.device(first) : 0 });
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

/**
 * If a sensor (by device id, otherwise by instance) has two topics, keeps only its FIFO, which has every reading, in
 * the recording of the other topic. A log may have FIFOs of only some sensors; they are numbered on their own.
 */
function withEachReading(raw) {
  const isSame = (fifo, { name, device, instance }) => fifo.name === `${name}_fifo` &&
    (fifo.device && device ? fifo.device === device : fifo.instance === instance);
  const kept = raw.filter((topic) => !raw.some((fifo) => isSame(fifo, topic)));
  const fifos = kept.filter(({ name }) => name.endsWith('_fifo'));
  for (const fifo of fifos) fifo.recording = raw.find((topic) => isSame(fifo, topic))?.recording;
  for (const fifo of fifos.filter(({ recording }) => recording === undefined)) {
    const others = kept.filter(({ name }) => kTopics[name][0].triad === kTopics[fifo.name][0].triad);
    fifo.recording = fifo.instance;
    while (others.some((other) => other !== fifo && other.recording === fifo.recording)) ++fifo.recording;
  }
  return kept;
}

/** The topics to convert. */
function choose(log, file, topics, rotations) {
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
  const raw = found.filter((topic) => kRawTopics.includes(topic.name));
  if (raw.length > 0) return withEachReading(raw);
  const corrected = names.filter((name) => !kRawTopics.includes(name));
  const usable = corrected.find((name) => isUndone(log, name, rotations));
  throw new Refusal(
    corrected.length > 0
      ? `${file}: contains only readings corrected by the firmware (${listOf(corrected)}); log ` +
        `sensor_accel, sensor_gyro and sensor_mag (${kHowToLog})${usable ? `, or convert these with --topic=${usable}` : ''}`
      : `${file}: contains no readings of an accelerometer, gyroscope or magnetometer; topics: ${listOf(
        [...new Set([...log.subscriptions.values()].filter((s) => s.rows > 0).map((s) => s.name))])}`, 'wrong-format');
}

function product(a, b) {
  return a.map((row) => [0, 1, 2].map((j) => row[0] * b[0][j] + row[1] * b[1][j] + row[2] * b[2][j]));
}

/** The rotation by roll, then pitch, then yaw, from the parameters `names` in degrees. */
function eulerRotation(parameters, names) {
  const [roll, pitch, yaw] = names.map((name) => ((parameters.get(name) ?? 0) * Math.PI) / 180);
  const about = (angle, i, j) => {
    const matrix = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
    matrix[i][i] = matrix[j][j] = Math.cos(angle);
    matrix[i][j] = -Math.sin(angle);
    matrix[j][i] = Math.sin(angle);
    return matrix;
  };
  return product(about(yaw, 0, 1), product(about(pitch, 2, 0), about(roll, 1, 2)));
}

/** The rotation of the board, body <- sensor; null: it is not among `rotations`. */
function boardRotation(parameters, rotations) {
  const rotation = rotations[parameters.get('SENS_BOARD_ROT') ?? 0];
  return rotation ? product(eulerRotation(parameters, ['X', 'Y', 'Z'].map((axis) => `SENS_BOARD_${axis}_OFF`)), rotation) : null;
}

const kSensors = {
  accelerometer: { name: 'ACC', thermal: 'TC_A' },
  gyroscope: { name: 'GYRO', thermal: 'TC_G' },
  magnetometer: { name: 'MAG', thermal: 'TC_M' },
};

/**
 * The parameter set of each of `devices`: the set with its ID, otherwise the first set without an ID, otherwise
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

/** The devices of a kind of sensor in `topics`, by instance. */
function devicesOf(topics, triad) {
  return topics.filter(({ name }) => kTopics[name].length === 1 && kTopics[name][0].triad === triad)
    .map(({ device }) => device).filter((device) => device > 0);
}

/** The value of CAL_MAGn_ROT for a rotation stated by angles. PX4: src/lib/conversion/rotation.h (ROTATION_CUSTOM). */
const kCustomRotation = 100;

/**
 * The rotation from the board's axes to those of the magnetometer `device`, whose parameter set is `slot`;
 * undefined: the log does not determine it.
 */
function magnetometerTurn({ parameters, latest, changed }, device, slot, rotations) {
  const id = latest.get(`CAL_MAG${slot}_ID`);
  const number = latest.get(`CAL_MAG${slot}_ROT`);
  const isOther = id !== undefined && id !== device;
  const angles = ['ROLL', 'PITCH', 'YAW'].map((angle) => `CAL_MAG${slot}_${angle}`);
  const turns = [`CAL_MAG${slot}_ROT`, ...(number === kCustomRotation ? angles : [])];
  if (isOther || [...changed].some((key) => turns.includes(key) || key.startsWith('SENS_BOARD'))) return undefined;
  if (number === -1) return rotations[0]; // The sensor is on the board.
  const board = boardRotation(parameters, rotations);
  const sensor = number === kCustomRotation ? eulerRotation(latest, angles) : rotations[number];
  // Both rotations lead into the vehicle's axes.
  return sensor && board ? product([0, 1, 2].map((i) => sensor.map((row) => row[i])), board) : undefined;
}

/**
 * The firmware's correction of the primary sensor of `triad`, as after `applied.<triad>:`; 'unknown' if the
 * log's parameters do not determine it. corrected = matrix · ((reading − offset) ∘ scale).
 */
function applied(log, triad, rotations) {
  const { parameters, changed } = log;
  const { name, thermal } = kSensors[triad];
  if (parameters.get(`${thermal}_ENABLE`)) return 'unknown';
  const primary = parameters.get(`CAL_${name}_PRIME`);
  const slot = [0, 1, 2, 3].find((n) => primary && parameters.get(`CAL_${name}${n}_ID`) === primary);
  if (slot === undefined) return 'unknown';
  const prefix = `CAL_${name}${slot}_`;
  // A magnetometer's corrections by a rotation, by currents or by a matrix are not undone here.
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

/** Whether the firmware's correction of the readings of `topic` is known. */
function isUndone(log, topic, rotations) {
  return kTopics[topic].every(({ corrected, triad }) => corrected === true && applied(log, triad, rotations) !== 'unknown');
}

/**
 * The correction of `device` by an old driver: (reading − offset) ∘ scale; 'unknown' if the log does not
 * determine it, undefined: none. PX4: src/lib/drivers/magnetometer/PX4Magnetometer.cpp.
 */
function appliedByDriver({ parameters, changed, info }, triad, device) {
  const release = info.get('ver_sw_release');
  const isEither = release >= kEitherOf[0] && release < kEitherOf[1];
  if (!(release < kDriversCorrectBefore[triad]) && !isEither) return undefined;
  const own = [0, 1, 2, 3].map((n) => `CAL_${kSensors[triad].name}${n}_`)
    .filter((prefix) => !device || parameters.get(`${prefix}ID`) === device || changed.has(`${prefix}ID`));
  const values = (prefix, what, neutral) => ['X', 'Y', 'Z'].map((axis) =>
    Number((parameters.get(prefix + axis + what) ?? neutral).toPrecision(9)));
  const said = own.map((prefix) => ({ offset: values(prefix, 'OFF', 0), scale: values(prefix, 'SCALE', 1) }));
  const hasChanged = [...changed].some((key) => own.some((prefix) => key.startsWith(prefix)));
  if (!hasChanged && said.every(({ offset, scale }) => offset.every((o) => o === 0) && scale.every((q) => q === 1))) return undefined;
  const isTold = device && said.length === 1 && !hasChanged && !isEither && said[0].scale.every((q) => q > 0);
  return isTold ? said[0] : 'unknown';
}

/** The correction, in the board's axes, of readings that were rotated by `turn` (if set), then corrected by `map`. */
function afterTurn(turn, map) {
  if (!turn || !turn.some((row, i) => row[i] !== 1)) return map;
  if (map === undefined) return { matrix: turn };
  if (map === 'unknown') return map;
  return { offset: [0, 1, 2].map((j) => turn.reduce((sum, row, i) => sum + row[j] * map.offset[i], 0)),
    matrix: turn.map((row, i) => row.map((entry) => map.scale[i] * entry)) };
}

/** The text after `applied.<triad>:` in a manifest. */
function appliedText(map) {
  if (map === undefined) return '';
  if (map === 'unknown') return ' unknown\n';
  return `\n${Object.entries(map).map(([key, value]) => `    ${key}: ${JSON.stringify(value)}\n`).join('')}`;
}

/** The streams to write: one for each sensor of each chosen topic. `slots`: the magnetometers' parameter sets. */
function openStreams(log, topics, slots, moments, rotations) {
  const opened = new Map(); // message id -> streams
  for (const topic of topics) {
    const subscription = log.subscriptions.get(topic.id);
    for (const stream of kTopics[topic.name]) {
      const decode = decoder(subscription, stream);
      if (!decode) continue;
      const suffix = topic.recording > 0 ? `-${topic.recording}` : '';
      const { device } = topic;
      const turn = topic.name !== 'sensor_mag' ? undefined
        : magnetometerTurn(log, device, slots.get(device) ?? topic.recording, rotations);
      const isPlain = !stream.corrected && !stream.fifo && decode.unit !== 'counts';
      const driver = isPlain ? appliedByDriver(log, stream.triad, device) : undefined;
      const chip = moments.get(topic.id);
      const map = !stream.corrected ? afterTurn(turn, driver)
        : stream.corrected === 'filtered' ? 'unknown' : applied(log, stream.triad, rotations);
      const table = new Table(
        { recording: topic.recording, file: `${stream.triad}${suffix}.csv`, triad: stream.triad, unit: decode.unit,
          temperature: decode.temperature !== null, applied: appliedText(map) }, true);
      const entry = { file: log.file, topic, decode, table, device: undefined, deviceBefore: 0, scales: new Set(),
        lastNs: null, repeated: 0, rotations, applied: map, turn, driver, chip: chip && { turn: chip.turn(rotations) } };
      opened.set(topic.id, [...(opened.get(topic.id) ?? []), entry]);
    }
  }
  return opened;
}

/** Takes `device` as the id of `entry` if two successive rows state it, since damage hardly gives an id twice. */
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

/** The product R v. */
function turned(rotation, v) {
  return rotation.map((row) => row[0] * v[0] + row[1] * v[1] + row[2] * v[2]);
}

function takeRow(entry, message) {
  const { decode, table } = entry;
  takeDevice(entry, decode.device ? decode.device(message) : 0);
  let timeUs = decode.timeUs(message);
  if (decode.fifo) {
    const { axes, dtUs, scale, samples, rotation } = decode.fifo;
    const turn = entry.rotations[rotation(message)];
    const number = Math.min(samples(message), axes[0].length);
    const spacingNs = Math.round(dtUs(message) * 1000);
    const factor = scale(message);
    if (!(spacingNs > 0) || !(factor > 0) || !turn) return;
    for (let i = 0; i < number; ++i) {
      const timeNs = timeUs * 1000n - BigInt((number - 1 - i) * spacingNs);
      const counted = axes.map((axis) => {
        const at = 2 + axis.at + i * axis.step;
        return at + axis.step <= message.length ? factor * axis.read(message, at) : NaN;
      });
      table.add(timeNs, ...turned(turn, counted));
    }
    return;
  }
  if (decode.relative) {
    const relative = decode.relative(message);
    if (relative === kInvalidRelativeTime || Number.isNaN(relative)) return;
    timeUs += BigInt(relative);
  }
  const timeNs = timeUs * 1000n;
  // A combined topic repeats the last reading of a slower sensor.
  if (decode.relative && timeNs === entry.lastNs) {
    ++entry.repeated;
    return;
  }
  entry.lastNs = timeNs;
  if (decode.scale && entry.scales.size < 2) entry.scales.add(decode.scale(message));
  const counted = decode.axes.map((axis) => axis(message));
  const [x, y, z] = entry.chip?.turn ? turned(entry.chip.turn, counted) : counted;
  table.add(timeNs, x, y, z, decode.temperature ? decode.temperature(message) : NaN);
}

/** If the rate of readings is too low: advice on what to log or convert instead; otherwise empty. */
function tooSlow(log, entries, rotations) {
  const slow = entries.filter(({ table }) => 2 * table.longSteps > table.rows - 1);
  if (slow.length === 0) return '';
  const most = 10 * Math.max(...slow.map(({ table }) => table.rows));
  const faster = [...log.subscriptions.values()].find(({ name, rows }) =>
    rows > most && kTopics[name]?.[0].corrected && isUndone(log, name, rotations));
  return `${listOf([...new Set(slow.map(({ topic }) => topic.name))])}: fewer than ${kSlowestHz} readings a second are ` +
    `too slow for a calibration; ${kHowToLog}` +
    (faster ? `; ${faster.name} has ${faster.rows} rows, corrected by the firmware: --topic=${faster.name}` : '');
}

/** The device ids of a recording's sensors: from their topics, or, if firmware corrected them, of the primary sensor. */
function deviceIds(log, entries) {
  const ids = {};
  for (const { table: { triad }, device, applied: map } of entries) {
    const isPrimary = map && map !== 'unknown';
    const id = device ?? (isPrimary ? log.parameters.get(`CAL_${kSensors[triad].name}_PRIME`) : 0);
    if (id > 0) ids[triad] = id;
  }
  return ids;
}

/** Sends the manifest of the sensors of `instance`. `devices`: the log's device ids by kind of sensor. */
function sendManifest(log, instance, entries, devices) {
  const source = {};
  if (log.text('ver_sw')) source.firmware = log.text('ver_sw');
  if (log.text('ver_hw')) source.hardware = log.text('ver_hw');
  source.topics = [...new Set(entries.map(({ topic }) => `${topic.name}#${topic.instance}`))].join(' ');
  if (log.damage()) source.damage = log.damage();
  if (log.dropouts > 0) source.dropouts = `${log.dropouts}, ${log.dropoutMs} ms`;
  const turn = entries.map((entry) => entry.turn).find((matrix) => matrix);
  const ids = deviceIds(log, entries);
  // A log without parameters does not tell which parameter set belongs to which sensor.
  const stated = log.latest.size > 0 ? Object.entries(ids) : [];
  const among = (prefix) => Object.fromEntries(stated.map(([triad, id]) =>
    [triad, slotsOf(log.latest, prefix(kSensors[triad]), [...devices[triad], id]).get(id)]));
  const thermalSlots = among(({ thermal }) => thermal);
  const slots = among(({ name }) => `CAL_${name}`);
  // A sensor without an id must not use a set that the vehicle assigns to another sensor.
  for (const { table: { triad } } of entries) {
    if (!ids[triad] && log.latest.get(`CAL_${kSensors[triad].name}${instance}_ID`)) slots[triad] = -1;
  }
  // If the temperature terms of a kind of sensor are enabled, these sets become active: that of
  // this sensor, and those of sensors that are not in the log. (The other sensors in the log state
  // their own sets.)
  const idle = Object.fromEntries(stated.map(([triad]) => [triad, [0, 1, 2, 3].filter((n) => {
    const { thermal } = kSensors[triad];
    const id = log.latest.get(`${thermal}${n}_ID`);
    return log.latest.get(`${thermal}_ENABLE`) !== 1 && id && (n === thermalSlots[triad] || !devices[triad].includes(id));
  })]));
  const scaled = entries.filter(({ scales }) => scales.size === 1 && [...scales][0] > 0);
  send('M', {
    recording: instance, format: 'px4-ulog', serial: log.text('sys_uuid'), source,
    firmware: 'px4', ids, slots, thermalSlots, idleThermalSlots: idle,
    magnetometerTurn: turn && turn.flat(), frame: 'board-frd', siPerCount: Object.fromEntries(scaled.map(({ table, scales }) => [table.number, [...scales][0]])) });
}

async function run(options) {
  const log = new Ulog(options.input);
  const moments = new Map();
  log.read((subscription, message) => {
    subscription.first ??= Buffer.from(message);
    takeMoments(moments, subscription, message);
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
  let topics = choose(log, options.input, options.topics, options.rotations).sort((a, b) => a.recording - b.recording);
  const devices = Object.fromEntries(Object.keys(kSensors).map((triad) => [triad, devicesOf(topics, triad)]));
  if (options.instance !== undefined) {
    const instances = [...new Set(topics.map((topic) => topic.recording))];
    topics = topics.filter((topic) => topic.recording === options.instance);
    if (topics.length === 0) {
      throw new Refusal(`--instance=${options.instance}: no such instance; there are ${instances.join(', ')}`, 'invalid-argument');
    }
  }
  const opened = openStreams(log, topics, slotsOf(log.latest, 'CAL_MAG', devices.magnetometer), moments, options.rotations);
  // The second pass accepts the same messages, since its definitions are the same.
  const again = new Ulog(options.input);
  again.read((subscription, message) => {
    for (const entry of opened.get(message.readUInt16LE(0)) ?? []) takeRow(entry, message);
  });
  const entries = [...opened.values()].flat();
  for (const instance of new Set(entries.map(({ topic }) => topic.recording))) {
    sendManifest(again, instance, entries.filter(({ topic }) => topic.recording === instance), devices);
  }
  for (const { table, topic, repeated, applied: map, device, turn, driver, chip } of entries) {
    const parts = [];
    const { thermal } = kSensors[table.triad];
    const terms = [0, 1, 2, 3].find((n) => device && log.latest.get(`${thermal}${n}_ID`) === device);
    if (log.latest.get(`${thermal}_ENABLE`) === 1 && kRawTopics.includes(topic.name) && terms !== undefined) {
      parts.push(`not corrected by the vehicle's temperature calibration (${thermal}_ENABLE); exported parameters replace this calibration (${thermal}${terms}_ID)`);
    }
    if (repeated > 0) parts.push(`${count(repeated, 'repeated reading', 'repeated readings')} left out`);
    if (chip && !chip.turn) parts.push('counts of the chip; x, y and z do not determine its rotation');
    else if (chip?.turn.some((row, i) => row[i] !== 1)) parts.push('counts of the chip, rotated into the axes of x, y and z');
    if (driver) {
      const how = `with CAL_${kSensors[table.triad].name}n_*, as drivers of PX4 before 1.12 do`;
      parts.push(driver !== 'unknown' ? `corrected by its driver ${how}`
        : `may be corrected by its driver ${how}; log with PX4 1.12 or later, or with offsets of 0 and scales of 1`);
    } else if (map && turn) parts.push('turned into the axes of the board by CAL_MAGn_ROT');
    else if (map) parts.push(map === 'unknown' ? 'corrected by the firmware in a way that is not known' : 'corrected by the firmware with the parameters of the log');
    if (parts.length > 0) note(`${topic.name}#${topic.instance}, ${table.triad}: ${parts.join('; ')}`);
  }
  if (log.latest.size === 0) {
    note(`${options.input}: has no parameters, so the vehicle's parameter sets for these sensors and the sensors' rotations are not known`);
  }
  const slow = tooSlow(again, entries, options.rotations);
  if (slow) note(slow);
}

module.exports = { run };
