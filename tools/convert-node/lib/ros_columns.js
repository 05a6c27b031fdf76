// SPDX-License-Identifier: Apache-2.0
'use strict';

// Which fields of a ROS message are readings, as --columns names them:
// accelerometer=/topic:fields@time. The same words as of tools/convert/ros/bag_recording.cc.

const { UsageError, printable } = require('./arguments.js');

const kUnits = {
  accelerometer: ['m/s^2', 'g', 'mg', 'counts'],
  gyroscope: ['rad/s', 'deg/s', 'counts'],
  magnetometer: ['uT', 'nT', 'mT', 'T', 'G', 'mG', 'counts'],
  temperature: ['degC', 'K'],
  time: ['s', 'ms', 'us', 'ns'],
};
const kNsPer = { s: 1e9, ms: 1e6, us: 1e3, ns: 1 };
const kLargestTime = 9.2e18;

/** { role: { topic, fields, time } } */
function parseColumns(text) {
  const roles = {};
  for (const item of text.split(',')) {
    const match = /^(accelerometer|gyroscope|magnetometer|temperature)=([^:@]+)(?::([^@]*))?(?:@(.+))?$/.exec(item);
    if (!match) {
      throw new UsageError(
        `--columns: \`${printable(item)}\` is not one of accelerometer=, gyroscope=, magnetometer=, temperature=, ` +
          'as in accelerometer=/topic:fields');
    }
    const [, role, topic, fields = '', time = ''] = match;
    if (roles[role]) throw new UsageError(`--columns: ${role} is given twice`);
    roles[role] = { topic, fields, time };
  }
  return roles;
}

/** { role: unit } for every role, and `time` if one is `needed`. */
function parseUnits(text, roles, needsTime) {
  const units = {};
  for (const unit of text.split(',').filter((word) => word)) {
    const names = Object.keys(kUnits).filter((role) => kUnits[role].includes(unit));
    if (names.length === 0) throw new UsageError(`--units: \`${printable(unit)}\` is not a known unit`);
    if (unit === 'counts') continue;
    for (const role of names) {
      if (units[role] && units[role] !== unit) {
        throw new UsageError(`--units: \`${units[role]}\` and \`${unit}\` are both units of the ${role}; give one`);
      }
      units[role] = unit;
    }
  }
  const hasCounts = text.split(',').includes('counts');
  for (const role of [...Object.keys(roles), ...(needsTime ? ['time'] : [])]) {
    if (!units[role] && hasCounts && kUnits[role].includes('counts')) units[role] = 'counts';
    if (!units[role]) {
      throw new UsageError(
        `the unit of the ${role} is missing, and the file does not contain units; state them, as in ` +
          '--units=s,m/s^2,rad/s,uT,degC', 'missing-argument');
    }
  }
  return units;
}

/** What stands at "acc.x" or "data.3" of a message; undefined where nothing does. */
function at(message, path) {
  let value = message;
  for (const part of path.split('.')) {
    if (value === undefined || value === null) return undefined;
    if (typeof value !== 'object') return undefined;
    value = value[part];
  }
  return value;
}

function numberAt(message, path) {
  const colon = path.indexOf(':');
  const value = colon < 0 ? at(message, path) : at(message, `${path.slice(0, colon)}.${Number(path.slice(colon + 1)) - 1}`);
  return typeof value === 'number' || typeof value === 'bigint' || typeof value === 'boolean' ? Number(value) : NaN;
}

function isArray(value) {
  return Array.isArray(value) || (ArrayBuffer.isView(value) && !(value instanceof DataView));
}

/** [x, y, z] of what is three numbers by itself; null: it is not. */
function three(value) {
  if (isArray(value) && value.length === 3) return [0, 1, 2].map((i) => Number(value[i]));
  if (value && typeof value === 'object' && !isArray(value)) {
    const names = Object.keys(value);
    if (names.length === 3 && ['x', 'y', 'z'].every((axis) => names.includes(axis))) {
      return [value.x, value.y, value.z].map(Number);
    }
  }
  return null;
}

/** The three numbers that `fields` names in a message; null: they are not there. */
function vectorAt(message, fields) {
  const parts = fields.split('+');
  let found = null;
  if (parts.length === 3) {
    found = parts.map((part) => numberAt(message, part));
  } else if (/^[^:]+:[1-9]\d*-[1-9]\d*$/.test(fields)) {
    const [name, range] = fields.split(':');
    const [first, last] = range.split('-').map(Number);
    if (last === first + 2) found = [0, 1, 2].map((i) => numberAt(message, `${name}:${first + i}`));
  } else if (fields) {
    found = three(at(message, fields));
  } else {
    const all = [message, ...Object.values(message)].map(three).filter((vector) => vector);
    if (all.length === 1) [found] = all;
  }
  return found && found.every((value) => !Number.isNaN(value)) ? found : null;
}

function isTime(value) {
  return Boolean(value) && typeof value === 'object' && 'sec' in value && 'nanosec' in value;
}

/** Nanoseconds as a BigInt; null: no time. */
function timeAt(message, path, nsPerUnit) {
  let value = path ? at(message, path) : at(message, 'header.stamp');
  if (!path && !isTime(value)) {
    const times = Object.values(message).filter(isTime);
    if (times.length !== 1) return 0n;
    [value] = times;
  }
  if (isTime(value)) return BigInt(value.sec) * 1_000_000_000n + BigInt(value.nanosec);
  if (typeof value === 'bigint') return value * BigInt(nsPerUnit);
  if (typeof value !== 'number' || !(Math.abs(value * nsPerUnit) < kLargestTime)) return null;
  if (Number.isInteger(value)) return BigInt(value) * BigInt(nsPerUnit);
  return BigInt(Math.round(value * nsPerUnit));
}

/** Whether `fields` names `count` numbers in messages like this one, whose arrays may be longer. */
function isNamed(message, fields, count) {
  const mayBeThere = (path) => {
    const array = /^(.+?)(?::\d+|\.\d+)$/.exec(path);
    return !Number.isNaN(numberAt(message, path)) || Boolean(array && isArray(at(message, array[1])));
  };
  if (count === 1) return mayBeThere(fields);
  const range = /^([^:+]+):([1-9]\d*)-([1-9]\d*)$/.exec(fields);
  if (range) return Number(range[3]) === Number(range[2]) + 2 && isArray(at(message, range[1]));
  const parts = fields.split('+');
  return parts.length === 3 ? parts.every(mayBeThere) : vectorAt(message, fields) !== null;
}

/** "header.stamp, acc[3], gx": what a message has, for messages. */
function fieldsOf(message, prefix = '', most = 40) {
  const names = [];
  for (const [name, value] of Object.entries(message ?? {})) {
    if (names.length >= most) break;
    if (isTime(value) || typeof value !== 'object' || value === null) names.push(prefix + name);
    else if (isArray(value)) names.push(`${prefix}${name}[${value.length}]`);
    else names.push(...fieldsOf(value, `${prefix}${name}.`, most - names.length));
  }
  return names;
}

module.exports = { at, fieldsOf, isNamed, isTime, kNsPer, numberAt, parseColumns, parseUnits, timeAt, vectorAt };
