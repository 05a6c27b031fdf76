// SPDX-License-Identifier: Apache-2.0
// The table of units. The document has only the visible rows, in a real table that states the total
// number of rows. Arrow keys, Page Up and Down, Home and End move through all rows.
'use strict';
(() => {
  const { units, text, element, badge } = window.fleet;
  const kRow = 32; // px, as .rows tr in fleet.css
  const kMostHeight = 12e6; // px; browsers limit heights to about 17 million.
  const kPrinted = 500;

  const column = (name, label, key, cell, className = '') => ({ name, label, key, cell, className });
  const columns = [
    column('serial', 'Serial number', (i) => i, null, 'serial'),
    column('verdict', 'Verdict', (i) => units.verdict.of[i], (i) =>
      badge(units.verdict.words[units.verdict.of[i]])),
    column('code', 'Reason', (i) => units.code.of[i], (i) => units.code.words[units.code.of[i]]),
    ...units.tags.map((tag) =>
      column(tag.name, tag.name[0].toUpperCase() + tag.name.slice(1), (i) => tag.of[i], (i) =>
        tag.words[tag.of[i]])),
    column('time', 'Measured, UTC', (i) => units.recorded[i] || 0, (i) => text.minute(units.recorded[i]), 'time'),
    column('runs', 'Runs', (i) => units.runs[i], (i) => String(units.runs[i]), 'r'),
  ];

  const state = { shown: units.all, active: 0, sort: 'serial', descending: false, printed: 0 };
  const body = element('tbody');
  const before = element('tbody', { class: 'space', 'aria-hidden': 'true' }, element('tr', {}, element('td', { colspan: columns.length })));
  const after = before.cloneNode(true);
  const headings = columns.map((each) =>
    element(
      'th',
      { scope: 'col', class: each.className, 'aria-colindex': columns.indexOf(each) + 1 },
      element('button', { type: 'button', onclick: () => sort(each.name) }, each.label,
        element('span', { class: 'arrow', 'aria-hidden': 'true' })),
    ),
  );
  const table = element(
    'table',
    { 'aria-labelledby': 'units-title', 'aria-colcount': columns.length },
    element('thead', {}, element('tr', { 'aria-rowindex': 1 }, ...headings)),
    before,
    body,
    after,
  );
  const view = document.getElementById('units');
  view.append(table);

  const total = () => state.shown.length * kRow;
  const height = () => Math.min(total(), kMostHeight);
  const capacity = () => Math.max(1, Math.floor((view.clientHeight - kRow) / kRow));
  // The index of the first visible row. The scroll bar's range may be shorter than the rows.
  const firstInView = () => {
    const most = Math.max(0, state.shown.length - capacity());
    const range = Math.max(1, height() + kRow - view.clientHeight);
    return Math.min(most, Math.floor((view.scrollTop / range) * most + 1e-6));
  };
  const scrollTo = (first) => {
    const most = Math.max(1, state.shown.length - capacity());
    const range = Math.max(0, height() + kRow - view.clientHeight);
    view.scrollTop = Math.ceil((first / most) * range);
  };

  const row = (place) => {
    const i = state.shown[place];
    const cells = columns.map((each) => {
      if (each.name === 'serial') {
        const link = element('a', { href: `#unit=${encodeURIComponent(units.serials[i])}`, tabindex: place === state.active ? 0 : -1, 'data-place': place }, text.flat(units.serials[i]));
        return element('th', { scope: 'row', class: each.className }, link);
      }
      const content = each.cell(i);
      const cell = element('td', { class: each.className }, content);
      if (typeof content === 'string' && content.length > 12) cell.title = content;
      return cell;
    });
    return element('tr', { 'aria-rowindex': place + 2 }, ...cells);
  };

  const draw = () => {
    const margin = 8;
    const first = state.printed ? 0 : Math.max(0, firstInView() - margin);
    const end = Math.min(state.shown.length, state.printed || first + capacity() + 2 * margin + 1);
    const focused = body.contains(document.activeElement);
    // Visible rows stay at the scroll position, even if the scroll bar's range is too short for all
    // rows.
    const shift = state.printed ? 0 : view.scrollTop - (firstInView() - first) * kRow;
    const top = total() <= kMostHeight ? first * kRow : Math.max(0, shift);
    before.hidden = after.hidden = Boolean(state.printed);
    before.firstChild.firstChild.style.height = `${top}px`;
    after.firstChild.firstChild.style.height = `${Math.max(0, height() - top - (end - first) * kRow)}px`;
    const rows = [];
    for (let place = first; place < end; ++place) rows.push(row(place));
    body.replaceChildren(...rows);
    if (rows.length > 0 && !body.querySelector('a[tabindex="0"]')) {
      // If the last used row is out of view, the Tab key still enters the table.
      body.querySelectorAll('a')[Math.min(margin, rows.length - 1)].tabIndex = 0;
    }
    if (focused) body.querySelector(`a[data-place="${state.active}"]`)?.focus({ preventScroll: true });
  };

  const activate = (place) => {
    if (state.shown.length === 0) return;
    state.active = Math.max(0, Math.min(state.shown.length - 1, place));
    const first = firstInView();
    if (state.active < first) scrollTo(state.active);
    else if (state.active >= first + capacity()) scrollTo(state.active - capacity() + 1);
    draw();
    body.querySelector(`a[data-place="${state.active}"]`)?.focus({ preventScroll: true });
  };

  const steps = {
    ArrowDown: () => state.active + 1,
    ArrowUp: () => state.active - 1,
    PageDown: () => state.active + capacity(),
    PageUp: () => state.active - capacity(),
    Home: () => 0,
    End: () => state.shown.length - 1,
  };
  body.addEventListener('keydown', (event) => {
    const step = steps[event.key];
    if (!step || event.altKey || event.metaKey) return;
    event.preventDefault();
    activate(step());
  });
  body.addEventListener('focusin', (event) => {
    if (event.target.dataset.place) state.active = Number(event.target.dataset.place);
  });

  const sort = (name) => {
    state.descending = state.sort === name && !state.descending;
    state.sort = name;
    units.sortBy(columns.find((each) => each.name === name).key, state.descending);
    mark();
    window.fleet.showSorted();
  };
  const mark = () => {
    columns.forEach((each, k) => {
      const sorted = each.name === state.sort;
      const direction = state.descending ? 'descending' : 'ascending';
      headings[k].setAttribute('aria-sort', sorted ? direction : 'none');
    });
  };
  mark();

  let asked = 0;
  view.addEventListener('scroll', () => {
    if (asked) return;
    asked = requestAnimationFrame(() => {
      asked = 0;
      draw();
    });
  });
  window.addEventListener('resize', draw);
  const note = document.getElementById('print-note');
  window.addEventListener('beforeprint', () => {
    state.printed = Math.min(kPrinted, state.shown.length);
    note.textContent = state.shown.length > kPrinted ? `The first ${kPrinted} of ${text.count(state.shown.length)} units.` : '';
    draw();
  });
  window.addEventListener('afterprint', () => {
    state.printed = 0;
    draw();
  });

  window.fleet.table = {
    show: (shown) => {
      state.shown = shown;
      state.active = 0;
      table.setAttribute('aria-rowcount', shown.length + 1);
      view.classList.toggle('is-empty', shown.length === 0);
      view.style.setProperty('--rows', Math.min(shown.length, 15));
      view.scrollTop = 0;
      draw();
    },
    focus: () => body.querySelector('a[tabindex="0"]')?.focus(),
  };
})();
