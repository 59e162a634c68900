// The page of a sweep's maps in a browser.
// Usage: node maps_test.mjs --poise PROGRAM --web DIR, where DIR is build/web
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {mkdtempSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {after, before, test} from 'node:test';
import {pathToFileURL} from 'node:url';
import {parseArgs} from 'node:util';
import {launchBrowser} from './browser.mjs';

const {values: options} = parseArgs({options: {poise: {type: 'string'}, web: {type: 'string'}}});
const folder = mkdtempSync(join(tmpdir(), 'poise-maps-'));
let browser;

before(async () => {
  // The last of these pushes knocks a robot over that does not balance.
  const sweep = spawnSync(options.poise, ['sweep', 'push_double_support', '--set', 'duration=1.5', '--vary', 'sim.push[0].peak=20,60,2000',
    '--column', 'com_error_max_y', '--column', 'joint_torque_max', '--quiet', '--out', join(folder, 'sweep')], {encoding: 'utf8'});
  assert.equal(sweep.status, 0, sweep.stderr);
  browser = await launchBrowser(options.web);
});

after(async () => {
  await browser?.close();
  rmSync(folder, {recursive: true, force: true});
});

async function open(width, colorScheme = 'light') {
  const page = await (await browser.newContext({viewport: {width, height: 900}, colorScheme})).newPage();
  const problems = [];
  page.on('pageerror', (error) => problems.push(String(error)));
  page.on('console', (message) => { if (message.type() === 'error') problems.push(message.text()); });
  await page.goto(pathToFileURL(join(folder, 'sweep/maps.html')).href);
  return {page, problems};
}

test('the edge of survival comes first, the marks tell their values, and no texts overlap', async () => {
  const {page, problems} = await open(1400);
  const text = await page.locator('body').innerText();
  assert.match(text, /2 of 3 runs stand, 1 do(es)? not/);
  assert.match(text, /peak of push\[0\]: stands at 20 to 60 N; does not at 2000 N/);
  assert.ok(await page.evaluate(() => document.querySelector('.edge').getBoundingClientRect().bottom
    < document.querySelector('svg').getBoundingClientRect().top));
  assert.ok(await page.evaluate(() => document.documentElement.scrollHeight) < 2500);
  assert.doesNotMatch(text, /com_error_max_y|joint_torque_max|\d\.\d{6}/);
  await page.evaluate(() => document.querySelectorAll('details').forEach((d) => { d.open = true; }));
  // From near by, without touching the mark.
  for (const [mark, value] of [['details circle', /run 0\n.*20\n.*stands[\s\S]*: [\d.]+ mm/], ['details path.f[data-tip]', /run 2\n.*2000\nfell at [\d.]+ s/]]) {
    await page.locator(mark).first().scrollIntoViewIfNeeded();
    const box = await page.locator(mark).first().boundingBox();
    await page.mouse.move(box.x + box.width / 2 + 6, box.y + box.height / 2 + 5);
    assert.match(await page.locator('#tip').innerText(), value);
    await page.mouse.move(2, 2);
    assert.equal(await page.locator('#tip').isVisible(), false);
  }
  // A click keeps it, with the command that makes the run again, until the next one elsewhere.
  const mark = await page.locator('details circle').first().boundingBox();
  await page.mouse.click(mark.x + mark.width / 2, mark.y + mark.height / 2);
  await page.mouse.move(2, 2);
  assert.match(await page.locator('#tip').innerText(), /poise run push_double_support --set duration=1\.5 --set 'sim\.push\[0\]\.peak=20'/);
  await page.mouse.click(2, 2);
  assert.equal(await page.locator('#tip').isVisible(), false);
  const overlaps = await page.evaluate(() => [...document.querySelectorAll('svg')].flatMap((svg) => {
    const texts = [...svg.querySelectorAll('text')].map((t) => [t.textContent, t.getBoundingClientRect()]);
    const frame = svg.getBoundingClientRect();
    const found = texts.filter(([, b]) => b.left < frame.left || b.right > frame.right).map(([t]) => `${t} is cut off`);
    texts.forEach(([t, a], i) => texts.slice(i + 1).forEach(([u, b]) => {
      if (a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 3 && b.top < a.bottom - 3) found.push(`${t} / ${u}`);
    }));
    return found;
  }));
  assert.deepEqual(overlaps, []);
  assert.deepEqual(problems, []);
  await page.context().close();
});

test('a phone needs no second direction, and the dark is dark', async () => {
  const {page, problems} = await open(400, 'dark');
  const widths = await page.evaluate(() => [document.documentElement.scrollWidth, document.documentElement.clientWidth]);
  assert.equal(widths[0], widths[1]);
  const brightness = (property, selector) => page.evaluate(([p, s]) => getComputedStyle(document.querySelector(s))[p]
    .match(/\d+/g).slice(0, 3).reduce((sum, x) => sum + Number(x), 0) / 3, [property, selector]);
  assert.ok(await brightness('backgroundColor', 'body') < 60);
  assert.ok(await brightness('backgroundColor', 'svg') < 60);
  assert.ok(await brightness('fill', 'svg text') > 180);
  assert.deepEqual(problems, []);
  await page.context().close();
});
