// SPDX-License-Identifier: Apache-2.0
// One number over the units that are shown, with its limits.
'use strict';
(() => {
  const { units, text, element, charts, overview } = window.fleet;
  const section = document.getElementById('parameter');
  const select = document.getElementById('column');
  const over = document.getElementById('over');
  const caption = document.getElementById('parameter-caption');
  const ends = document.getElementById('parameter-ends');
  let shown = units.all;

  const group = (label, isMember) => {
    const options = units.columns
      .map((column, k) => [column, k])
      .filter(([column]) => isMember(column))
      .map(([column, k]) => element('option', { value: k }, column.name));
    if (options.length > 0) select.append(element('optgroup', { label }, ...options));
  };
  group('Judged by limits', (column) => column.limits);
  group('Parameters, as calibrated', (column) => !column.limits);
  units.hasColumns = units.columns.length > 0;

  const marksOf = (limits) =>
    ['lower limit', 'target', 'upper limit'].map((name, k) => [name, limits?.[k] ?? null]).filter(([, value]) => value !== null)
      .map(([name, value]) => ({ value, label: `${name} ${text.number(value)}`, colour: name === 'target' ? 'soft' : 'cross' }));

  const statisticsOf = (values) => {
    let n = 0;
    let mean = 0;
    let squares = 0;
    for (const value of values) {
      if (!Number.isFinite(value)) continue;
      const step = value - mean;
      mean += step / ++n;
      squares += step * (value - mean);
    }
    return { n, mean, deviation: n > 1 ? Math.sqrt(squares / (n - 1)) : NaN };
  };

  const linkTo = (i) => element('a', { href: `#unit=${encodeURIComponent(units.serials[i])}` }, text.flat(units.serials[i]));

  const draw = () => {
    const column = units.columns[Number(select.value)];
    const all = units.valuesOf(column);
    const limits = units.limitsOf(column);
    const isTime = over.value === 'time';
    const time = (i) => units.recorded[i] || 0; // Units whose time is not known come first.
    const order = Uint32Array.from(shown).filter((i) => Number.isFinite(all[i]) && (!isTime || time(i) > 0))
      .sort((a, b) => time(a) - time(b) || a - b);
    const values = Float64Array.from(order, (i) => all[i]);
    const { n, mean, deviation } = statisticsOf(values);
    const words = `${text.count(n)} units: mean ${text.number(mean)}, standard deviation ${text.number(deviation, 3)}`;
    const hover = element('span', { class: 'hover', 'aria-hidden': 'true' });
    caption.replaceChildren(
      overview.swatch('dot', 'round'), ' good ', element('span', { class: 'cross-sign', 'aria-hidden': 'true' }, '✕'), ' not good. ',
      `${words}.${limits === null ? ' Limits differ among these units; none is drawn.' : ''}`, hover);
    charts.draw(document.getElementById('parameter-chart'), {
      x: Float64Array.from(order, (i, k) => (isTime ? time(i) : k + 1)),
      isTime,
      xLabel: isTime ? undefined : 'units, in the order of time',
      points: { values, isBad: (k) => !units.isGood(order[k]) },
      marks: marksOf(limits),
      label: `${column.name} over ${isTime ? 'time' : 'units'}. ${words}.`,
      hover,
      serialOf: (k) => units.serials[order[k]],
    });
    ends.replaceChildren();
    if (n === 0) return;
    let least = 0;
    let most = 0;
    values.forEach((value, k) => {
      if (value < values[least]) least = k;
      if (value > values[most]) most = k;
    });
    ends.append('Least: ', linkTo(order[least]), ` ${text.number(values[least], 6)}; greatest: `, linkTo(order[most]), ` ${text.number(values[most], 6)}.`);
  };
  select.addEventListener('change', draw);
  over.addEventListener('change', draw);

  window.fleet.parameter = {
    show: (chosen) => {
      shown = chosen;
      section.hidden = !units.hasColumns;
      if (units.hasColumns) draw();
    },
  };
})();
