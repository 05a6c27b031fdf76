// SPDX-License-Identifier: Apache-2.0
// One unit: its runs, what people decided, what it was judged by, findings, parameters over its runs.
'use strict';
(() => {
  const { units, text, element, coded, badge, charts, overview } = window.fleet;
  const { row, tableIn, section, cell } = overview;
  const dialog = document.getElementById('unit');
  const title = document.getElementById('unit-title');
  const content = document.getElementById('unit-content');
  const kRunsInTable = 5;
  let back = null;

  const time = (run) => text.moment(run.recorded);
  const by = { list: 'by the list', recording: 'by the recording', file: 'by its file' };

  const runsOf = (runs) => {
    const rows = [...runs].reverse().map((run) => {
      const links = run.report ? element('a', { href: run.report }, 'report') : '–';
      const tags = Object.entries(run.tags).map(([name, value]) => `${name} ${value}`).join(', ');
      const when = element('span', {}, time(run), element('small', {}, ` ${by[run.by] ?? ''}`), run.counts && runs.length > 1 ? element('small', {}, ' counts') : '');
      return row(when,
        cell(badge(run.verdict)), cell(run.code), cell(links), cell(tags || '–'), cell(text.moment(run.created)), cell(coded(run.message), 'words'));
    });
    return section(runs.length === 1 ? 'Its run' : `Its ${runs.length} runs`,
      tableIn('Runs', ['measured, UTC', 'verdict', 'reason', 'page', 'tags', 'calibrated, UTC', 'why'], rows));
  };

  const dispositionsOf = (runs) => {
    const rows = runs.flatMap((run) => run.dispositions.map(([created, who, verdict, why, end]) =>
      row(text.moment(created), cell(who), cell(verdict), cell(why, 'words'),
        cell(end === '' ? 'holds' : end === 'later' ? 'a later decision took its place' : `lifted: run ${end}, of another recording, counts`, 'words'))));
    return rows.length === 0 ? [] : [section('What people decided', tableIn('Dispositions', ['when', 'who', 'verdict', 'why', 'now'], rows))];
  };

  const judgedOf = (run) => {
    if (run.judged.length === 0) return [];
    const rows = run.judged.map(([column, lower, , upper, value, sigma, pass]) =>
      row(units.columns[column].name,
        cell(`${text.allowed(lower, upper)} ${units.columns[column].unit ?? ''}`), cell(text.number(value), 'r'), cell(sigma > 0 ? `± ${text.number(sigma, 2)}` : '', 'r'),
        cell(element('span', { class: `badge ${pass ? 'is-good' : 'is-bad'}` }, pass ? '✓ inside' : '✕ outside'))));
    return [section('Judged by', tableIn('Limits', ['limit', 'allowed', '>value', '>σ', ''], rows))];
  };

  // Of a decision that holds: who made it, and why; else what the run says.
  const reasonOf = (runs, counting) => {
    const [decision] = runs.flatMap((run) => run.dispositions).filter(([, , , , end]) => end === '');
    return decision ? `decided by ${decision[1]}: ${decision[3]}` : counting.message;
  };

  const findingsOf = (run) =>
    run.findings.length === 0 ? [] : [section('Findings', element('ul', {}, ...run.findings.map(([severity, code, words, remedy]) =>
      element('li', {}, coded(words), remedy ? element('div', { class: 'remedy' }, 'To do: ', coded(remedy)) : ' ', element('small', {}, `${severity}, ${code}`)))))];

  // By column of the parameters of a run: [value, sigma].
  const numbersOf = (run) => {
    const numbers = new Map();
    for (let k = 0; k < run.parameters.length; k += 3) {
      numbers.set(run.parameters[k], [run.parameters[k + 1], run.parameters[k + 2]]);
    }
    return numbers;
  };

  const drawOver = (place, runs, numbers, column) => {
    const at = runs.map((run, k) => k).filter((k) => numbers[k].has(column));
    charts.draw(place, {
      x: at.map((k) => k + 1),
      isTime: false,
      xLabel: 'run',
      points: { values: at.map((k) => numbers[k].get(column)[0]), sigmas: at.map((k) => 2 * numbers[k].get(column)[1]), isBad: () => false },
      range: undefined,
      label: `${units.columns[column].name} over the runs of this unit`,
    });
  };

  const parametersOf = (runs) => {
    const numbers = runs.map(numbersOf);
    const names = [...new Set(numbers.flatMap((map) => [...map.keys()]))].sort((a, b) => a - b);
    if (names.length === 0) return [];
    const inTable = runs.map((run, k) => k).filter((k) => numbers[k].size > 0).slice(-kRunsInTable);
    const rows = names.map((column) => row(units.columns[column].name,
      ...inTable.map((k) => {
        const [value, sigma] = numbers[k].get(column) ?? [null, 0];
        return cell(value === null ? '–' : `${text.number(value, 6)}${sigma > 0 ? ` ± ${text.number(sigma, 2)}` : ' fixed'}`, 'r');
      })));
    const parts = [tableIn('Parameters', ['parameter', ...inTable.map((k) => `>${time(runs[k])}`)], rows)];
    if (inTable.length > 1) {
      const chart = element('div', { class: 'chart' });
      const select = element('select', { onchange: () => drawOver(chart, runs, numbers, Number(select.value)) },
        ...names.map((column) => element('option', { value: column }, units.columns[column].name)));
      parts.unshift(element('p', { class: 'controls' }, element('label', {}, 'Over its runs ', select)),
        element('figure', {}, chart, element('figcaption', {}, 'Values with ±2 σ.')));
      requestAnimationFrame(() => drawOver(chart, runs, numbers, names[0]));
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
      const last = units.counting[i];
      content.replaceChildren(
        element('p', {}, badge(units.verdict.words[units.verdict.of[i]]), ' ', coded(text.flat(reasonOf(runs, last)))),
        runsOf(runs), ...dispositionsOf(runs), ...judgedOf(last), ...findingsOf(last), ...parametersOf(runs));
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
  window.fleet.unit = { open, close: () => dialog.open && dialog.close() };
})();
