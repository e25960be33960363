// Opens pages in a headless Chromium, turns the view by keyboard, and fails on an error, a request or a text of too little
// contrast. With --shots DIR also takes pictures: light, dark, narrow, without scripts, and a PDF of A4.
//
//   npm ci && node check.mjs [--shots DIR] PAGE.html ...
//
// Needs a Chromium; CHROMIUM says where it is if not /usr/bin/chromium.

import { existsSync, mkdirSync, statSync } from 'node:fs';
import { basename, join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { chromium } from 'playwright-core';

const given = process.argv.slice(2);
const at = given.indexOf('--shots');
const shots = at < 0 ? null : given.splice(at, 2)[1];
if (given.length === 0) {
  console.error('usage: node check.mjs [--shots DIR] PAGE.html ...');
  process.exit(2);
}
if (shots) mkdirSync(shots, { recursive: true });

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM || '/usr/bin/chromium',
  args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--disable-quic',
    '--no-first-run', '--disable-background-networking', '--disable-component-update', '--disable-sync'],
});
const faults = [];

/** A page with what it asks for and complains of. */
async function open(file, options = {}) {
  const context = await browser.newContext({ viewport: { width: 1180, height: 900 }, ...options });
  const page = await context.newPage();
  const fault = (text) => faults.push(`${basename(file)}: ${text}`);
  page.on('console', (message) => {
    if (message.type() === 'error') fault(`console: ${message.text()}`);
  });
  page.on('pageerror', (error) => fault(`script: ${error.message}`));
  page.on('request', (request) => {
    const address = request.url();
    if (!address.startsWith('file:') && !address.startsWith('data:')) fault(`asks for ${address}`);
  });
  await page.goto(pathToFileURL(resolve(file)).href);
  await page.waitForTimeout(400);
  return { page, context, fault };
}

/** Texts whose contrast with what is behind them is below WCAG's AA. */
const poorContrast = () => {
  const numbers = (color) => (color.match(/[\d.]+/g) || []).map(Number);
  const light = ([r, g, b]) => {
    const [x, y, z] = [r, g, b].map((v) => (v / 255 <= 0.04045 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4));
    return 0.2126 * x + 0.7152 * y + 0.0722 * z;
  };
  const behind = (element) => {
    for (let e = element; e; e = e.parentElement) {
      const color = numbers(getComputedStyle(e).backgroundColor);
      if (color.length === 3 || color[3] === 1) return color;
    }
    return [255, 255, 255];
  };
  const poor = new Set();
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const element = walker.currentNode.parentElement;
    if (!walker.currentNode.textContent.trim() || element.closest('script,style,.unseen,.skip,.still')) continue;
    const style = getComputedStyle(element);
    const drawn = element.closest('svg') !== null;
    const [a, b] = [light(numbers(drawn ? style.fill : style.color)), light(behind(element))];
    const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    const large = parseFloat(style.fontSize) >= 24 || (parseFloat(style.fontSize) >= 18.6 && Number(style.fontWeight) >= 700);
    if (ratio < (large ? 3 : 4.5)) poor.add(`${ratio.toFixed(2)}: ${walker.currentNode.textContent.trim().slice(0, 40)}`);
  }
  return [...poor].slice(0, 8);
};

async function turned(page, fault) {
  const canvas = page.locator('.view3d canvas');
  if ((await canvas.count()) === 0) return 'no view that turns';
  if ((await page.locator('.view3d.live').count()) === 0) {
    fault('the view that turns does not start');
    return 'still';
  }
  const said = () => page.locator('.view3d [data-said]').textContent();
  // a frame drawn without a graphics card takes its time
  const other = async (before) => {
    const changed = (text) => document.querySelector('.view3d [data-said]').textContent !== text;
    await page.waitForFunction(changed, before, { timeout: 10000 }).catch(() => {});
    return said();
  };
  await canvas.focus();
  const seen = [await other('')];
  for (const key of ['ArrowLeft', 'ArrowUp', 'Home']) {
    await page.keyboard.press(key);
    seen.push(await other(seen[seen.length - 1]));
  }
  if (seen[0] === seen[1] || seen[1] === seen[2]) fault(`keys do not turn the view: ${seen.join('; ')}`);
  if (seen[3] !== seen[0]) fault(`Home does not reset the view: ${seen[0]}; ${seen[3]}`);
  const box = await canvas.boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.mouse.down();
  await page.mouse.move(box.x + box.width / 2 + 90, box.y + box.height / 2, { steps: 4 });
  await page.mouse.up();
  if ((await other(seen[3])) === seen[3]) fault('dragging does not turn the view');
  await page.keyboard.press('Home');
  await page.waitForTimeout(300);
  return seen.slice(0, 3).join(' | ');
}

async function sorted(page, fault) {
  const buttons = page.locator('table[data-sort] th button');
  if ((await buttons.count()) === 0) return;
  const first = () => page.locator('table[data-sort] tbody tr th').first().textContent();
  await buttons.first().click();
  const up = await first();
  await buttons.first().click();
  const rows = await page.locator('table[data-sort] tbody tr').count();
  if (rows > 1 && (await first()) === up) fault('the table does not sort');
}

for (const file of given) {
  if (!existsSync(file)) {
    faults.push(`${file}: is not there`);
    continue;
  }
  const name = basename(file).replace(/\.html$/, '');
  const { page, context, fault } = await open(file);
  const said = await turned(page, fault);
  await sorted(page, fault);
  const wide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
  if (wide > 0) fault(`wider than the window by ${wide} px`);
  for (const colorScheme of ['light', 'dark']) {
    await page.emulateMedia({ colorScheme });
    await page.waitForTimeout(200);
    for (const poor of await page.evaluate(poorContrast)) fault(`${colorScheme}, contrast ${poor}`);
    if (shots) await page.screenshot({ path: join(shots, `${name}-${colorScheme}.png`), fullPage: true });
  }
  await page.emulateMedia({ colorScheme: 'light' });
  if (shots) await page.pdf({ path: join(shots, `${name}.pdf`), preferCSSPageSize: true, printBackground: true });
  await context.close();
  const narrow = await open(file, { viewport: { width: 390, height: 844 }, deviceScaleFactor: 1, isMobile: true, hasTouch: true });
  const over = await narrow.page.evaluate(() => document.documentElement.scrollWidth - 390);
  if (over > 0) narrow.fault(`on a phone wider than the window by ${over} px`);
  if (shots) await narrow.page.screenshot({ path: join(shots, `${name}-phone.png`), fullPage: true });
  await narrow.context.close();
  const plain = await open(file, { javaScriptEnabled: false });
  if (shots) await plain.page.screenshot({ path: join(shots, `${name}-plain.png`), fullPage: true });
  await plain.context.close();
  console.log(`${file}: ${statSync(file).size} bytes; ${said}`);
}
await browser.close();
faults.forEach((fault) => console.error(fault));
process.exit(faults.length > 0 ? 1 : 0);
