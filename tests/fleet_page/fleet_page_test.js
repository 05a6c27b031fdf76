// SPDX-License-Identifier: Apache-2.0
// The page of `fleet report` in headless Chromium, from the disk and from a server on loopback.
'use strict';
const assert = require('node:assert/strict');
const fs = require('node:fs');
const path = require('node:path');
const { pathToFileURL } = require('node:url');
const { axeFindings, close, open, serve, withBrowser } = require('../browser/browser.js');
const { makePage } = require('./make_page.js');

const kUnits = 600;
const kStrange = '<script>alert(1)</script>';

const hits = async (page) => Number((await page.textContent('#hits')).replace(/ of .*/, '').replace(/\D/g, ''));
const rows = (page) => page.locator('#units tbody:not(.space) tr');
const first = async (page) => (await rows(page).first().locator('th').textContent());

const tests = {
  'opens with every unit, and charts drawn': async (page) => {
    assert.equal(await hits(page), kUnits);
    assert.equal(await page.getAttribute('#units table', 'aria-rowcount'), String(kUnits + 1));
    await page.waitForSelector('#parameter-chart canvas');
    await page.waitForSelector('#yield-chart canvas');
    await page.waitForFunction(() => [...document.querySelectorAll('canvas')].every((canvas) => {
      const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
      return data.some((value) => value !== 0);
    }));
    assert.match(await page.textContent('#parameter-caption'), /\d units: mean/);
  },

  'sorts by a column, and back': async (page) => {
    await page.click('#units th >> text=Runs');
    await page.click('#units th >> text=Runs');
    assert.equal(await page.getAttribute('#units th:has-text("Runs")', 'aria-sort'), 'descending');
    assert.equal(await first(page), kStrange); // Three runs.
    await page.click('#units th >> text=Serial number');
    assert.equal(await page.getAttribute('#units th:has-text("Serial number")', 'aria-sort'), 'ascending');
  },

  'searches serial numbers, reasons and tags': async (page) => {
    await page.fill('#search', 'u000123');
    assert.equal(await hits(page), 1);
    await page.fill('#search', 'coplanar');
    const refused = await hits(page);
    assert.ok(refused > 0 && refused < 20);
    await page.fill('#search', 'no such unit');
    assert.equal(await hits(page), 0);
    assert.equal(await rows(page).count(), 0);
    await page.click('#reset');
    assert.equal(await hits(page), kUnits);
  },

  'filters by verdict, station and reason, and keeps that in its address': async (page) => {
    await page.selectOption('#verdict', 'not-good');
    const bad = await hits(page);
    assert.ok(bad > 0 && bad < kUnits / 4);
    await page.selectOption('[data-tag=station]', 'S2');
    const ofStation = await hits(page);
    assert.ok(ofStation > 0 && ofStation < bad);
    await page.reload();
    assert.equal(await hits(page), ofStation);
    assert.equal(await page.inputValue('[data-tag=station]'), 'S2');
    await page.click('#reset');
    await page.locator('#reasons button').first().click();
    assert.match(await page.textContent('#hits'), /with limit:accelerometer/);
    await page.click('#reset');
  },

  'scrolls to the last unit': async (page) => {
    await page.locator('#units').evaluate((view) => view.scrollTo(0, view.scrollHeight));
    await page.waitForSelector(`#units tr[aria-rowindex="${kUnits + 1}"]`);
    assert.ok((await rows(page).count()) < 100);
    const isInView = await page.evaluate((last) => {
      const view = document.getElementById('units').getBoundingClientRect();
      const row = document.querySelector(`#units tr[aria-rowindex="${last}"]`).getBoundingClientRect();
      return row.bottom <= view.bottom + 1 && row.top >= view.top;
    }, kUnits + 1);
    assert.ok(isInView);
    await page.locator('#units').evaluate((view) => view.scrollTo(0, 0));
  },

  'is used by the keyboard alone': async (page) => {
    await page.locator('#units tbody a[tabindex="0"]').first().focus();
    for (const key of ['End', 'Home', 'ArrowDown', 'PageDown', 'ArrowUp']) await page.keyboard.press(key);
    const place = Number(await page.evaluate(() => document.activeElement.dataset.place));
    assert.ok(place > 5 && place < 40, String(place));
    const serial = await page.evaluate(() => document.activeElement.textContent);
    await page.keyboard.press('Enter');
    await page.waitForSelector('dialog[open] h3');
    assert.equal(await page.textContent('#unit-title'), serial);
    await page.keyboard.press('Escape');
    await page.waitForSelector('dialog:not([open])', { state: 'attached' });
    assert.equal(await page.evaluate(() => document.activeElement.textContent), serial);
  },

  'shows the history of a unit, whatever its serial number': async (page) => {
    await page.fill('#search', 'alert(1)');
    await page.click(`#units a >> text="${kStrange}"`);
    await page.waitForSelector('dialog[open] h3');
    assert.equal(await page.textContent('#unit-title'), kStrange);
    const text = await page.textContent('#unit-content');
    for (const words of ['Its 3 runs', 'Parameters', 'accelerometer.bias.x', 'Judged by']) assert.ok(text.includes(words), words);
    await page.waitForSelector('dialog canvas');
    const reports = page.locator('#unit-content a:has-text("report")');
    assert.equal(await reports.count(), 3);
    assert.ok(await reports.first().getAttribute('href'));
    await page.click('#unit-close');
    await page.fill('#search', '');
  },
};

// Light and dark, with a unit open and without, on a wide and a narrow screen.
const looksRight = async (browser, url, base, axe) => {
  for (const colorScheme of ['light', 'dark']) {
    for (const width of [390, 1280]) {
      const page = await open(browser, url, base, { colorScheme, viewport: { width, height: 900 }, bypassCSP: true });
      await page.waitForSelector('#parameter-chart canvas');
      await page.addScriptTag({ path: axe });
      for (const isOpen of [false, true]) {
        if (isOpen) {
          await page.locator('#units tbody a', { hasText: kStrange }).click(); // Three runs.
          await page.waitForSelector('dialog[open] canvas');
        }
        const over = await page.evaluate(() => [document.documentElement, document.querySelector('dialog')].map((of) => of.scrollWidth - of.clientWidth));
        assert.deepEqual(over.map((pixels) => pixels > 0), [false, false], `${width} px: scrolls sideways by ${over}`);
        assert.equal(await axeFindings(page), '', `${colorScheme}, ${width} px`);
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
  assert.match(await page.textContent('.verdict'), /% good/);
  assert.match(await page.innerText('main'), /need scripts/);
  assert.ok(!(await page.isVisible('#filters')));
  await close(page);
};

// On paper everything has its name, and charts end where the paper does.
const prints = async (browser, url, base) => {
  const page = await open(browser, url, base);
  await page.waitForSelector('#parameter-chart canvas');
  await page.emulateMedia({ media: 'print' });
  await page.setViewportSize({ width: 710, height: 1000 });
  for (const named of ['#units thead button', '#reasons button', '.controls select']) assert.ok(await page.locator(named).first().isVisible(), named);
  const beyond = await page.evaluate(() => [...document.querySelectorAll('canvas')].filter((canvas) => canvas.getBoundingClientRect().right > window.innerWidth + 1).length);
  assert.equal(beyond, 0, 'charts beyond the paper');
  await close(page);
};

const lotsAreChosen = async (browser, url, base) => {
  const page = await open(browser, url, base);
  await page.click('a:text-is("L03")');
  await page.waitForFunction(() => /^50 of/.test(document.getElementById('hits').textContent));
  assert.equal(await page.inputValue('[data-tag=lot]'), 'L03');
  await page.locator('#units tbody a').first().click();
  await page.waitForSelector('dialog[open] h3');
  await close(page);
};

// A unit's own report, which shares its style with the others.
const reportsAreLinked = async (browser, url, base) => {
  const page = await open(browser, `${url}#unit=${encodeURIComponent(kStrange)}`, base);
  await page.locator('#unit-content a:has-text("report")').first().click();
  await page.waitForSelector('h1');
  assert.match(await page.textContent('h1'), /^Calibration of <script>/);
  assert.equal(await page.evaluate(() => getComputedStyle(document.querySelector('main')).borderRadius), '6px');
  assert.ok((await page.locator('button', { hasText: 'Copy C and b' }).count()) > 0);
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
