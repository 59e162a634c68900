// The page of charts in a browser: of a sweep that is run, and of data by hand, whose marks are found where their values put them.
// Usage: node charts_test.mjs --poise PROGRAM --web DIR, where DIR is build/web
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {mkdtempSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {after, before, test} from 'node:test';
import {parseArgs} from 'node:util';
import {launchBrowser, openPage} from './browser.mjs';

const {values: options} = parseArgs({options: {poise: {type: 'string'}, web: {type: 'string'}}});
const folder = mkdtempSync(join(tmpdir(), 'poise-charts-'));
const file = (name) => join(folder, name);
let browser;

const rows = (list) => list.map(([at, outcome, ...values], run) => ({run, at, outcome, told: outcome, values, set: ` --set 'f=${at[0]}'`}));
const data = (title, part) => ({format: 1, title, description: '', text: '', parts: [{name: 'part', command: 'poise run push', ...part}]});
const value = {name: 'error', label: 'error', unit: 'mm'};

/** A push limit that is a circle of `radius` about the centre, at 8 directions, the last one not known. */
const limits = (title, radius) => data(title, {kind: 'limit', variables: [{name: 'direction', unit: '°', angle: true}], values: [{name: 'limit', label: 'largest force', unit: 'N'}],
  maps: [{x: 0, value: 0}], rows: rows([0, 45, 90, 135, 180, 225, 270, 315].map((at) => (at === 315 ? [[at], 'unknown', null] : [[at], 'stands', radius])))});
const line = data('line', {kind: 'sweep', variables: [{name: 'force', unit: 'N'}], values: [value], maps: [{x: 0, value: 0}],
  rows: rows([[[10], 'stands', 1], [[20], 'stands', 2], [[40], 'stands', 4], [[50], 'fell', 1e6]])});
const cells = data('cells', {kind: 'sweep', variables: [{name: 'force', unit: 'N'}, {name: 'law', unit: '', choices: ['paper', 'capture']}], values: [value],
  maps: [{x: 0, y: 1, value: 0}], rows: rows([[[10, 0], 'stands', 1], [[20, 0], 'stands', 3], [[10, 1], 'stands', 2], [[20, 1], 'fell', 1e6]])});

/** The page of these sets, as the program makes it. */
function write(name, ...sets) {
  const template = readFileSync(join(options.web, 'charts.html'), 'utf8');
  writeFileSync(file(name), template.replace('<!--POISE-RUN-DATA-->', () => sets.map((set) => `<script type="application/json" class="poise-charts">${JSON.stringify(set)}</script>`).join('')));
  return file(name);
}

before(async () => {
  // The last of these pushes knocks a robot over that does not balance.
  const sweep = spawnSync(options.poise, ['sweep', 'push_double_support', '--set', 'duration=1.5', '--vary', 'sim.push[0].peak=20,60,2000',
    '--column', 'com_error_max_y', '--column', 'joint_torque_max', '--quiet', '--logs', '--out', file('sweep')], {encoding: 'utf8'});
  assert.equal(sweep.status, 0, sweep.stderr);
  browser = await launchBrowser(options.web);
});

after(async () => {
  await browser?.close();
  rmSync(folder, {recursive: true, force: true});
});

/** Saves chart `i` as `kind`; the file's bytes. */
async function save(page, i, kind) {
  const [download] = await Promise.all([page.waitForEvent('download'), page.locator('.chart').nth(i).getByRole('button', {name: new RegExp(`as ${kind}$`)}).click()]);
  return readFileSync(await download.path());
}

/** Circles of a chart's SVG: {x, y, fill}, px of the chart. */
async function circles(page, i) {
  const svg = (await save(page, i, 'SVG')).toString();
  const zoom = Number(svg.match(/viewBox="0 \S+ (\S+)/)[1]) / Number(svg.match(/ width="([\d.]+)"/)[1]);
  return [...svg.matchAll(/<path d="M(\S+) (\S+?)A(\S+) \S+ 0 \d \d (\S+) (\S+?)A[^"]*Z" fill="(#\w+)"/g)]
    .map(([, x, y, r, , , fill]) => ({x: (Number(x) - Number(r)) / zoom, y: Number(y) / zoom, fill}));
}

const texts = async (page, i) => [...(await save(page, i, 'SVG')).toString().matchAll(/<text[^>]*>([^<]*)</g)].map((m) => m[1]);
const tip = (page) => page.locator('#tip').innerText();

/** Moves to, or clicks, a place of a chart. */
async function go(page, i, {x, y}, click = false) {
  await page.locator('.chart-host').nth(i).scrollIntoViewIfNeeded();
  const box = await page.locator('.chart-host canvas').nth(i).boundingBox();
  await page.mouse[click ? 'click' : 'move'](box.x + x, box.y + y);
}

test('a sweep that was run: the edge of survival comes first, a mark has its values, its page and its command', async () => {
  const {page, problems} = await openPage(browser, file('sweep/charts.html'), {viewport: {width: 1400, height: 900}});
  const text = await page.locator('body').innerText();
  assert.match(text, /2 of 3 runs stand, 1 do(es)? not/);
  assert.match(text, /peak of push\[0\]: stands at 20 to 60 N; does not at 2000 N/);
  assert.doesNotMatch(text, /com_error_max_y|joint_torque_max|\d\.\d{6}/);
  assert.ok(await page.evaluate(() => document.querySelector('.edge').getBoundingClientRect().bottom
    < document.querySelector('.chart').getBoundingClientRect().top));
  const [first] = await circles(page, 1);
  await go(page, 1, {x: first.x + 6, y: first.y + 5});  // from near by, without touching the mark
  assert.match(await tip(page), /run 0\n.*20\n.*stands[\s\S]*: [\d.e-]+ mm/);
  await page.mouse.move(2, 2);
  assert.equal(await page.locator('#tip').isVisible(), false);
  await go(page, 1, first, true);
  await page.mouse.move(2, 2);
  assert.match(await tip(page), /poise run push_double_support --set duration=1\.5 --set 'sim\.push\[0\]\.peak=20'/);
  assert.match(await tip(page), /poise report logs\/0/);
  assert.equal(await page.getByRole('link', {name: 'the run’s page'}).getAttribute('href'), 'logs/0/report.html');
  await page.getByRole('button', {name: 'Copy'}).last().click();
  await page.getByRole('button', {name: /Copied|Selected/}).waitFor();
  assert.match(await page.evaluate(() => getSelection().toString()), /^poise run push_double_support/);
  await page.mouse.click(2, 2);
  assert.equal(await page.locator('#tip').isVisible(), false);
  assert.deepEqual(problems, []);
  await page.context().close();
});

test('marks over a number stand where a straight line puts them, what fell above, and a stretch is zoomed', async () => {
  const {page, problems} = await openPage(browser, write('line.html', line), {viewport: {width: 1400, height: 900}});
  const marks = await circles(page, 0);
  assert.equal(marks.length, 3);
  const [a, b, c] = marks;
  // 10, 20, 40 N with 1, 2, 4 mm.
  assert.ok(Math.abs((c.x - a.x) / (b.x - a.x) - 3) < 0.02, `${a.x} ${b.x} ${c.x}`);
  assert.ok(Math.abs((c.y - a.y) / (b.y - a.y) - 3) < 0.02);
  const fallen = {x: c.x + (b.x - a.x), y: 14};
  await go(page, 0, fallen);
  assert.match(await tip(page), /force \[N\]: 50\nfell\nerror: 1000000 mm/);
  assert.ok((await texts(page, 0)).includes('did not stand'));
  // A box about the second mark leaves it alone in sight; a double click shows all.
  await go(page, 0, {x: b.x - 25, y: b.y - 25});
  await page.mouse.down();
  await go(page, 0, {x: b.x + 25, y: b.y + 25});
  await page.mouse.up();
  assert.equal((await circles(page, 0)).length, 1);
  await page.locator('.u-over').dblclick();
  assert.equal((await circles(page, 0)).length, 3);
  assert.deepEqual(problems, []);
  await page.context().close();
});

test('limits by direction lie on their circle, told by direction and joined by nothing', async () => {
  const {page, problems} = await openPage(browser, write('limits.html', limits('a', 100), limits('b', 80)), {viewport: {width: 400, height: 900}});
  const marks = await circles(page, 0);  // of the first set; the second's are squares
  assert.equal(marks.length, 8);         // and the legend's
  const known = marks.slice(0, 7);
  const center = {x: (known[2].x + known[6].x) / 2, y: (known[0].y + known[4].y) / 2};
  known.forEach(({x, y}, i) => {  // 0 up, counter-clockwise
    const angle = (Math.atan2(center.x - x, center.y - y) / Math.PI * 180 + 360) % 360;
    assert.ok(Math.abs(angle - 45 * i) < 0.5 || Math.abs(angle - 360) < 0.5, `${angle}, ${45 * i}`);
    assert.ok(Math.abs(Math.hypot(x - center.x, y - center.y) / (center.y - known[0].y) - 1) < 0.01);
  });
  await go(page, 0, known[2]);
  assert.match(await tip(page), /^a\nrun 2\ndirection \[°\]: 90\nstands\nlargest force: 100 N$/);
  await go(page, 0, {x: center.x - 0.8 * (center.x - known[2].x), y: center.y});
  assert.match(await tip(page), /^b\n[\s\S]*80 N$/);
  // Every stroke that is no ring begins or ends in the centre, or is a mark's.
  const svg = (await save(page, 0, 'SVG')).toString();
  const zoom = Number(svg.match(/viewBox="0 \S+ (\S+)/)[1]) / Number(svg.match(/ width="([\d.]+)"/)[1]);
  const lines = [...svg.matchAll(/<path d="M(\S+) (\S+?)L([\d.]+) ([\d.]+)" fill="none"/g)].map((m) => m.slice(1, 5).map((v) => v / zoom));
  assert.ok(lines.length >= 8 + 14);
  for (const [x, y] of lines) assert.ok(Math.hypot(x - center.x, y - center.y) < 1, `a line from ${x}, ${y}`);
  assert.deepEqual(problems, []);
  await page.context().close();
});

test('a second file is laid over the first: each cell has both, and goes again', async () => {
  const {page, problems} = await openPage(browser, write('cells.html', cells), {viewport: {width: 1400, height: 900}});
  const over = await page.locator('.u-over').boundingBox(), canvas = await page.locator('.chart-host canvas').boundingBox();
  const at = (share, row) => ({x: over.x - canvas.x + share * over.width, y: over.y - canvas.y + row * over.height});
  await go(page, 0, at(0.1, 0.25));  // paper on top, 10 N to the left
  assert.match(await tip(page), /law: paper\nstands\nerror: 1 mm/);
  await go(page, 0, at(0.9, 0.75));
  assert.match(await tip(page), /law: capture\nfell/);
  const other = structuredClone(cells);
  other.title = 'mine';
  other.parts[0].rows[0].values = [2.5];
  writeFileSync(file('other.json'), JSON.stringify(other));
  await page.locator('input[type=file]').setInputFiles(file('other.json'));
  await page.getByRole('heading', {name: 'mine'}).first().waitFor();
  await page.waitForFunction(() => document.querySelector('.chart-host canvas'));
  await go(page, 0, at(0.1, 0.25));
  assert.match(await tip(page), /^cells\n[\s\S]*error: 1 mm/);
  await go(page, 0, at(0.4, 0.25));
  assert.match(await tip(page), /^mine\n[\s\S]*error: 2.5 mm/);
  await page.getByRole('button', {name: 'Take mine away'}).click();
  await page.waitForFunction(() => document.querySelector('.chart-host canvas'));
  await go(page, 0, at(0.4, 0.25));
  assert.match(await tip(page), /error: 1 mm/);
  // What is no data is said, and the rest stays.
  writeFileSync(file('none.json'), '{"format": 2}');
  await page.locator('input[type=file]').setInputFiles(file('none.json'));
  await page.getByRole('alert').waitFor();
  assert.match(await page.locator('body').innerText(), /none\.json: is no charts\.json of format 1[\s\S]*cells/);
  assert.deepEqual(problems, []);
  await page.context().close();
});

test('PNG and SVG are light, whatever the page is, and the PNG is twice as large', async () => {
  const {page, problems} = await openPage(browser, write('dark.html', cells), {viewport: {width: 400, height: 900}, colorScheme: 'dark'});
  const widths = await page.evaluate(() => [document.documentElement.scrollWidth, document.documentElement.clientWidth]);
  assert.equal(widths[0], widths[1]);
  const brightness = (selector) => page.evaluate((s) => getComputedStyle(document.querySelector(s)).backgroundColor
    .match(/\d+/g).slice(0, 3).reduce((sum, x) => sum + Number(x), 0) / 3, selector);
  assert.ok(await brightness('body') < 60);
  assert.ok(await brightness('.chart') < 60);
  const svg = (await save(page, 0, 'SVG')).toString();
  assert.match(svg, /fill="#ffffff"/);
  assert.match(svg, /#440154[\s\S]*#fde725/);  // viridis' ends
  const png = await save(page, 0, 'PNG');
  assert.deepEqual([...png.subarray(1, 4)], [...'PNG'].map((c) => c.charCodeAt(0)));
  const width = await page.locator('.chart-host canvas').evaluate((c) => c.getBoundingClientRect().width);
  assert.equal(png.readUInt32BE(16), Math.round(2 * width));
  // The plot is dark again.
  const corner = await page.locator('.chart-host canvas').evaluate((c) => [...c.getContext('2d').getImageData(1, 1, 1, 1).data]);
  assert.equal(corner[3], 0);
  assert.deepEqual(problems, []);
  await page.context().close();
});
