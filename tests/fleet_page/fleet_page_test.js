// SPDX-License-Identifier: Apache-2.0
// The page of `fleet report` in headless Chromium, from the disk and from a server on loopback.
'use strict';
const assert = require('node:assert/strict');
const fs = require('node:fs');
const path = require('node:path');
const { pathToFileURL } = require('node:url');
const { axeFindings, close, comes, open, serve, until, withBrowser } = require('../browser/browser.js');
const { makePage } = require('./make_page.js');

const kUnits = 600;
const kStrange = '<script>alert(1)</script>';

// Numbers in the text of how many units are shown; NaN before there is one.
const hits = async (page) => {
  const digits = (await page.textContent('#hits')).replace(/ of .*/, '').replace(/\D/g, '');
  return digits === '' ? NaN : Number(digits);
};
const shows = (page, count) => comes('units shown', () => hits(page), count);
// Fills again until so many are shown: a key is lost where a dialog that closes moves the focus under it.
const searches = (page, words, isSo) => until(async () => isSo(await hits(page)), `other units are shown for '${words}'`, () => page.fill('#search', words));
const rows = (page) => page.locator('#units tbody:not(.space) tr');
const showsFirst = (page, serial) => comes('the first row', () => rows(page).first().locator('th').textContent(), serial);
const attributeIs = (page, of, name, value) => comes(`${name} of ${of}`, () => page.getAttribute(of, name), value);
const textIs = (page, of, expected) => comes(`text of ${of}`, () => page.textContent(of), expected);
const valueIs = (page, of, value) => comes(`value of ${of}`, () => page.inputValue(of), value);
const focused = (page, what, read, expected) => comes(`the focused element's ${what}`, () => page.evaluate(read), expected);
const isDrawn = (page, of) => comes(`${of} is drawn`, () => page.locator(of).evaluateAll((canvases) => canvases.length > 0 && canvases.every((canvas) => {
  const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
  return data.some((value) => value !== 0);
})), true);
// Clicks until it is so: a click is lost where a row is drawn anew under it.
const clicked = (of, what, isSo) => until(() => isSo().catch(() => false), what, () => of.click({ timeout: 5e3 }).catch(() => {}));
const dialogs = (page) => page.locator('dialog[open]').count();
const opens = (page, of) => clicked(of, 'a unit is open', async () => (await page.locator('dialog[open] h3').count()) > 0);
const resets = (page) => clicked(page.locator('#reset'), 'all units are shown', async () => (await hits(page)) === kUnits);
const sortsBy = (page, column, order) => clicked(page.locator(`#units th >> text=${column}`), `${column} is ${order}`,
  async () => (await page.getAttribute(`#units th:has-text("${column}")`, 'aria-sort')) === order);
const isOpen = (page) => comes('a unit is open', () => page.locator('dialog[open] h3').count(), (count) => count > 0);

const tests = {
  'opens with every unit, and charts drawn': async (page) => {
    await shows(page, kUnits);
    await attributeIs(page, '#units table', 'aria-rowcount', String(kUnits + 1));
    for (const chart of ['#parameter-chart canvas', '#yield-chart canvas', 'canvas']) await isDrawn(page, chart);
    await textIs(page, '#parameter-caption', /\d units: mean/);
  },

  'sorts by a column, and back': async (page) => {
    await sortsBy(page, 'Runs', 'ascending');
    await sortsBy(page, 'Runs', 'descending');
    await showsFirst(page, kStrange); // Three runs.
    await sortsBy(page, 'Serial number', 'ascending');
  },

  'searches serial numbers, reasons and tags': async (page) => {
    await searches(page, 'u000123', (shown) => shown === 1);
    await searches(page, 'coplanar', (refused) => refused > 1 && refused < 20);
    await searches(page, 'no such unit', (shown) => shown === 0);
    await comes('rows', () => rows(page).count(), 0);
    await resets(page);
  },

  'filters by verdict, station and reason, and keeps that in its address': async (page) => {
    await page.selectOption('#verdict', 'not-good');
    const bad = await shows(page, (count) => count > 0 && count < kUnits / 4);
    await page.selectOption('[data-tag=station]', 'S2');
    const ofStation = await shows(page, (count) => count > 0 && count < bad);
    await page.reload();
    await shows(page, ofStation);
    await valueIs(page, '[data-tag=station]', 'S2');
    await resets(page);
    await clicked(page.locator('#reasons button').first(), 'units with a reason are shown',
      async () => /with limit:accelerometer/.test(await page.textContent('#hits')));
    await resets(page);
  },

  'scrolls to the last unit': async (page) => {
    await page.locator('#units').evaluate((view) => view.scrollTo(0, view.scrollHeight));
    await comes('the last unit is in view', () => page.evaluate((last) => {
      const view = document.getElementById('units').getBoundingClientRect();
      const row = document.querySelector(`#units tr[aria-rowindex="${last}"]`).getBoundingClientRect();
      return row.bottom <= view.bottom + 1 && row.top >= view.top;
    }, kUnits + 1), true);
    await comes('rows', () => rows(page).count(), (count) => count < 100);
    await page.locator('#units').evaluate((view) => view.scrollTo(0, 0));
    await comes('the first unit is there', () => page.locator('#units tr[aria-rowindex="2"]').count(), 1);
  },

  'is used by the keyboard alone': async (page) => {
    const place = () => Number(document.activeElement.dataset.place);
    const words = () => document.activeElement.textContent;
    await page.locator('#units tbody a[tabindex="0"]').first().focus();
    const press = async (key, isThere) => {
      await page.keyboard.press(key);
      return focused(page, `place after ${key}`, place, isThere);
    };
    await press('End', kUnits - 1);
    await press('Home', 0);
    await press('ArrowDown', 1);
    const down = await press('PageDown', (at) => at > 6 && at < 41);
    await press('ArrowUp', down - 1);
    const serial = await page.evaluate(words);
    await page.keyboard.press('Enter');
    await isOpen(page);
    await textIs(page, '#unit-title', serial);
    await page.keyboard.press('Escape');
    await comes('dialogs open', () => page.locator('dialog[open]').count(), 0);
    await focused(page, 'text', words, serial);
  },

  'shows the history of a unit, whatever its serial number': async (page) => {
    await searches(page, 'alert(1)', (shown) => shown === 1);
    await opens(page, page.locator(`#units a >> text="${kStrange}"`));
    await textIs(page, '#unit-title', kStrange);
    for (const words of ['Its 3 runs', 'Parameters', 'accelerometer.bias.x', 'Judged by']) await textIs(page, '#unit-content', (text) => text.includes(words));
    await isDrawn(page, 'dialog canvas');
    const reports = page.locator('#unit-content a:has-text("report")');
    await comes('reports', () => reports.count(), 3);
    await comes('where the first is', () => reports.first().getAttribute('href'), Boolean);
    await clicked(page.locator('#unit-close'), 'no unit is open', async () => (await dialogs(page)) === 0);
    await searches(page, '', (shown) => shown === kUnits);
  },
};

// Light and dark, with a unit open and without, on a wide and a narrow screen.
const looksRight = async (browser, url, base, axe) => {
  for (const colorScheme of ['light', 'dark']) {
    for (const width of [390, 1280]) {
      const page = await open(browser, url, base, { colorScheme, viewport: { width, height: 900 }, bypassCSP: true });
      await isDrawn(page, '#parameter-chart canvas');
      await page.addScriptTag({ path: axe });
      for (const hasUnit of [false, true]) {
        if (hasUnit) {
          await opens(page, page.locator('#units tbody a', { hasText: kStrange })); // Three runs.
          await isDrawn(page, 'dialog[open] canvas');
        }
        await comes(`${width} px: scrolls sideways by`, () => page.evaluate(() => [document.documentElement, document.querySelector('dialog')].map((of) => of.scrollWidth - of.clientWidth)),
          (over) => over.every((pixels) => pixels <= 0));
        await comes(`${colorScheme}, ${width} px`, () => axeFindings(page), '');
      }
      if (process.env.SCREENSHOTS) await page.screenshot({ path: path.join(process.env.SCREENSHOTS, `unit-${colorScheme}-${width}.png`) });
      await page.keyboard.press('Escape');
      if (process.env.SCREENSHOTS) await page.screenshot({ path: path.join(process.env.SCREENSHOTS, `page-${colorScheme}-${width}.png`), fullPage: true });
      await close(page);
    }
  }
};

// Without scripts: how many are good, and why there is no more.
const worksWithoutScripts = async (browser, url, base) => {
  const page = await open(browser, url, base, { javaScriptEnabled: false });
  await textIs(page, '.verdict', /% good/);
  await comes('the page', () => page.innerText('main'), /need scripts/);
  await comes('filters are seen', () => page.isVisible('#filters'), false);
  await close(page);
};

// On paper everything has its name, and charts end where the paper does.
const prints = async (browser, url, base) => {
  const page = await open(browser, url, base);
  await isDrawn(page, '#parameter-chart canvas');
  await page.emulateMedia({ media: 'print' });
  await page.setViewportSize({ width: 710, height: 1000 });
  for (const named of ['#units thead button', '#reasons button', '.controls select']) await comes(`${named} is seen`, () => page.locator(named).first().isVisible(), true);
  await comes('charts beyond the paper', () => page.evaluate(() => [...document.querySelectorAll('canvas')].filter((canvas) => canvas.getBoundingClientRect().right > window.innerWidth + 1).length), 0);
  await close(page);
};

const lotsAreChosen = async (browser, url, base) => {
  const page = await open(browser, url, base);
  await clicked(page.locator('a:text-is("L03")'), 'the units of a lot are shown', async () => (await hits(page)) === 50);
  await valueIs(page, '[data-tag=lot]', 'L03');
  await opens(page, page.locator('#units tbody a').first());
  await close(page);
};

// A unit's own report, which shares its style with the others.
const reportsAreLinked = async (browser, url, base) => {
  const page = await open(browser, `${url}#unit=${encodeURIComponent(kStrange)}`, base);
  await clicked(page.locator('#unit-content a:has-text("report")').first(), 'the report is open',
    async () => /^Calibration of <script>/.test(await page.textContent('h1')));
  await comes('the shared style', () => page.evaluate(() => getComputedStyle(document.querySelector('main')).borderRadius), '6px');
  await comes('buttons', () => page.locator('button', { hasText: 'Copy C and b' }).count(), (count) => count > 0);
  await close(page);
};

withBrowser(async (browser, axe, folder) => {
  makePage(folder, kUnits);
  const server = await serve(folder);
  const places = [[pathToFileURL(`${folder}/page/index.html`).href, pathToFileURL(folder).href], [`${server.url}page/index.html`, server.url]];
  for (const [url, base] of places) {
    const where = url.slice(0, 4);
    const page = await open(browser, url, base);
    for (const [name, test] of Object.entries(tests)) {
      await test(page);
      console.log(`ok ${where}: ${name}`);
    }
    await close(page);
    for (const test of [worksWithoutScripts, prints, lotsAreChosen, reportsAreLinked]) {
      await test(browser, url, base);
      console.log(`ok ${where}: ${test.name}`);
    }
  }
  await looksRight(browser, places[1][0], places[1][1], axe);
  console.log('ok looks');
  server.close();
  assert.ok(fs.existsSync(path.join(folder, 'page/assets/uplot-license.txt')));
}).catch((error) => {
  console.error(error);
  process.exit(1);
});
