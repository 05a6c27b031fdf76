// SPDX-License-Identifier: Apache-2.0
// The sections of the page: the results of the units, one value of all units, the statistics of the
// line, and the dialog of one unit.
'use strict';
(() => {
  const { units, text, element, badge, breakable, coded, charts } = window.fleet;
  const unitLink = (serial) => element('a', { href: `#unit=${encodeURIComponent(serial)}` }, text.flat(serial));

  // --- results of the shown units: verdicts, reasons by frequency, yield over time
  const kReasons = 12;

  const cell = (content, className) => element('td', { class: className ?? null }, content);
  const row = (first, ...cells) => element('tr', {}, element('th', { scope: 'row' }, first), ...cells);
  // `headings` are names or cells; a > before a name marks a numeric column.
  const headingOf = (name) => (typeof name !== 'string' ? name
    : element('th', { scope: 'col', class: name.startsWith('>') ? 'r' : null }, name.replace(/^>/, '')));
  const tableOf = (headings, rows) =>
    element('table', {}, element('thead', {}, element('tr', {}, ...headings.map(headingOf))), element('tbody', {}, ...rows));
  // A table that scrolls if it is too wide.
  const tableIn = (label, headings, rows) =>
    element('div', { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': label }, tableOf(headings, rows));
  const section = (name, ...parts) => element('section', {}, element('h3', {}, name), ...parts);

  const countBy = (of, shown, isMeant) => {
    const counts = new Uint32Array(of.words.length);
    for (const i of shown) if (isMeant(i)) ++counts[of.of[i]];
    return [...counts.keys()].filter((k) => counts[k] > 0).map((k) => [of.words[k], counts[k]])
      .sort((a, b) => b[1] - a[1]);
  };

  const showVerdicts = (shown) => {
    const rows = countBy(units.verdict, shown, () => true).map(([verdict, count]) =>
      row(badge(verdict), cell(text.count(count), 'r'), cell(text.percent(count, shown.length), 'r')));
    document.getElementById('verdicts').replaceChildren(tableOf(['verdict', '>units', '>share'], rows));
  };

  // The reasons why units are not good, the most frequent first, each with the cumulative share of
  // these units.
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
      const button = element('button', { type: 'button', class: 'link', 'aria-pressed': String(filter.code === code), title: 'Show only units with this reason', onclick: () => choose(filter.code === code ? '' : code) }, ...breakable(code || 'no reason given'));
      return row(button, cell(bar, 'bars'), cell(text.count(count), 'r'), cell(text.percent(sum, all), 'r'));
    });
    const parts = [tableOf(['reason', cell('', 'bars'), '>units', '>cumulative'], rows)];
    if (reasons.length > kReasons) {
      parts.push(element('p', { class: 'soft' }, `${reasons.length - kReasons} more reasons, of ${text.count(all - sum)} units.`));
    }
    place.replaceChildren(...parts);
  };

  const kHour = 3600;
  const kDay = 24 * kHour;

  // Counts units in intervals of 5 minutes, an hour, a day or a week, depending on the span of all
  // times.
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
      label: `Yield over time, ${name} a point; the table below has the numbers.`,
    });
    document.getElementById('yield-caption').replaceChildren(
      swatch('dot', 'solid'), ' good in the end, %  ', swatch('cross', 'dashed'), ' good at the first run, %  ',
      swatch('bars', 'block'), ` units in ${name} (right axis)`);
    const time = (bin) => (step < kDay ? text.minute(bin.at) : text.day(bin.at));
    const details = document.getElementById('yield-details');
    const fill = () => {
      if (!details.open) return;
      details.querySelector('div').replaceChildren(tableOf(
        ['from, UTC', '>units', '>good', '>at the first run'],
        bins.map((bin) => row(time(bin), cell(text.count(bin.count), 'r'), cell(text.percent(bin.good, bin.count), 'r'), cell(text.percent(bin.first, bin.count), 'r')))));
    };
    details.ontoggle = fill;
    fill();
  };

  // --- one value of each shown unit, with its limits

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

  const draw = () => {
    const column = units.columns[Number(select.value)];
    const all = units.valuesOf(column);
    const limits = units.limitsOf(column);
    const isTime = over.value === 'time';
    const time = (i) => units.recorded[i] || 0; // Units of unknown time come first.
    const order = Uint32Array.from(shown).filter((i) => Number.isFinite(all[i]) && (!isTime || time(i) > 0))
      .sort((a, b) => time(a) - time(b) || a - b);
    const values = Float64Array.from(order, (i) => all[i]);
    const { n, mean, deviation } = statisticsOf(values);
    const words = `${text.count(n)} units: mean ${text.number(mean)}, standard deviation ${text.number(deviation, 3)}`;
    const hover = element('span', { class: 'hover', 'aria-hidden': 'true' });
    caption.replaceChildren(
      swatch('dot', 'round'), ' good ', element('span', { class: 'cross-sign', 'aria-hidden': 'true' }, '✕'), ' not good. ',
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
    ends.append('Least: ', unitLink(units.serials[order[least]]), ` ${text.number(values[least], 6)}; greatest: `, unitLink(units.serials[order[most]]), ` ${text.number(values[most], 6)}.`);
  };
  select.addEventListener('change', draw);
  over.addEventListener('change', draw);

  const showParameter = (chosen) => {
    shown = chosen;
    document.getElementById('parameter').hidden = units.columns.length === 0;
    if (units.columns.length > 0) draw();
  };

  // --- statistics of the line: the tables of `fleet summary`, and control charts of each station
  // with their alarms

  const line = units.line;
  const kAlarms = 50; // Only this many alarms are shown, the last ones.

  const kinds = {
    ewma: 'EWMA of units',
    t2: 'all parameters together (Hotelling T²)',
  };
  const nameOf = (kind, parameter) => (parameter ? `${parameter}, ${kinds[kind] ?? kind}` : kinds[kind] ?? kind);
  const known = (value) => value !== null && value !== undefined && Number.isFinite(value);

  // The tables of `fleet summary`. The name of a lot is a link to its units.
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

  // A chart of one station. The user selects both from lists; at first, the station with the last
  // alarm is selected.
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
          tableIn('Alarms', ['measured, UTC', 'unit', 'chart', 'most due to', '>value (limit)'], rows)]));
      draw();
    };
    // At first shows the station with the latest alarm, which needs action first.
    const since = (each) => each.alarms[each.alarms.length - 1]?.recorded || '';
    const latest = line.charts.reduce((most, each, k) => (since(each) > since(line.charts[most]) ? k : most), 0);
    station.value = String(latest);
    station.addEventListener('change', change);
    which.addEventListener('change', draw);
    requestAnimationFrame(change); // The width of a chart is known only when it is on the page.
    return [section('Control charts',
      element('p', { class: 'controls' }, element('label', {}, 'Station ', station), ' ', element('label', {}, 'Chart ', which)),
      element('figure', {}, place, caption), alarms)];
  };

  const showLine = () => {
    document.getElementById('line').hidden = false;
    document.getElementById('line-content').replaceChildren(...tablesOf(), ...chartsOf());
  };

  // --- one unit: its runs, decisions, limits, and parameters over its runs

  const dialog = document.getElementById('unit');
  const title = document.getElementById('unit-title');
  const content = document.getElementById('unit-content');
  const kRunsInTable = 5;
  let back = null;

  const time = (run) => text.second(run.recorded);
  const by = { list: 'by the list', recording: 'by the recording', file: 'by its file' };

  const runsOf = (runs) => {
    const rows = [...runs].reverse().map((run) => {
      const links = run.report ? element('a', { href: run.report }, 'report') : '–';
      const tags = run.tags.map(([name, value]) => `${name} ${value}`).join(', ');
      const when = element('span', {}, time(run), element('small', {}, ` ${by[run.by] ?? ''}`), run.counts && runs.length > 1 ? element('small', {}, ' (current run)') : '');
      return row(when,
        cell(badge(run.verdict)), cell(run.code), cell(links), cell(tags || '–'), cell(text.second(run.created)), cell(coded(run.message), 'words'));
    });
    return section(runs.length === 1 ? 'Its run' : `Its ${runs.length} runs`,
      tableIn('Runs', ['measured, UTC', 'verdict', 'reason', 'page', 'tags', 'calibrated, UTC', 'why'], rows));
  };

  const dispositionsOf = (runs) => {
    const rows = runs.flatMap((run) => run.dispositions.map(([created, who, verdict, why, end]) =>
      row(text.moment(created), cell(who), cell(verdict), cell(why, 'words'),
        cell(end === '' ? 'holds' : end === 'later' ? 'replaced by a later decision' : `no longer holds, since run ${end} is current now`, 'words'))));
    return rows.length === 0 ? [] : [section('What people decided', tableIn('Dispositions', ['when', 'who', 'verdict', 'why', 'now'], rows))];
  };

  const judgedOf = (run) => {
    const rows = units.columns.map((column, k) => [column, run.numbers[k], run.judgements[k]]).filter(([, , judgement]) => judgement)
      .map(([column, number, [lower, , upper, pass]]) =>
        row(column.name, cell(`${text.allowed(lower, upper)} ${column.unit ?? ''}`), cell(text.number(number?.[0] ?? null), 'r'),
          cell(number?.[1] > 0 ? `± ${text.number(number[1], 2)}` : '', 'r'),
          cell(element('span', { class: `badge ${pass ? 'is-good' : 'is-bad'}` }, pass ? '✓ inside' : '✕ outside'))));
    return rows.length === 0 ? [] : [section('Judged by', tableIn('Limits', ['limit', 'allowed', '>value', '>σ', ''], rows))];
  };

  // If a decision is in force, its author and reason; otherwise the message of the current run.
  const reasonOf = (runs, counting) => {
    const [decision] = runs.flatMap((run) => run.dispositions).filter(([, , , , end]) => end === '');
    return decision ? `decided by ${decision[1]}: ${decision[3]}` : counting.message;
  };

  const drawOver = (place, runs, k) => {
    const at = runs.map((run, number) => number).filter((number) => runs[number].numbers[k]);
    charts.draw(place, {
      x: at.map((number) => number + 1),
      isTime: false,
      xLabel: 'run',
      points: { values: at.map((number) => runs[number].numbers[k][0]), sigmas: at.map((number) => 2 * runs[number].numbers[k][1]), isBad: () => false },
      range: undefined,
      label: `${units.columns[k].name} over the runs of this unit`,
    });
  };

  const parametersOf = (runs) => {
    const isKnown = (run, k) => !units.columns[k].limits && run.numbers[k];
    const known = [...units.columns.keys()].filter((k) => runs.some((run) => isKnown(run, k)));
    if (known.length === 0) return [];
    const inTable = runs.filter((run) => known.some((k) => isKnown(run, k))).slice(-kRunsInTable);
    const rows = known.map((k) => row(units.columns[k].name,
      ...inTable.map(({ numbers }) => {
        const [value, sigma] = numbers[k] ?? [null, 0];
        return cell(value === null ? '–' : `${text.number(value, 6)}${sigma > 0 ? ` ± ${text.number(sigma, 2)}` : ' fixed'}`, 'r');
      })));
    const parts = [tableIn('Parameters', ['parameter', ...inTable.map((run) => `>${time(run)}`)], rows)];
    if (inTable.length > 1) {
      const chart = element('div', { class: 'chart' });
      const select = element('select', { onchange: () => drawOver(chart, runs, Number(select.value)) },
        ...known.map((k) => element('option', { value: k }, units.columns[k].name)));
      parts.unshift(element('p', { class: 'controls' }, element('label', {}, 'Over its runs ', select)),
        element('figure', {}, chart, element('figcaption', {}, 'Values with ±2 σ.')));
      requestAnimationFrame(() => drawOver(chart, runs, known[0]));
    }
    return [section('Parameters', element('p', { class: 'soft' }, 'In the units of the log.'), ...parts)];
  };

  const open = (serial) => {
    const i = units.serials.indexOf(serial);
    title.textContent = serial || 'no serial number';
    if (i < 0) {
      content.replaceChildren(element('p', {}, 'There is no such unit on this page.'));
    } else {
      const runs = units.runsOf(i);
      const last = runs.find((run) => run.counts);
      content.replaceChildren(
        element('p', {}, badge(units.verdict.words[units.verdict.of[i]]), ' ', coded(text.flat(reasonOf(runs, last)))),
        runsOf(runs), ...dispositionsOf(runs), ...judgedOf(last), ...parametersOf(runs));
    }
    if (!dialog.open) {
      back = document.activeElement;
      dialog.showModal();
    }
    title.focus();
  };

  document.getElementById('unit-close').addEventListener('click', () => dialog.close());
  dialog.addEventListener('click', (event) => {
    if (event.target === dialog) dialog.close();
  });
  dialog.addEventListener('close', () => {
    window.fleet.closeUnit();
    if (back && back.isConnected) back.focus();
    else window.fleet.table.focus();
  });

  window.fleet.sections = {
    show: (shown, filter, choose) => {
      showVerdicts(shown);
      showReasons(shown, filter, choose);
    },
    // Draws the charts, which is slow.
    showCharts: (shown) => {
      showYield(shown);
      showParameter(shown);
    },
    showLine,
    openUnit: open,
    closeUnit: () => dialog.open && dialog.close(),
  };
})();
