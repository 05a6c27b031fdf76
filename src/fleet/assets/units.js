// SPDX-License-Identifier: Apache-2.0
// Looks up, selects and sorts the units of data.js. Columns are numbers in digits of base 64. Words
// (verdicts, codes, tags) are indices into sorted lists, so all work is arithmetic on typed arrays.
// Data for the dialog of a unit or for a chart are decoded when they are needed.
'use strict';
window.fleet = {};
(() => {
  const data = window.truetriadFleet;
  const count = data.serials.length;
  const kDigits = 'ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/';
  const digits = new Uint8Array(128);
  for (let k = 0; k < 64; ++k) digits[kDigits.charCodeAt(k)] = k;
  // The number at index `i` in `packed`, which has `items` numbers of equally many digits.
  const numberAt = (packed, items, i) => {
    const width = packed.length / items;
    let number = 0;
    for (let at = i * width; at < (i + 1) * width; ++at) number = 64 * number + digits[packed.charCodeAt(at)];
    return number;
  };
  const ofUnits = (packed) => new Uint32Array(count).map((unused, i) => numberAt(packed, count, i));

  // Runs are grouped by unit, and within a unit in the order of measurement.
  const runs = ofUnits(data.runs);
  const begins = new Uint32Array(count + 1);
  runs.forEach((number, i) => (begins[i + 1] = begins[i] + number));
  const first = begins.subarray(0, count);
  const counting = ofUnits(data.counting).map((place, i) => begins[i] + place);
  const numberOf = (packed, run) => numberAt(packed, begins[count], run);
  const wordOf = (column, run) => column.words[numberOf(column.of, run)];
  const wordsOf = (column, which) => ({ name: column.name, words: column.words, of: which.map((run) => numberOf(column.of, run)) });
  // The time of a run in s since 1970, UTC; NaN: unknown.
  const momentOf = ({ from, of }, run) => {
    const after = numberOf(of, run);
    return after === 0 ? NaN : from + after - 1;
  };
  // Decodes a value from the first 30 bits of a float; NaN: the run has no value.
  const bits = new Uint32Array(1);
  const float = new Float32Array(bits.buffer);
  const valueOf = (column, run) => {
    bits[0] = 4 * numberOf(column.values, run);
    return float[0];
  };
  // The limits and result of a run: [lower, target, upper, whether it is inside]; null: not judged.
  const judgementOf = ({ limits }, run) => (limits && wordOf(limits, run) ? JSON.parse(wordOf(limits, run)) : null);

  const of = data.of_runs;
  const units = {
    count,
    serials: data.serials,
    verdict: { words: data.verdict.words, of: ofUnits(data.verdict.of) },
    first: wordsOf(of.verdict, first),
    code: { words: data.code.words, of: ofUnits(data.code.of) },
    recorded: Float64Array.from(counting, (run) => momentOf(of.recorded, run)),
    tags: data.tags.filter(({ name }) => name !== 'note').map((tag) => wordsOf(tag, counting)),
    runs,
    columns: data.columns,
    line: data.line,
    // The runs of a unit, the oldest first. `numbers`, `judgements`: an item for each column.
    runsOf: (i) => Array.from({ length: runs[i] }, (unused, k) => {
      const run = begins[i] + k;
      const word = (name) => wordOf(of[name], run);
      return {
        counts: run === counting[i],
        recorded: momentOf(of.recorded, run),
        created: momentOf(of.created, run),
        verdict: word('verdict'),
        code: word('code'),
        message: word('message'),
        by: word('by'),
        report: of.report[run] && `${word('folder')}/${of.report[run]}/report.html`,
        tags: data.tags.map((tag) => [tag.name, wordOf(tag, run)]).filter(([, value]) => value),
        dispositions: of.decided[run] ?? [],
        numbers: data.columns.map((column) => {
          const value = valueOf(column, run);
          return Number.isNaN(value) ? null : [value, Number(wordOf(column.sigmas, run))];
        }),
        judgements: data.columns.map((column) => judgementOf(column, run)),
      };
    }),
    // The values of a column by unit.
    valuesOf: (column) => Float64Array.from(counting, (run) => valueOf(column, run)),
    // [lower, target, upper] of a column; null: they differ among the units.
    limitsOf: (column) => {
      if (!column.limits) return [null, null, null];
      const words = new Set([...counting].map((run) => wordOf(column.limits, run)).filter(Boolean));
      const stated = new Set([...words].map((word) => JSON.stringify(JSON.parse(word).slice(0, 3))));
      return stated.size > 1 ? null : JSON.parse([...stated][0] ?? '[null,null,null]');
    },
  };
  const isGoodWord = (word) => word === 'PASS' || word === 'NO_LIMITS';
  const flags = (of) => Uint8Array.from(of.words, (word) => (isGoodWord(word) ? 1 : 0));
  const good = flags(units.verdict);
  const firstGood = flags(units.first);
  units.isGood = (i) => good[units.verdict.of[i]] === 1;
  units.isFirstGood = (i) => firstGood[units.first.of[i]] === 1;
  units.isGoodWord = isGoodWord;

  // --- selection of shown units

  units.all = Uint32Array.from(units.serials.keys());

  let order = units.all;
  let lowercase = null;

  // Sorts by the number `key(i)`; equal keys by serial number.
  units.sortBy = (key, descending) => {
    const keys = new Float64Array(count);
    for (const i of units.all) keys[i] = key(i);
    const sign = descending ? -1 : 1;
    order = Uint32Array.from(units.all).sort((a, b) => sign * (keys[a] - keys[b]) || a - b);
  };

  // For each word of the list: 1 if it contains the text, otherwise 0.
  const matching = (of, text) =>
    Uint8Array.from(of.words, (word) => (word.toLowerCase().includes(text) ? 1 : 0));

  // A predicate for one unit, or null if all units match.
  const textTest = (text) => {
    const terms = text.toLowerCase().split(/\s+/).filter(Boolean);
    if (terms.length === 0) return null;
    lowercase ??= units.serials.map((serial) => serial.toLowerCase());
    const fields = [units.verdict, units.code, ...units.tags];
    const tests = terms.map((term) => {
      const found = fields.map((of) => matching(of, term));
      const worded = fields.filter((of, k) => found[k].includes(1));
      const hits = found.filter((list) => list.includes(1));
      return (i) => lowercase[i].includes(term) || worded.some((of, k) => hits[k][of.of[i]] === 1);
    });
    return (i) => tests.every((test) => test(i));
  };

  const wordTest = (of, word) => {
    const at = of.words.indexOf(word);
    return (i) => of.of[i] === at;
  };

  // The units that match `filter` {text, verdict, code, tags: {name: word}}, in the order of
  // sortBy.
  units.choose = (filter) => {
    const tests = [];
    if (filter.verdict === 'good') tests.push(units.isGood);
    else if (filter.verdict === 'not-good') tests.push((i) => !units.isGood(i));
    else if (filter.verdict) tests.push(wordTest(units.verdict, filter.verdict));
    if (filter.code) tests.push(wordTest(units.code, filter.code));
    for (const tag of units.tags) {
      if (filter.tags[tag.name]) tests.push(wordTest(tag, filter.tags[tag.name]));
    }
    const text = textTest(filter.text);
    if (text) tests.push(text);
    return tests.length === 0 ? order : order.filter((i) => tests.every((test) => test(i)));
  };

  window.fleet.units = units;

  // --- formatting

  // A time as "2026-11-24 06:00:00", or its first `length` characters.
  const timeOf = (length) => (seconds) =>
    Number.isFinite(seconds) ? new Date(1000 * seconds).toISOString().replace('T', ' ').slice(0, length) : '–';
  window.fleet.text = {
    day: timeOf(10),
    minute: timeOf(16),
    second: timeOf(19),
    count: (number) => String(number).replace(/\B(?=(\d{3})+$)/g, '\u202f'),
    percent: (part, whole) => (whole > 0 ? `${((100 * part) / whole).toFixed(1)} %` : '–'),
    // A time in ISO 8601 as "2026-11-24 06:00:00".
    moment: (iso) => iso.replace('T', ' ').replace(/Z$/, '') || '–',
    // Any text on one line.
    flat: (words) => words.replace(/[\u0000-\u001f\u007f\u2028\u2029]/g, '⏎'),
    number: (value, digits = 5) =>
      value === null || !Number.isFinite(value)
        ? '–'
        : String(Number(value.toPrecision(digits))).replace(/^-/, '\u2212'),
    allowed: (lower, upper) => {
      const { number } = window.fleet.text;
      if (lower === null) return upper === null ? 'anything' : `at most ${number(upper)}`;
      if (upper === null) return `at least ${number(lower)}`;
      return `${number(lower)} to ${number(upper)}`;
    },
  };

  // Creates an element with attributes and children; text is never parsed as HTML.
  window.fleet.element = (tag, attributes = {}, ...children) => {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) {
      if (name.startsWith('on')) made.addEventListener(name.slice(2), value);
      else if (value !== null && value !== undefined) made.setAttribute(name, value);
    }
    made.append(...children);
    return made;
  };

  // `name` with possible line breaks after its dots and colons.
  window.fleet.breakable = (name) =>
    name.split(/(?<=[.:])/).flatMap((part, k) => (k === 0 ? [part] : [document.createElement('wbr'), part]));

  // Words in which `code` is shown as code.
  window.fleet.coded = (words) =>
    window.fleet.element('span', {}, ...words.split('`').map((part, k) => (k % 2 === 1 ? window.fleet.element('code', {}, part) : part)));

  // A verdict as a badge. ✓ or ✕ precedes it, so that it can be read without colours.
  window.fleet.badge = (verdict) =>
    window.fleet.element(
      'span',
      { class: `badge ${isGoodWord(verdict) ? 'is-good' : 'is-bad'}` },
      `${isGoodWord(verdict) ? '✓' : '✕'} ${verdict.replace('_', ' ')}`,
    );
})();
