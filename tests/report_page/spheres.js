// SPDX-License-Identifier: Apache-2.0
// The spheres of a report that turn, drawn by software.
'use strict';
const assert = require('node:assert/strict');
const fs = require('node:fs');
const path = require('node:path');
const { pathToFileURL } = require('node:url');
const { axeFindings, close, comes, open, until } = require('../browser/browser.js');

const kMostBytes = 2.5e6;

const allDrawn = (page, count) => comes('spheres drawn', () => page.locator('.sphere.drawn').count(), count);

// How many pixels of a picture are as blue, and as orange, as nothing but a reading is.
const coloured = async (page, picture) => {
  const blank = await page.context().newPage();
  const counts = await blank.evaluate(async (data) => {
    const image = new Image();
    image.src = data;
    await image.decode();
    const canvas = new OffscreenCanvas(image.width, image.height).getContext('2d');
    canvas.drawImage(image, 0, 0);
    const { data: values } = canvas.getImageData(0, 0, image.width, image.height);
    const counts = { blue: 0, orange: 0 };
    for (let i = 0; i < values.length; i += 4) {
      if (values[i + 2] > values[i] + 100) ++counts.blue;
      if (values[i] > values[i + 2] + 100) ++counts.orange;
    }
    return counts;
  }, `data:image/png;base64,${picture.toString('base64')}`);
  await blank.close();
  return counts;
};

// Where the first corrected reading is on the screen, by the cameras of the scene.
const placeOfReading = (page, at) => page.evaluate((index) => {
  const place = document.querySelectorAll('.turning')[index];
  const scene = place._fullLayout.scene._scene;
  const { model, view, projection } = scene.glplot.cameraParams;
  const times = (m, v) => [0, 1, 2, 3].map((row) => v.reduce((sum, value, column) => sum + m[4 * column + row] * value, 0));
  const trace = place.data.find(({ name }) => name === 'corrected');
  const point = [trace.x[0], trace.y[0], trace.z[0]].map((value, axis) => value * scene.dataScale[axis]);
  const [x, y, , w] = times(projection, times(view, times(model, [...point, 1])));
  const box = scene.container.getBoundingClientRect();
  return { x: box.left + (0.5 + (0.5 * x) / w) * box.width, y: box.top + (0.5 - (0.5 * y) / w) * box.height };
}, at);

const eye = (page, at) => page.evaluate((index) => document.querySelectorAll('.turning')[index]._fullLayout.scene._scene.getCamera().eye, at);

const turns = async (page, report, at) => {
  const place = page.locator('.turning').nth(at);
  await place.scrollIntoViewIfNeeded();
  await until(async () => {
    const { blue, orange } = await coloured(page, await place.screenshot());
    return blue > 50 && orange > 50;
  }, `${report.name}: more than 50 pixels of each colour`);
  await page.evaluate((index) => document.querySelectorAll('.turning')[index].on('plotly_hover', ({ points }) => { window.hovered = points[0].text; }), at);
  const hover = async () => {
    const point = await placeOfReading(page, at);
    await page.mouse.move(point.x - 3, point.y - 3);
    await page.mouse.move(point.x, point.y, { steps: 3 });
  };
  await until(() => page.evaluate(() => window.hovered), `${report.name}: says a reading`, hover);
  assert.match(await page.evaluate(() => { const { hovered } = window; window.hovered = null; return hovered; }), /^pose \d+, (raw|corrected).*: error [\d.e+-]+ (mg|µT)$/);
  const turnsBy = async (what, act) => {
    let before = '';
    await until(async () => {
      const last = before;
      before = JSON.stringify(await eye(page, at));
      return before === last;
    }, `${report.name}: comes to rest`);
    await until(async () => JSON.stringify(await eye(page, at)) !== before, `${report.name}: turns by ${what}`, act);
  };
  const box = await place.boundingBox();
  await turnsBy('the mouse', async () => {
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    await page.mouse.down();
    await page.mouse.move(box.x + box.width / 2 + 120, box.y + box.height / 2 + 30, { steps: 6 });
    await page.mouse.up();
  });
  await place.focus();
  await turnsBy('a key', () => page.keyboard.press('ArrowLeft'));
};

const spheresTurn = async (browser, report, axe) => {
  const file = path.join(report.folder, 'turning.html');
  const url = pathToFileURL(file).href;
  if (!fs.readFileSync(file, 'utf8').includes('plotly.js (gl3d')) {
    console.log('  not looked at: what turns, which the program was built without');
    return;
  }
  assert.ok(fs.statSync(file).size <= kMostBytes, report.name);
  const page = await open(browser, url, url);
  await allDrawn(page, report.spheres);
  for (let at = 0; at < report.spheres; ++at) await turns(page, report, at);
  await page.emulateMedia({ media: 'print' });
  await comes('on paper', () => page.evaluate(() => [...document.querySelectorAll('.turning')].filter(({ offsetHeight }) => offsetHeight > 0).length), 0);
  // A4 between its margins: drawings made for the screen beside the spheres must not push others off it.
  await page.setViewportSize({ width: 710, height: 1000 });
  await comes(`${report.name}: drawings beyond the paper`, () => page.evaluate(() => [...document.querySelectorAll('figure svg')].filter((svg) => svg.getBoundingClientRect().right > window.innerWidth + 1).length), 0);
  await close(page);
  const narrow = await open(browser, url, url, { colorScheme: 'dark', viewport: { width: 390, height: 900 }, bypassCSP: true });
  await allDrawn(narrow, report.spheres);
  if (process.env.SCREENSHOTS) await narrow.locator('.sphere').first().screenshot({ path: path.join(process.env.SCREENSHOTS, `${report.name}-sphere.png`) });
  await comes(`${report.name}: scrolls sideways by`, () => narrow.evaluate(() => document.documentElement.scrollWidth - window.innerWidth), 0);
  await narrow.addScriptTag({ path: axe });
  await comes(report.name, () => axeFindings(narrow), '');
  await close(narrow);
};

module.exports = { spheresTurn };
