// SPDX-License-Identifier: Apache-2.0
// Shows the selected units, and keeps the selection in the address, so that it can be saved and
// sent.
'use strict';
(() => {
  const { units, text, element, table, sections } = window.fleet;
  const search = document.getElementById('search');
  const verdict = document.getElementById('verdict');
  const hits = document.getElementById('hits');
  const filter = { text: '', verdict: '', code: '', tags: {} };
  const kTyping = 60; // ms after the last key before slow parts are updated.
  const selects = new Map();

  const option = (value, label) => element('option', { value }, label ?? value);
  verdict.append(option('', 'all'), option('good', 'good'), option('not-good', 'not good'));
  verdict.append(element('optgroup', { label: 'one' }, ...units.verdict.words.map((word) => option(word))));
  // A tag with more values than this has no list, only the search: the values name single units.
  const kMostWords = 2000;
  for (const tag of units.tags) {
    if (tag.words.length < 2 || tag.words.length > kMostWords) continue;
    const select = element('select', { 'data-tag': tag.name, onchange: () => choose({ tags: { ...filter.tags, [tag.name]: select.value } }) },
      option('', 'all'), ...tag.words.filter(Boolean).map((word) => option(word)));
    selects.set(tag.name, select);
    document.getElementById('tag-filters').append(element('label', {}, `${tag.name[0].toUpperCase()}${tag.name.slice(1)} `, select), ' ');
  }

  const address = (more = {}) => {
    const parts = new URLSearchParams();
    if (filter.text) parts.set('text', filter.text);
    if (filter.verdict) parts.set('verdict', filter.verdict);
    if (filter.code) parts.set('code', filter.code);
    for (const [name, word] of Object.entries(filter.tags)) if (word) parts.set(`tag.${name}`, word);
    for (const [name, value] of Object.entries(more)) parts.set(name, value);
    return `#${parts}`;
  };

  let slow = 0;
  let isFirst = true;
  const refresh = () => {
    const shown = units.choose(filter);
    table.show(shown);
    hits.textContent = `${text.count(shown.length)} of ${text.count(units.all.length)} units${filter.code ? ` with ${filter.code}` : ''}: ${text.percent(shown.filter(units.isGood).length, shown.length)} good, ${text.percent(shown.filter(units.isFirstGood).length, shown.length)} at the first run`;
    document.getElementById('reset').disabled = !(filter.text || filter.verdict || filter.code || Object.values(filter.tags).some(Boolean));
    sections.show(shown, filter, (code) => choose({ code }));
    clearTimeout(slow);
    slow = setTimeout(() => sections.showCharts(shown), isFirst ? 0 : kTyping);
    isFirst = false;
  };

  const choose = (change) => {
    Object.assign(filter, change);
    history.replaceState(null, '', address());
    refresh();
  };

  const readAddress = () => {
    const parts = new URLSearchParams(location.hash.slice(1));
    const stated = { text: parts.get('text') ?? '', verdict: parts.get('verdict') ?? '', code: parts.get('code') ?? '', tags: {} };
    for (const [name, word] of parts) if (name.startsWith('tag.')) stated.tags[name.slice(4)] = word;
    return { stated, serial: parts.get('unit') };
  };

  const showFilter = () => {
    search.value = filter.text;
    verdict.value = filter.verdict;
    for (const [name, select] of selects) select.value = filter.tags[name] ?? '';
  };

  search.addEventListener('input', () => choose({ text: search.value }));
  verdict.addEventListener('change', () => choose({ verdict: verdict.value }));
  document.getElementById('filters').addEventListener('submit', (event) => event.preventDefault());
  document.getElementById('reset').addEventListener('click', () => {
    choose({ text: '', verdict: '', code: '', tags: {} });
    showFilter();
    search.focus();
  });
  window.addEventListener('hashchange', () => {
    const { stated, serial } = readAddress();
    if (serial === null) {
      sections.closeUnit();
      Object.assign(filter, stated);
      showFilter();
      refresh();
      return;
    }
    history.replaceState(null, '', address({ unit: serial }));
    sections.openUnit(serial);
  });
  // Shows the same units again after they were sorted.
  window.fleet.showSorted = () => table.show(units.choose(filter));
  window.fleet.closeUnit = () => history.replaceState(null, '', address());

  for (const hidden of document.querySelectorAll('.scripted[hidden]')) hidden.hidden = false;
  document.documentElement.classList.add('has-scripts');
  const { stated, serial } = readAddress();
  Object.assign(filter, stated);
  showFilter();
  refresh();
  sections.showLine();
  if (serial !== null) sections.openUnit(serial);
})();
