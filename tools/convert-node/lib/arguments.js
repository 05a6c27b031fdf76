// SPDX-License-Identifier: Apache-2.0
'use strict';

const fs = require('fs');
const path = require('path');

/** The call is wrong; exit code 1. `reason` is its code in docs/reasons.md. */
class UsageError extends Error {
  constructor(message, reason = 'invalid-argument') {
    super(message);
    this.reason = reason;
  }
}

/** A file cannot be read or holds nothing that can be used; exit code 2. */
class BadInput extends Error {
  constructor(message, reason = 'wrong-format') {
    super(message);
    this.reason = reason;
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

function usage(converter) {
  const others = (converter.others ?? []).map((flag) => ` [--${flag}=…]`).join('');
  const topic = converter.takesTopics ? ' [--topic=NAME,…]' : '';
  const instance = converter.takesInstance ? ' [--instance=N]' : '';
  const program = `truetriad-convert-${converter.format}`;
  const input = converter.takesSeveral ? 'INPUT…' : 'INPUT';
  return `Usage:\n${program} ${input} --output=DIR${topic}${instance}${others}\n${program} ${input} --list\n`;
}

function parse(converter, words) {
  const found = { input: '', inputs: [], output: '', topics: [], instance: null, list: false, others: {} };
  for (let i = 0; i < words.length; ++i) {
    const word = words[i];
    if (word === '--list') {
      found.list = true;
      continue;
    }
    if (word === '--json') continue; // Has been read.
    if (!word.startsWith('-')) {
      if (found.input && !converter.takesSeveral) {
        throw new UsageError(`\`${word}\`: give one log at a time`, 'extra-argument');
      }
      const isList = converter.takesSeveral && !fs.existsSync(word);
      found.inputs.push(...(isList ? word.split(',').filter((name) => name) : [word]));
      [found.input] = found.inputs;
      continue;
    }
    const equals = word.indexOf('=');
    const name = word.replace(/^--?/, '').replace(/=.*/s, '');
    let value = equals < 0 ? '' : word.slice(equals + 1);
    if (equals < 0 && i + 1 < words.length && !words[i + 1].startsWith('-')) value = words[++i];
    if (!value) throw new UsageError(`--${name} needs a value: --${name}=…`, 'missing-argument');
    if (name === 'output') {
      found.output = value;
    } else if (name === 'topic' && converter.takesTopics) {
      found.topics = value.split(',').filter((topic) => topic);
    } else if (name === 'instance' && converter.takesInstance) {
      if (!/^\d{1,3}$/.test(value)) {
        throw new UsageError(`--instance=${value}: expected a whole number, 0 or more`);
      }
      found.instance = Number(value);
    } else if ((converter.others ?? []).includes(name)) {
      found.others[name] = value;
    } else if (name === 'topic' || name === 'instance') {
      throw new UsageError(`--${name} does not apply to this format`, 'conflicting-arguments');
    } else {
      throw new UsageError(`--${name} is not a flag`, 'unknown-flag');
    }
  }
  if (!found.input) throw new UsageError('no log given; name the file to convert', 'missing-argument');
  if (!found.output && !found.list) {
    throw new UsageError('no --output given; name the folder for the recording (--output=DIR), or use --list', 'missing-argument');
  }
  return found;
}

/** The inputs, where a folder stands for the files in it that end with `ending`, by the numbers in their names. */
function inputFiles(options, ending) {
  return options.inputs.flatMap((input) => {
    if (!fs.existsSync(input) || !fs.statSync(input).isDirectory()) return [input];
    const names = fs.readdirSync(input).filter((name) => name.endsWith(ending));
    if (names.length === 0) {
      throw new BadInput(`${input}: is a folder without any file that ends with ${ending}`, 'unreadable-file');
    }
    // log_10 comes after log_9.
    names.sort((a, b) => a.length - b.length || (a < b ? -1 : 1));
    return names.map((name) => path.join(input, name));
  });
}

/**
 * The `main` of a converter { format, input, details, takesSeveral, takesTopics, takesInstance, others, run }.
 * Exit code: 0 good, 1 usage, 2 bad input.
 */
async function runConverter(converter) {
  const program = `truetriad-convert-${converter.format}`;
  const note = (message) => process.stderr.write(`${program}: ${message}\n`);
  const words = process.argv.slice(2);
  process.stdout.on('error', () => process.exit(2));
  if (words.includes('--help') || words.includes('-h')) {
    process.stdout.write(
      `${usage(converter)}\nConverts ${converter.input} to DIR/recording.yaml and its CSV files, the input of ` +
        `every truetriad verb.\n--list shows what the log contains and writes nothing. --json: an error is an object on ` +
        `stdout, too.\n` +
        `${converter.details}\nExit codes: 0 good, 1 usage, 2 bad input.\n`);
    return;
  }
  try {
    await converter.run(parse(converter, words), note);
  } catch (error) {
    const fail = (message, code, exitCode) => {
      note(message);
      process.exitCode = exitCode;
      if (words.includes('--json')) process.stdout.write(JSON.stringify({ error: { code, message } }) + '\n');
    };
    if (error instanceof UsageError) {
      fail(error.message, error.reason, 1);
      process.stderr.write(usage(converter));
    } else if (error instanceof BadInput) {
      fail(error.message, error.reason, 2);
    } else if (typeof error.code === 'string' && error.syscall) {
      // What the system says of a file: not there, not readable, disk full.
      const reads = ['open', 'read', 'stat', 'fstat', 'scandir'].includes(error.syscall);
      fail(`${error.path ?? 'a file'}: ${error.code}: ${error.message}`, reads ? 'unreadable-file' : 'cannot-write', 2);
    } else {
      fail(`the log cannot be converted: ${printable(error.message)}`, 'damaged-file', 2);
    }
  }
}

module.exports = { BadInput, UsageError, count, inputFiles, listOf, printable, runConverter };
