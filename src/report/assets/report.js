// SPDX-License-Identifier: Apache-2.0
// Script of a report: copies corrections, links poses to their rows. The report is readable without
// it.
'use strict';
(() => {
  document.documentElement.classList.add('scripted');

  // For a page opened from disk the clipboard may be unavailable.
  const copy = async (text) => {
    try {
      await navigator.clipboard.writeText(text);
      return true;
    } catch {
      const area = document.createElement('textarea');
      area.value = text;
      document.body.append(area);
      area.select();
      const isDone = document.execCommand('copy');
      area.remove();
      return isDone;
    }
  };
  for (const place of document.querySelectorAll('[data-copy]')) {
    const button = document.createElement('button');
    const state = document.createElement('span');
    button.type = 'button';
    button.textContent = 'Copy C and b';
    state.className = 'copied';
    state.setAttribute('role', 'status');
    button.addEventListener('click', async () => {
      state.textContent = (await copy(place.dataset.copy)) ? 'copied' : 'could not be copied';
      button.focus();
    });
    place.after(button, state);
  }

  const rowsOf = ({ pose }) => [...document.querySelectorAll('tr[id^=pose-]')].filter(({ id }) => id.split('-')[1] === pose);
  document.addEventListener('click', ({ target }) => {
    const point = target.closest('[data-pose]');
    const rows = point ? rowsOf(point.dataset) : [];
    if (rows.length === 0) return;
    for (const row of document.querySelectorAll('tr.chosen')) row.classList.remove('chosen');
    for (const row of rows) row.classList.add('chosen');
    const sensor = point.closest('[data-sensor]')?.dataset.sensor;
    const row = rows.find(({ id }) => id.endsWith(`-${sensor}`)) ?? rows[0];
    row.closest('details').open = true;
    row.tabIndex = -1;
    row.focus();
    row.scrollIntoView({ block: 'center' });
  });

  // If an element fits and does not scroll, it is removed from the Tab order.
  const stops = document.querySelectorAll('.scroll');
  const trim = () => {
    for (const stop of stops) {
      if (stop.scrollWidth > stop.clientWidth) stop.tabIndex = 0;
      else stop.removeAttribute('tabindex');
    }
  };
  trim();
  window.addEventListener('resize', trim);
  document.addEventListener('toggle', trim, true);
})();
