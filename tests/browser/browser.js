// SPDX-License-Identifier: Apache-2.0
// What tests of pages share: packages, Chromium, a page that notes what must not happen, a server on loopback.
'use strict';
const assert = require('node:assert/strict');
const { spawnSync } = require('node:child_process');
const fs = require('node:fs');
const http = require('node:http');
const os = require('node:os');
const path = require('node:path');
const { setTimeout: sleep } = require('node:timers/promises');
const { isDeepStrictEqual } = require('node:util');

const kSkipped = 77;
// The one limit of all waits: no test waits for the machine's speed.
const kLimitMs = 600e3;
const skip = (why) => {
  console.log(`skipped: ${why}`);
  process.exit(kSkipped);
};

// The packages of the lock file, brought once into the folder PACKAGES.
const packages = () => {
  if (Number(process.versions.node.split('.')[0]) < 20) skip(`node ${process.versions.node} is older than 20`);
  const folder = process.env.PACKAGES;
  const lock = fs.readFileSync(path.join(__dirname, 'package-lock.json'));
  const stamp = path.join(folder, 'installed.json');
  if (!fs.existsSync(stamp) || !fs.readFileSync(stamp).equals(lock)) {
    fs.mkdirSync(folder, { recursive: true });
    for (const file of ['package.json', 'package-lock.json', '.npmrc']) {
      fs.copyFileSync(path.join(__dirname, file), path.join(folder, file));
    }
    const npm = spawnSync('npm', ['ci', '--loglevel=error', '--prefer-offline', '--fetch-retries=0'], { cwd: folder, encoding: 'utf8' });
    if (npm.error || npm.status !== 0) skip(`npm ci: ${npm.error?.message ?? npm.stderr}`);
    fs.writeFileSync(stamp, lock);
  }
  const of = (name) => require(path.join(folder, 'node_modules', name));
  return { chromium: of('playwright-core').chromium, axe: path.join(folder, 'node_modules/axe-core/axe.min.js') };
};

const chromiumPath = () => {
  for (const name of ['chromium', 'chromium-browser', 'google-chrome']) {
    const found = spawnSync('which', [name], { encoding: 'utf8' });
    if (found.status === 0) return found.stdout.trim();
  }
  return skip('there is no Chromium');
};

// Calls use(browser, axe, folder) with a temporary folder, and cleans up.
const withBrowser = async (use) => {
  const executablePath = chromiumPath();
  const { chromium, axe } = packages();
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'page-'));
  const browser = await chromium.launch({
    executablePath,
    timeout: kLimitMs,
    args: ['--headless', '--no-sandbox', '--disable-gpu', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--disable-quic', '--no-first-run', '--disable-background-networking', '--disable-component-update', '--disable-sync'],
  });
  try {
    return await use(browser, axe, folder);
  } finally {
    await browser.close();
    fs.rmSync(folder, { recursive: true, force: true });
  }
};

const kTypes = { '.html': 'text/html; charset=utf-8', '.js': 'text/javascript', '.css': 'text/css', '.svg': 'image/svg+xml' };
const serve = (folder) =>
  new Promise((take) => {
    const server = http.createServer((request, response) => {
      const file = path.join(folder, decodeURIComponent(new URL(request.url, 'http://x').pathname));
      if (!file.startsWith(folder) || !fs.existsSync(file) || !fs.statSync(file).isFile()) {
        response.writeHead(404).end();
        return;
      }
      response.writeHead(200, { 'content-type': kTypes[path.extname(file)] ?? 'text/plain' });
      fs.createReadStream(file).pipe(response);
    });
    server.listen(0, '127.0.0.1', () => take({ url: `http://127.0.0.1:${server.address().port}/`, close: () => server.close() }));
  });

// A page that notes what must not happen: messages of errors, dialogs, requests outside `base`.
const open = async (browser, url, base, options = {}) => {
  const context = await browser.newContext({ viewport: { width: 1280, height: 900 }, reducedMotion: 'reduce', ...options });
  context.setDefaultTimeout(kLimitMs);
  const page = await context.newPage();
  page.wrong = [];
  page.on('console', (message) => {
    // How fast a canvas is read is advice.
    if (/^(error|warning)$/.test(message.type()) && !/willReadFrequently|GL Driver Message/.test(message.text())) page.wrong.push(message.text());
  });
  page.on('pageerror', (error) => page.wrong.push(String(error)));
  page.on('dialog', (dialog) => {
    page.wrong.push('a dialog of the browser');
    dialog.dismiss();
  });
  page.on('request', (request) => {
    if (!request.url().startsWith(base)) page.wrong.push(`requests ${request.url()}`);
  });
  page.on('requestfailed', (request) => {
    const { errorText } = request.failure();
    // What a reload no longer waits for.
    if (errorText !== 'net::ERR_ABORTED') page.wrong.push(`${request.url()}: ${errorText}`);
  });
  await page.goto(url);
  return page;
};
const close = async (page) => {
  assert.equal(page.wrong.join('\n'), '');
  await page.context().close();
};

// Acts again, each time after twice as long but at most 5 s, until it is so: one event may be lost, as while a page
// draws its first picture.
const until = async (isSo, what, act = () => {}) => {
  const end = Date.now() + kLimitMs;
  for (let pause = 100; ; pause = Math.min(2 * pause, 5e3)) {
    await act();
    for (const next = Date.now() + pause; Date.now() < next; await sleep(50)) {
      if (await isSo()) return;
    }
    assert.ok(Date.now() < end, typeof what === 'function' ? what() : what);
  }
};

// Reads again until it is as expected, and gives it: what a page shows comes when it can. `expected`: a function that
// says whether it is, a pattern, or the same. What cannot be read, as while a page is opened, is not there yet.
const comes = async (what, read, expected) => {
  let seen;
  const isExpected = () => {
    if (typeof expected === 'function') return expected(seen);
    return expected instanceof RegExp ? expected.test(seen) : isDeepStrictEqual(seen, expected);
  };
  await until(async () => {
    try {
      seen = await read();
    } catch (error) {
      seen = String(error);
      return false;
    }
    return isExpected();
  }, () => `${what}: ${JSON.stringify(seen)}`);
  return seen;
};

// What axe finds other in another size or other colours.
const kSeenRules = ['color-contrast', 'scrollable-region-focusable'];
// Findings of axe that are serious, of all rules or of those that are named; it must be in the page.
const axeFindings = async (page, rules = []) => {
  const runOnly = rules.length > 0 ? { runOnly: rules } : {};
  const { violations } = await page.evaluate((options) => window.axe.run(options), { resultTypes: ['violations'], ...runOnly });
  const serious = violations.filter((violation) => ['serious', 'critical'].includes(violation.impact));
  return serious.map((violation) => `${violation.id}: ${violation.nodes[0].html} ${violation.nodes[0].failureSummary}`).join('\n');
};

module.exports = { axeFindings, close, comes, kSeenRules, open, serve, skip, until, withBrowser };
