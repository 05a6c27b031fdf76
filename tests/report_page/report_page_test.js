// SPDX-License-Identifier: Apache-2.0
// Reports in headless Chromium, from the disk, and on paper. report_page_test.js [KIND...]: of those kinds.
'use strict';
const assert = require('node:assert/strict');
const { spawnSync } = require('node:child_process');
const fs = require('node:fs');
const path = require('node:path');
const { pathToFileURL } = require('node:url');
const { axeFindings, close, comes, kSeenRules, open, skip, withBrowser } = require('../browser/browser.js');
const { makePages, makeReports } = require('./reports.js');
const { spheresTurn } = require('./spheres.js');

const kMostBytes = 300e3;
const kLeastTextPx = 9;
const hasPdfText = spawnSync('pdftotext', ['-v']).error === undefined;

const openReport = (browser, report, options = {}) => {
  const url = pathToFileURL(path.join(report.folder, report.file ?? 'report.html')).href;
  return open(browser, url, url, options);
};
const openAll = (page) => page.evaluate(() => document.querySelectorAll('details').forEach((details) => { details.open = true; }));

// Of the words in drawings the smallest, as it is seen.
const drawingsAreReadable = async (page, report) => {
  const small = () => page.evaluate((least) => [...document.querySelectorAll('svg text')]
    .map((text) => {
      const { a, b } = text.getScreenCTM();
      return [parseFloat(getComputedStyle(text).fontSize) * Math.hypot(a, b), text.textContent];
    })
    .filter(([size]) => size < least - 1e-3), kLeastTextPx);
  await comes(`${report.name}: small words`, small, []);
};

const fitsAndIsAccessible = async (browser, report, axe) => {
  const page = await openReport(browser, report, { bypassCSP: true });
  await page.addScriptTag({ path: axe });
  for (const [colorScheme, width, rules] of [['light', 390, []], ['dark', 1280, kSeenRules]]) {
    await page.emulateMedia({ colorScheme });
    await page.setViewportSize({ width, height: 900 });
    const where = `${report.name}, ${colorScheme}, ${width} px`;
    if (process.env.SCREENSHOTS) await page.screenshot({ path: path.join(process.env.SCREENSHOTS, `${report.name}-${colorScheme}.png`), fullPage: true });
    if (width === 390) await drawingsAreReadable(page, report);
    await openAll(page);
    await comes(`${where}: scrolls sideways by`, () => page.evaluate(() => document.documentElement.scrollWidth - window.innerWidth), 0);
    await comes(where, () => axeFindings(page, rules), '');
  }
  await close(page);
};

const isNear = (shown, value) => Math.abs(shown - value) <= 5.1e-8 * Math.abs(value);

// C and b, as shown and as copied, and biases with σ.
const holdsItsNumbers = async (browser, report) => {
  const page = await openReport(browser, report);
  const calibration = JSON.parse(fs.readFileSync(path.join(report.folder, 'calibration.json')));
  const tables = await page.evaluate(() => [...document.querySelectorAll('table')].map((table) => ({
    copy: table.closest('[data-copy]')?.dataset.copy,
    rows: [...table.rows].map((row) => [...row.cells].map((cell) => cell.textContent)),
  })));
  const corrections = tables.filter(({ copy }) => copy);
  const sensors = report.isRefused ? [] : Object.entries(calibration.sensors);
  assert.equal(corrections.length, sensors.length, report.name);
  for (const [name, sensor] of sensors) {
    const { copy, rows } = corrections.find((table) => table.copy.startsWith(`${name}:`));
    const copied = Object.fromEntries(copy.trim().split('\n').slice(1).map((line) => line.split(' = ')));
    const [c, b] = [JSON.parse(copied.C), JSON.parse(copied.b)];
    for (let i = 0; i < 3; ++i) {
      assert.ok(isNear(b[i], sensor.bias[i]), `${report.name}: b of ${name}`);
      assert.equal(Number(rows[i + 1][5]), b[i]);
      for (let j = 0; j < 3; ++j) {
        assert.ok(isNear(c[i][j], sensor.correction[i][j]), `${report.name}: C of ${name}`);
        assert.equal(Number(rows[i + 1][j + 1]), c[i][j]);
      }
    }
  }
  if (sensors.length > 0) {
    const biases = tables.flatMap(({ rows }) => rows).filter(([first]) => first === 'bias');
    sensors.forEach(([name, { bias, sigma }], at) => {
      for (let i = 0; i < 3; ++i) {
        // "1.2345 ± 0.0012", or "0 fixed"; σ has two digits, and the value ends where it does.
        const value = parseFloat(biases[at][i + 1]);
        assert.ok(Math.abs(value - bias[i]) <= 0.051 * sigma.bias[i], `${report.name}: bias of ${name}: ${value}, ${bias[i]}`);
      }
    });
  }
  await close(page);
};

const copies = async (browser, report) => {
  for (const hasClipboard of [true, false]) {
    const page = await openReport(browser, report);
    if (hasClipboard) await page.context().grantPermissions(['clipboard-read', 'clipboard-write']);
    else await page.evaluate(() => Object.defineProperty(navigator, 'clipboard', { value: undefined }));
    const copy = await page.evaluate(() => {
      document.addEventListener('copy', () => { window.wasCopied = document.activeElement.value; });
      return document.querySelector('[data-copy]').dataset.copy;
    });
    await page.locator('button', { hasText: 'Copy C and b' }).first().click();
    await comes('what the page says', () => page.locator('[role=status]:text-is("copied")').count(), (count) => count > 0);
    await comes('what was copied', () => page.evaluate((is) => (is ? navigator.clipboard.readText() : window.wasCopied), hasClipboard), copy);
    await close(page);
  }
};

const goesToAPose = async (browser, report) => {
  const page = await openReport(browser, report);
  const points = page.locator('svg [data-pose]');
  const hasRows = (await page.locator('tr[id^=pose-]').count()) > 0;
  assert.equal((await points.count()) > 0, hasRows, `${report.name}: marks of poses go with rows of poses`);
  if (hasRows) {
    const pose = await points.first().getAttribute('data-pose');
    await points.first().click({ force: true });
    await comes(`${report.name}: the row gone to`, () => page.evaluate(() => document.activeElement.id), new RegExp(`^pose-${pose}-`));
    await comes(`${report.name}: it is marked`, () => page.isVisible('tr.chosen'), true);
  }
  await close(page);
};

const worksWithoutScripts = async (browser, report) => {
  const page = await openReport(browser, report, { javaScriptEnabled: false });
  await comes(`${report.name}: buttons`, () => page.locator('button').count(), 0);
  await comes(`${report.name}: the verdict is seen`, () => page.isVisible('.verdict'), true);
  await comes(`${report.name}: what scrolls by the mouse alone`, () => page.locator('.scroll:not([tabindex="0"])').count(), 0);
  await close(page);
};

// A row of a table stands on paper as it is in the page, or something of it was cut off.
const squeezed = (text) => text.normalize('NFKC').replace(/\s+/g, '');
const printsWhole = async (browser, report) => {
  const page = await openReport(browser, report, { colorScheme: 'dark' });
  const rows = await page.evaluate(() => [...document.querySelectorAll('tr')].filter((row) => !row.closest('.screen')).map((row) => row.textContent));
  for (const format of ['A4', 'Letter']) {
    const file = path.join(report.folder, `${format}.pdf`);
    await page.pdf({ path: file, format, preferCSSPageSize: false, printBackground: true });
    const { stdout } = spawnSync('pdftotext', ['-raw', file, '-'], { encoding: 'utf8', maxBuffer: 1e8 });
    const text = squeezed(stdout);
    const lost = rows.filter((row) => !text.includes(squeezed(row)));
    assert.deepEqual(lost, [], `${report.name}, ${format}`);
    const pages = stdout.split('\f').length - 1;
    assert.ok(pages <= (report.mostPages ?? Infinity), `${report.name}, ${format}: ${pages} pages`);
    console.log(`  ${report.name}, ${format}: ${pages} pages`);
  }
  await close(page);
};

withBrowser(async (browser, axe, folder) => {
  const reports = makeReports(process.env.REPORTS ?? folder, process.argv.slice(2));
  for (const report of reports) {
    const { size } = fs.statSync(path.join(report.folder, 'report.html'));
    assert.ok(size <= (report.mostBytes ?? kMostBytes), `${report.name}: ${size} bytes`);
    for (const test of [fitsAndIsAccessible, holdsItsNumbers, worksWithoutScripts, goesToAPose]) {
      await test(browser, report, axe);
    }
    if (report.spheres) await spheresTurn(browser, report, axe);
    if (hasPdfText) await printsWhole(browser, report);
    console.log(`ok ${report.name}`);
  }
  for (const page of makePages(folder)) await fitsAndIsAccessible(browser, page, axe);
  console.log('ok pages of other verbs');
  const copied = reports.find(({ isRefused }) => !isRefused);
  if (copied) await copies(browser, copied);
  console.log('ok copies');
}).then(
  () => { if (!hasPdfText) skip('what is on paper, as there is no pdftotext (poppler-utils)'); },
  (error) => {
    console.error(error);
    process.exit(1);
  },
);
