// SPDX-License-Identifier: Apache-2.0
// The units of data.js: looking up, choosing and sorting. Words (verdicts, codes, tags) are numbers
// into sorted lists, so all of it is arithmetic on typed arrays.
'use strict';
window.fleet = {};
(() => {
  const data = window.truetriadFleet;
  const count = data.units.length;
  // Serial number, verdict, that of the first run, reason, when it was measured, and the runs.
  const all = data.units.map(([about, runs]) => [...about, runs]);

  // Words as numbers into a sorted list.
  const words = (name, each) => {
    const list = [...new Set(each)].sort();
    const place = new Map(list.map((word, k) => [word, k]));
    return { name, words: list, of: Uint32Array.from(each, (word) => place.get(word)) };
  };
  const counting = all.map(([, , , , , runs]) => runs.find((run) => run.counts) ?? runs[runs.length - 1]);
  const tagNames = new Set(counting.flatMap((run) => Object.keys(run.tags)));
  tagNames.delete('note');
  const units = {
    count,
    serials: all.map(([serial]) => serial),
    verdict: words('verdict', all.map(([, verdict]) => verdict)),
    first: words('first', all.map(([, , first]) => first)),
    code: words('code', all.map(([, , , code]) => code)),
    // When it was measured, s since 1970, UTC; NaN: not known.
    recorded: Float64Array.from(all, ([, , , , recorded]) => recorded ?? NaN),
    tags: [...tagNames].map((name) => words(name, counting.map((run) => run.tags[name] ?? ''))),
    runs: Uint32Array.from(all, ([, , , , , runs]) => runs.length),
    // The runs of a unit, the oldest first, and the one that counts.
    runsOf: (i) => all[i][5],
    counting,
    columns: data.columns,
    line: data.line,
  };
  const isGoodWord = (word) => word === 'PASS' || word === 'NO_LIMITS';
  const flags = (of) => Uint8Array.from(of.words, (word) => (isGoodWord(word) ? 1 : 0));
  const good = flags(units.verdict);
  const firstGood = flags(units.first);
  units.isGood = (i) => good[units.verdict.of[i]] === 1;
  units.isFirstGood = (i) => firstGood[units.first.of[i]] === 1;
  units.isGoodWord = isGoodWord;

  // --- what is shown

  units.all = Uint32Array.from(units.serials.keys());

  let order = units.all;
  let lowercase = null;

  // Sorted by `key(i)`, a number; equal ones by serial number.
  units.sortBy = (key, descending) => {
    const keys = new Float64Array(count);
    for (const i of units.all) keys[i] = key(i);
    const sign = descending ? -1 : 1;
    order = Uint32Array.from(units.all).sort((a, b) => sign * (keys[a] - keys[b]) || a - b);
  };

  // By word which of them hold the text.
  const matching = (of, text) =>
    Uint8Array.from(of.words, (word) => (word.toLowerCase().includes(text) ? 1 : 0));

  // A test of one unit, or null where every unit is meant.
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

  // What `filter` {text, verdict, code, tags: {name: word}} lets through, in the order of sortBy.
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

  // The numbers of a column, by unit: what was judged, or the value of a parameter.
  const columns = new Map();
  const numberOf = (run, k) => {
    if (units.columns[k].judged) return run.judged.find(([column]) => column === k)?.[4] ?? NaN;
    for (let at = 0; at < run.parameters.length; at += 3) if (run.parameters[at] === k) return run.parameters[at + 1] ?? NaN;
    return NaN;
  };
  units.column = (k) => {
    if (!columns.has(k)) columns.set(k, Float64Array.from(counting, (run) => numberOf(run, k)));
    return columns.get(k);
  };

  window.fleet.units = units;

  // --- words for people

  const pad = (number) => String(number).padStart(2, '0');
  const day = (seconds) => {
    const date = new Date(1000 * seconds);
    return `${date.getUTCFullYear()}-${pad(date.getUTCMonth() + 1)}-${pad(date.getUTCDate())}`;
  };
  window.fleet.text = {
    day,
    minute: (seconds) => {
      if (!Number.isFinite(seconds)) return '–';
      const date = new Date(1000 * seconds);
      return `${day(seconds)} ${pad(date.getUTCHours())}:${pad(date.getUTCMinutes())}`;
    },
    second: (seconds) => new Date(1000 * seconds).toISOString().replace('T', ' ').slice(0, 19),
    count: (number) => String(number).replace(/\B(?=(\d{3})+$)/g, '\u202f'),
    percent: (part, whole) => (whole > 0 ? `${((100 * part) / whole).toFixed(1)} %` : '–'),
    // "2026-11-24 06:00:00" of an ISO 8601 moment.
    moment: (iso) => iso.replace('T', ' ').replace(/Z$/, '') || '–',
    // On one line, whatever is in it.
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

  // An element with attributes and children; text stays text, whatever is in it.
  window.fleet.element = (tag, attributes = {}, ...children) => {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) {
      if (name.startsWith('on')) made.addEventListener(name.slice(2), value);
      else if (value !== null && value !== undefined) made.setAttribute(name, value);
    }
    made.append(...children);
    return made;
  };

  // `name` that may break after its dots and colons, where there is little room.
  window.fleet.breakable = (name) =>
    name.split(/(?<=[.:])/).flatMap((part, k) => (k === 0 ? [part] : [document.createElement('wbr'), part]));

  // Words in which `code` stands as such.
  window.fleet.coded = (words) =>
    window.fleet.element('span', {}, ...words.split('`').map((part, k) => (k % 2 === 1 ? window.fleet.element('code', {}, part) : part)));

  // ✓ or ✕ before it: not told by colour alone.
  window.fleet.badge = (verdict) =>
    window.fleet.element(
      'span',
      { class: `badge ${isGoodWord(verdict) ? 'is-good' : 'is-bad'}` },
      `${isGoodWord(verdict) ? '✓' : '✕'} ${verdict.replace('_', ' ')}`,
    );
})();
