// How long a page takes until it shows something, and what memory the browser takes for it. No test: a figure of this machine.
// Usage: node first_picture.mjs --web DIR PAGE..., where DIR is build/web
import {statSync} from 'node:fs';
import {resolve} from 'node:path';
import {parseArgs} from 'node:util';
import {pathToFileURL} from 'node:url';
import {PATIENCE, launchBrowser} from './browser.mjs';

const {values: {web}, positionals} = parseArgs({options: {web: {type: 'string'}}, allowPositionals: true});
const browser = await launchBrowser(web);
for (const file of positionals) {
  const page = await browser.newPage({viewport: {width: 1100, height: 800}});
  page.setDefaultTimeout(PATIENCE);
  const start = performance.now();
  await page.goto(pathToFileURL(resolve(file)).href, {waitUntil: 'commit'});
  await page.waitForFunction(() => document.documentElement.dataset.picture);
  const picture = performance.now() - start;
  await page.waitForFunction(() => document.documentElement.dataset.ready);
  await page.evaluate(() => document.querySelector('.plot-host').scrollIntoView());
  await page.waitForFunction(() => document.querySelector('.plot-host canvas'));
  const plot = performance.now() - start;
  const heap = await page.evaluate(() => performance.memory?.usedJSHeapSize ?? 0);
  console.log(`${file}: ${(statSync(file).size / 1e6).toFixed(1)} MB; robot after ${(picture / 1e3).toFixed(1)} s, `
    + `first plot after ${(plot / 1e3).toFixed(1)} s; heap ${(heap / 1e6).toFixed(0)} MB`);
  await page.close();
}
await browser.close();
