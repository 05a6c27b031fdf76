// SPDX-License-Identifier: Apache-2.0
// What became of the units that are shown: verdicts, reasons by how often, yield over time.
'use strict';
(() => {
  const { units, text, element, badge, breakable, charts } = window.fleet;
  const kReasons = 12;

  const cell = (content, className) => element('td', { class: className ?? null }, content);
  const heading = (content, className) => element('th', { scope: 'col', class: className ?? null }, content);
  const tableOf = (headings, rows) =>
    element('table', {}, element('thead', {}, element('tr', {}, ...headings)), element('tbody', {}, ...rows));

  const row = (first, ...cells) => element('tr', {}, element('th', { scope: 'row' }, first), ...cells);
  // A table that scrolls where it is too wide; `headings`: names, those of numbers with a > before.
  const tableIn = (label, headings, rows) =>
    element('div', { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': label },
      tableOf(headings.map((name) => (name.startsWith('>') ? heading(name.slice(1), 'r') : heading(name))), rows));
  const section = (name, ...parts) => element('section', {}, element('h3', {}, name), ...parts);

  const countBy = (of, shown, isMeant) => {
    const counts = new Uint32Array(of.words.length);
    for (const i of shown) if (isMeant(i)) ++counts[of.of[i]];
    return [...counts.keys()].filter((k) => counts[k] > 0).map((k) => [of.words[k], counts[k]])
      .sort((a, b) => b[1] - a[1]);
  };

  const showVerdicts = (shown) => {
    const rows = countBy(units.verdict, shown, () => true).map(([verdict, count]) =>
      element('tr', {}, element('th', { scope: 'row' }, badge(verdict)), cell(text.count(count), 'r'), cell(text.percent(count, shown.length), 'r')));
    document.getElementById('verdicts').replaceChildren(tableOf([heading('verdict'), heading('units', 'r'), heading('share', 'r')], rows));
  };

  // The most frequent first, with the share of all that are not good up to there.
  const showReasons = (shown, filter, choose) => {
    const reasons = countBy(units.code, shown, (i) => !units.isGood(i));
    const place = document.getElementById('reasons');
    if (reasons.length === 0) {
      place.replaceChildren(element('p', {}, 'All of these units are good.'));
      return;
    }
    const all = reasons.reduce((sum, [, count]) => sum + count, 0);
    let sum = 0;
    const rows = reasons.slice(0, kReasons).map(([code, count]) => {
      sum += count;
      const bar = element('span', { class: 'bar', 'aria-hidden': 'true' });
      bar.style.setProperty('--share', `${(100 * count) / reasons[0][1]}%`);
      const button = element('button', { type: 'button', class: 'link', 'aria-pressed': String(filter.code === code), title: 'Show only these', onclick: () => choose(filter.code === code ? '' : code) }, ...breakable(code || 'no reason given'));
      return element('tr', {}, element('th', { scope: 'row' }, button), element('td', { class: 'bars' }, bar), cell(text.count(count), 'r'), cell(text.percent(sum, all), 'r'));
    });
    const parts = [tableOf([heading('reason'), element('td', { class: 'bars' }), heading('units', 'r'), heading('up to here', 'r')], rows)];
    if (reasons.length > kReasons) {
      parts.push(element('p', { class: 'soft' }, `${reasons.length - kReasons} more reasons, of ${text.count(all - sum)} units.`));
    }
    place.replaceChildren(...parts);
  };

  const kHour = 3600;
  const kDay = 24 * kHour;

  // Units by hour, day or week, whichever makes a readable number of them.
  const binned = (all) => {
    const shown = all.filter((i) => Number.isFinite(units.recorded[i]));
    let first = Infinity;
    let last = -Infinity;
    for (const i of shown) {
      first = Math.min(first, units.recorded[i]);
      last = Math.max(last, units.recorded[i]);
    }
    const span = last - first;
    const step = span <= 4 * kHour ? 300 : span <= 4 * kDay ? kHour : span <= 200 * kDay ? kDay : 7 * kDay;
    const bins = new Map();
    for (const i of shown) {
      const at = Math.floor(units.recorded[i] / step) * step;
      let bin = bins.get(at);
      if (!bin) bins.set(at, (bin = { at, count: 0, good: 0, first: 0 }));
      ++bin.count;
      if (units.isGood(i)) ++bin.good;
      if (units.isFirstGood(i)) ++bin.first;
    }
    const name = { 300: '5 minutes', [kHour]: 'an hour', [kDay]: 'a day', [7 * kDay]: 'a week' }[step];
    return { bins: [...bins.values()].sort((a, b) => a.at - b.at), name, step };
  };

  const swatch = (name, form) => element('span', { class: `swatch ${form}`, 'data-colour': name, 'aria-hidden': 'true' });

  const showYield = (shown) => {
    const { bins, name, step } = binned(shown);
    const share = (key) => bins.map((bin) => (100 * bin[key]) / bin.count);
    const good = share('good');
    const first = share('first');
    const low = Math.min(...good, ...first, 100);
    charts.draw(document.getElementById('yield-chart'), {
      x: bins.map((bin) => bin.at + step / 2),
      lines: [
        { values: bins.map((bin) => bin.count), kind: 'bars', colour: 'bars', scale: 'count' },
        { values: first, kind: 'dashed', colour: 'cross' },
        { values: good, colour: 'dot' },
      ],
      air: 0.6 * step,
      range: [Math.max(0, Math.floor(low / 10) * 10 - 10), 102],
      label: `Yield over time, ${name} a point; the table below has its numbers.`,
    });
    document.getElementById('yield-caption').replaceChildren(
      swatch('dot', 'solid'), ' good in the end, %  ', swatch('cross', 'dashed'), ' good at the first run, %  ',
      swatch('bars', 'block'), ` units (right), ${name} each`);
    const time = (bin) => (step < kDay ? text.minute(bin.at) : text.day(bin.at));
    const details = document.getElementById('yield-details');
    const fill = () => {
      if (!details.open) return;
      details.querySelector('div').replaceChildren(tableOf(
        [heading('from, UTC'), heading('units', 'r'), heading('good', 'r'), heading('at the first run', 'r')],
        bins.map((bin) => element('tr', {}, element('th', { scope: 'row' }, time(bin)), cell(text.count(bin.count), 'r'), cell(text.percent(bin.good, bin.count), 'r'), cell(text.percent(bin.first, bin.count), 'r')))));
    };
    details.ontoggle = fill;
    fill();
  };

  window.fleet.overview = {
    show: (shown, filter, choose) => {
      showVerdicts(shown);
      showReasons(shown, filter, choose);
    },
    showYield,
    row,
    tableIn,
    section,
    cell,
    swatch,
    countGood: (shown) => {
      let good = 0;
      let first = 0;
      for (const i of shown) {
        if (units.isGood(i)) ++good;
        if (units.isFirstGood(i)) ++first;
      }
      return { good, first };
    },
  };
})();
