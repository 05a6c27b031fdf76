// SPDX-License-Identifier: Apache-2.0
// What the line's statistics say: how values lie within their limits, control charts of each station
// with their alarms, golden units.
'use strict';
(() => {
  const { units, text, element, charts, overview } = window.fleet;
  const { row, tableIn, section, cell } = overview;
  const line = units.line;
  const kAlarms = 50; // Shown, the last ones.

  const kinds = {
    ewma: 'EWMA of units',
    t2: 'all parameters together (Hotelling T²)',
  };
  const nameOf = (kind, parameter) => (parameter ? `${parameter}, ${kinds[kind] ?? kind}` : kinds[kind] ?? kind);
  const unitLink = (serial) => element('a', { href: `#unit=${encodeURIComponent(serial)}` }, text.flat(serial));
  const known = (value) => value !== null && value !== undefined && Number.isFinite(value);
  const interval = (estimate, digits = 3) =>
    !estimate || !known(estimate.value) ? '–' : `${text.number(estimate.value, digits)} (${text.number(estimate.lower, digits)} … ${text.number(estimate.upper, digits)})`;
  const share = (value) => (known(value) ? `${text.number(100 * value, 2)} %` : '–');

  const yieldOf = () => {
    const { good_share: good, good_at_first_share: first } = line.yield;
    const percent = (estimate) => (known(estimate?.value) ? `${(100 * estimate.value).toFixed(1)} % (${(100 * estimate.lower).toFixed(1)} … ${(100 * estimate.upper).toFixed(1)})` : '–');
    return element('p', {}, `Of ${text.count(line.yield.units)} units ${percent(good)} are good, ${percent(first)} were at the first run; in brackets, here and below, 95 % intervals.`);
  };

  // By lot and by station; a lot leads to its units.
  const yieldByTag = () =>
    Object.entries(line.yield.by_tag).map(([tag, counts]) => {
      const rows = counts.map((count) => {
        const name = count.value || `no ${tag}`;
        const link = tag === 'lot' && count.value ? element('a', { href: `#${new URLSearchParams({ [`tag.${tag}`]: count.value })}` }, name) : name;
        return row(link, cell(text.count(count.units), 'r'), cell(text.percent(count.good_at_first, count.units), 'r'), cell(text.percent(count.good, count.units), 'r'));
      });
      return section(`Yield by ${tag}`, tableIn(`Yield by ${tag}`, [tag, '>units', '>at the first run', '>good'], rows));
    });

  // The index that matters: of the process itself where calibrations say their σ, else as measured.
  const limitsOf = () => {
    if (!line.limits?.length) return [];
    const rows = [...line.limits].map((each) => {
      const pair = known(each.process?.overall?.ppk?.value) ? each.process : each.observed;
      return { each, pair, ppk: pair?.overall?.ppk?.value ?? Infinity };
    }).sort((a, b) => a.ppk - b.ppk).map(({ each, pair, ppk }) =>
      row(each.name, cell(`${text.allowed(each.lower, each.upper)} ${each.unit.replace('^2', '²').replace('uT', 'µT')}`), cell(text.number(each.mean), 'r'),
        cell(interval(pair?.within?.cpk), 'r'),
        cell(element('span', { class: ppk < 1 ? 'badge is-bad' : '' }, `${ppk < 1 ? '✕ ' : ''}${interval(pair?.overall?.ppk)}`), 'r'),
        cell(share(each.outside), 'r')));
    return [section('Within the limits', tableIn('Capability', ['limit', 'allowed', '>mean', '>Cpk', '>Ppk', '>outside'], rows),
      element('p', { class: 'soft' }, 'The least capable first; the variance of the calibrations is taken out where it is known. Were they normal, up to 0.27 % of the units would be outside at 1, up to 4.6 % at 0.67, up to 13 % at 0.5.'))];
  };

  const drawChart = (place, caption, chart) => {
    const n = chart.points.length;
    const [serial, value, lower, upper] = [0, 1, 2, 3].map((k) => chart.points.map((point) => point[k]));
    const isOut = (k) => (known(upper[k]) && value[k] > upper[k]) || (known(lower[k]) && value[k] < lower[k]);
    const name = nameOf(chart.kind, chart.parameter);
    const out = value.filter((one, k) => isOut(k)).length;
    const hover = element('span', { class: 'hover', 'aria-hidden': 'true' });
    caption.replaceChildren(`${name}${chart.parameter ? `, in σ of the process${known(chart.sigma) ? ` (${text.number(chart.sigma, 3)})` : ''}` : ''}: the last ${text.count(n)} points, ${text.count(out)} beyond the limits.`, hover);
    charts.draw(place, {
      x: value.map((one, k) => k + 1),
      isTime: false,
      lines: [
        { values: upper, kind: 'dashed', colour: 'cross', bare: true },
        { values: lower, kind: 'dashed', colour: 'cross', bare: true },
      ],
      points: { values: value.map((one) => one ?? NaN), isBad: isOut },
      marks: [{ value: chart.line, label: '', colour: 'soft' }],
      label: `${name}. ${out} of ${n} points are beyond the limits.`,
      onHover: (k) => {
        hover.textContent = k === null || k === undefined || k >= n ? '' : ` ${text.flat(serial[k])}: ${text.number(value[k], 4)}`;
      },
      onPick: (k) => {
        location.hash = `unit=${encodeURIComponent(serial[k])}`;
      },
    });
  };

  // Charts of a station, chosen from lists; that of its last alarm first.
  const chartsOf = () => {
    if (!line.charts?.length) return [];
    const station = element('select', {}, ...line.charts.map((each, k) => element('option', { value: k }, each.station || 'no station')));
    const which = element('select', {});
    const place = element('div', { class: 'chart' });
    const caption = element('figcaption', { role: 'status' });
    const alarms = element('div', {});
    let list = [];
    const draw = () => {
      if (which.parentElement) which.parentElement.hidden = list.length === 0;
      place.hidden = list.length === 0;
      if (list.length > 0) drawChart(place, caption, list[Number(which.value)]);
      else caption.textContent = line.charts[Number(station.value)].note || 'There are no charts of this station.';
    };
    const change = () => {
      const at = Number(station.value);
      const about = line.charts[at];
      list = about.charts;
      which.replaceChildren(...list.map((chart, k) => element('option', { value: k }, nameOf(chart.kind, chart.parameter))));
      const last = about.alarms[about.alarms.length - 1];
      const isOfAlarm = (chart) => last && chart.kind === last.kind && chart.parameter === last.parameter;
      const first = list.findIndex(isOfAlarm);
      if (first >= 0) which.value = String(first);
      const rows = about.alarms.slice(-kAlarms).reverse().map((alarm) => {
        const show = element('button', { type: 'button', class: 'link', onclick: () => {
          which.value = String(list.findIndex((chart) => chart.kind === alarm.kind && chart.parameter === alarm.parameter));
          draw();
          place.scrollIntoView({ block: 'nearest' });
        } }, nameOf(alarm.kind, alarm.parameter));
        return row(text.moment(alarm.recorded), cell(unitLink(alarm.serial)), cell(show), cell(alarm.most || '–'), cell(`${text.number(alarm.value, 3)} (${text.number(alarm.limit, 3)})`, 'r'));
      });
      alarms.replaceChildren(...(list.length === 0 ? [] : rows.length === 0
        ? [element('p', {}, `No alarm in ${text.count(about.units)} ${about.units === 1 ? 'unit' : 'units'}.`)]
        : [element('p', {}, `${text.count(about.alarms.length)} ${about.alarms.length === 1 ? 'alarm' : 'alarms'} in ${text.count(about.units)} units${about.alarms.length > kAlarms ? `, the last ${kAlarms} of them` : ''}:`),
          tableIn('Alarms', ['measured, UTC', 'unit', 'chart', 'most by', '>value (limit)'], rows)]));
      draw();
    };
    // What is to be done now comes first.
    const since = (each) => each.alarms[each.alarms.length - 1]?.recorded || '';
    const latest = line.charts.reduce((most, each, k) => (since(each) > since(line.charts[most]) ? k : most), 0);
    station.value = String(latest);
    station.addEventListener('change', change);
    which.addEventListener('change', draw);
    requestAnimationFrame(change); // A chart is as wide as its place, once that is on the page.
    return [section('Control charts',
      element('p', { class: 'controls' }, element('label', {}, 'Station ', station), ' ', element('label', {}, 'Chart ', which)),
      element('figure', {}, place, caption), alarms)];
  };

  const age = (hours) => {
    if (!known(hours)) return '–';
    if (hours < 0) return 'after it';
    return hours < 1 ? `${text.number(60 * hours, 2)} min` : hours < 72 ? `${text.number(hours, 2)} h` : `${text.number(hours / 24, 3)} days`;
  };

  const goldenOf = () => {
    if (!line.golden?.length) return [];
    const rows = line.golden.map((each) => row(each.station || 'no station', cell(each.state === 'good' ? '✓ good' : `✕ ${each.state}`), cell(age(each.age_h), 'r'), cell(String(each.checks.length), 'r'), cell(String(each.disagreed), 'r')));
    return [section('Golden units', tableIn('Golden units', ['station', 'state', '>last check, before the last unit', '>checks', '>disagreed'], rows))];
  };

  window.fleet.line = {
    show: () => {
      document.getElementById('line').hidden = false;
      document.getElementById('line-content').replaceChildren(yieldOf(), ...yieldByTag(), ...limitsOf(), ...chartsOf(), ...goldenOf());
    },
  };
})();
