// SPDX-License-Identifier: Apache-2.0
// measure.js [UNITS]: how long the page of so many units (100000) takes to open and to filter, medians.
// Environment as CMakeLists.txt sets it; FOLDER: where a page is already.
'use strict';
const { execFileSync } = require('node:child_process');
const fs = require('node:fs');
const path = require('node:path');
const { pathToFileURL } = require('node:url');
const { withBrowser } = require('../browser/browser.js');
const { makePage } = require('./make_page.js');

const kUnits = Number(process.argv[2] ?? 100000);
const kRounds = 7;
const median = (numbers) => [...numbers].sort((a, b) => a - b)[Math.floor(numbers.length / 2)];
const show = (what, numbers) => console.log(`${what}: ${median(numbers).toFixed(0)} ms (${Math.min(...numbers).toFixed(0)} to ${Math.max(...numbers).toFixed(0)})`);

// From the event to the frame that shows the table and the reasons, and to that with the charts, which
// wait for a pause in typing; ms.
const timed = (page, act, hasCharts) =>
  page.evaluate(async ([source, hasCharts]) => {
    const frames = () => new Promise((take) => requestAnimationFrame(() => requestAnimationFrame(take)));
    const place = document.getElementById('parameter-chart');
    const before = place.querySelector('canvas');
    await frames();
    const begin = performance.now();
    new Function(source)();
    await frames();
    const shown = performance.now() - begin;
    while (hasCharts && place.querySelector('canvas') === before && performance.now() - begin < 2000) await frames();
    return [shown, performance.now() - begin];
  }, [act, hasCharts]);

const kActs = {
  'search by a part of a serial number': "const s = document.getElementById('search'); s.value = s.value === '777' ? '' : '777'; s.dispatchEvent(new Event('input'));",
  'search that every unit matches': "const s = document.getElementById('search'); s.value = s.value === 'u' ? '' : 'u'; s.dispatchEvent(new Event('input'));",
  'filter by verdict': "const s = document.getElementById('verdict'); s.value = s.value === 'not-good' ? '' : 'not-good'; s.dispatchEvent(new Event('change'));",
  'filter by station': "const s = document.querySelector('[data-tag=station]'); s.selectedIndex = s.selectedIndex === 2 ? 0 : 2; s.dispatchEvent(new Event('change'));",
  'sort by time': "[...document.querySelectorAll('#units th button')].find((b) => b.textContent.startsWith('Measured')).click();",
  'scroll to the end': "const v = document.getElementById('units'); v.scrollTop = v.scrollTop > 0 ? 0 : 1e9;",
};

withBrowser(async (browser, axe, temporary) => {
  const folder = process.env.FOLDER ?? temporary;
  if (!process.env.FOLDER) makePage(folder, kUnits);
  const index = path.join(folder, 'page/index.html');
  console.log(`${kUnits} units; data.js ${(fs.statSync(path.join(folder, 'page/data.js')).size / 1e6).toFixed(1)} MB, folder ${execFileSync('du', ['-sm', path.join(folder, 'page')]).toString().split('\t')[0]} MB`);
  const opened = [];
  const drawn = [];
  let page;
  for (let round = 0; round < kRounds; ++round) {
    await page?.context().close();
    page = await (await browser.newContext({ viewport: { width: 1280, height: 900 }, bypassCSP: true })).newPage();
    const begin = Date.now();
    await page.goto(pathToFileURL(index).href);
    await page.waitForFunction(() => document.querySelectorAll('#units tbody a').length > 10);
    opened.push(Date.now() - begin);
    await page.waitForSelector('#parameter-chart canvas');
    drawn.push(Date.now() - begin);
  }
  show('opens, table in use', opened);
  show('opens, all charts drawn', drawn);
  for (const [name, act] of Object.entries(kActs)) {
    const hasCharts = !/^(scroll|sort)/.test(name);
    const times = [];
    for (let round = 0; round < 2 * kRounds; ++round) {
      times.push(await timed(page, act, hasCharts));
      await page.waitForTimeout(500);
    }
    show(name, times.map(([shown]) => shown));
    if (hasCharts) show(`${name}, with charts`, times.map(([, drawn]) => drawn));
  }
});
