// SPDX-License-Identifier: Apache-2.0
// One unit: its runs, what people decided, what it was judged by, parameters over its runs.
'use strict';
(() => {
  const { units, text, element, coded, badge, charts, overview } = window.fleet;
  const { row, tableIn, section, cell } = overview;
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
      const when = element('span', {}, time(run), element('small', {}, ` ${by[run.by] ?? ''}`), run.counts && runs.length > 1 ? element('small', {}, ' counts') : '');
      return row(when,
        cell(badge(run.verdict)), cell(run.code), cell(links), cell(tags || '–'), cell(text.second(run.created)), cell(coded(run.message), 'words'));
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
    const rows = units.columns.map((column, k) => [column, run.numbers[k], run.judgements[k]]).filter(([, , judgement]) => judgement)
      .map(([column, number, [lower, , upper, pass]]) =>
        row(column.name, cell(`${text.allowed(lower, upper)} ${column.unit ?? ''}`), cell(text.number(number?.[0] ?? null), 'r'),
          cell(number?.[1] > 0 ? `± ${text.number(number[1], 2)}` : '', 'r'),
          cell(element('span', { class: `badge ${pass ? 'is-good' : 'is-bad'}` }, pass ? '✓ inside' : '✕ outside'))));
    return rows.length === 0 ? [] : [section('Judged by', tableIn('Limits', ['limit', 'allowed', '>value', '>σ', ''], rows))];
  };

  // Of a decision that holds: who made it, and why; else what the run says.
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
  window.fleet.unit = { open, close: () => dialog.open && dialog.close() };
})();
