// SPDX-License-Identifier: Apache-2.0
// What the line's statistics say: the tables of `fleet summary`, and control charts of each station
// with their alarms.
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

  // The tables of `fleet summary`; a lot leads to its units.
  const tablesOf = () => line.tables.map(({ heading, header, alignment, rows, notes }) => {
    const names = header.map((name, k) => (alignment[k] === 'r' ? `>${name}` : name));
    const link = (word) => (header[0] === 'lot' && word !== '(none)' ? element('a', { href: `#${new URLSearchParams({ 'tag.lot': word })}` }, word) : word);
    const shown = rows.map(([name, ...cells]) => row(link(name), ...cells.map((words, k) => cell(words, alignment[k + 1] === 'r' ? 'r' : null))));
    return section(heading, ...(rows.length > 0 ? [tableIn(heading, names, shown)] : []), ...notes.map((note) => element('p', { class: 'soft' }, note)));
  });

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
      hover,
      serialOf: (k) => serial[k],
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

  window.fleet.line = {
    show: () => {
      document.getElementById('line').hidden = false;
      document.getElementById('line-content').replaceChildren(...tablesOf(), ...chartsOf());
    },
  };
})();
