// What a run's page costs: writing it, its size, the time to its first picture, frames per second while it plays.
// RUN may be a page that is there already.
// Usage: node tests/benchmarks/report_benchmark.mjs RUN [--poise PROGRAM] [--web DIR] [--repeat N]
import {spawnSync} from 'node:child_process';
import {mkdtempSync, rmSync, statSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {fileURLToPath} from 'node:url';
import {parseArgs} from 'node:util';
import {launchBrowser, openPage} from '../web/browser.mjs';

const root = fileURLToPath(new URL('../../', import.meta.url));
const USAGE = 'node tests/benchmarks/report_benchmark.mjs RUN [--poise PROGRAM] [--web DIR] [--repeat N]';
const PLAY = 4;  // s of wall time

let parsed;
try {
  parsed = parseArgs({allowPositionals: true, options: {
    poise: {type: 'string', default: join(root, 'build/release/bin/poise')}, web: {type: 'string', default: join(root, 'build/web')},
    repeat: {type: 'string', default: '3'}, help: {type: 'boolean', short: 'h'}}});
} catch (error) {
  console.error(`${error.message}\nUsage: ${USAGE}`);
  process.exit(2);
}
const {values: options, positionals: [run, ...rest]} = parsed;
const repeat = Number(options.repeat);
if (options.help || !run || rest.length > 0 || !(repeat >= 1)) {
  console.error(`Usage: ${USAGE}`);
  process.exit(options.help ? 0 : 2);
}

const median = (values) => values.sort((a, b) => a - b)[Math.floor(values.length / 2)];
const folder = mkdtempSync(join(tmpdir(), 'poise-report-benchmark-'));
const there = run.endsWith('.html');
const html = there ? run : join(folder, 'report.html');

function write() {
  const start = performance.now();
  const {status, stderr} = spawnSync(options.poise, ['report', run, '--html', html], {encoding: 'utf8'});
  if (status !== 0 && status !== 1) throw new Error(stderr);  // 1: a check of the run fails
  return (performance.now() - start) / 1000;
}

/** s of processor time that the page's main thread took so far: what a busy machine does not change. */
async function processorTime(session) {
  const {metrics} = await session.send('Performance.getMetrics');
  return metrics.find((m) => m.name === 'TaskDuration').value;
}

/** Frames drawn while the run plays from its start, per second of wall time. */
const playFor = (page, seconds) => page.evaluate((duration) => new Promise((done) => {
  const {player} = window.poise;
  player.seek(0);
  player.setSpeed(player.run.duration > duration ? 1 : 0.5);
  player.play();
  const start = performance.now();
  let frames = 0;
  const count = (now) => {
    ++frames;
    if (now - start < 1000 * duration && player.playing) return requestAnimationFrame(count);
    player.pause();
    done({frames, time: (now - start) / 1000});
  };
  requestAnimationFrame(count);
}), seconds);

async function play(page, session) {
  const before = await processorTime(session);
  const {frames, time} = await playFor(page, PLAY);
  return {rate: frames / time, cost: (await processorTime(session) - before) / frames};
}

let browser;
try {
  const written = there ? [] : Array.from({length: repeat}, write);
  browser = await launchBrowser(options.web);
  const pictures = [], ready = [], plots = [], opening = [], rates = {'at the robot': [], 'at the plots': []};
  let ticks = 0, rows = 0;
  for (let i = 0; i < repeat; ++i) {
    const {page, problems} = await openPage(browser, html, {viewport: {width: 1440, height: 1000}, deviceScaleFactor: 1});
    if (problems.length) throw new Error(problems.join('\n'));
    const session = await page.context().newCDPSession(page);
    await session.send('Performance.enable', {timeDomain: 'threadTicks'});
    await page.reload();
    await page.waitForFunction(() => document.documentElement.dataset.ready);
    opening.push(await processorTime(session));
    await page.locator('.plot-host').first().evaluate((e) => e.scrollIntoView());
    await page.waitForSelector('.plot-host canvas');
    plots.push(await page.evaluate(() => performance.now()) / 1000);
    const marks = await page.evaluate(() => ({picture: Number(document.documentElement.dataset.picture),
      ready: Number(document.documentElement.dataset.ready), ticks: window.poise.run.meta.run.ticks, rows: window.poise.run.numRows}));
    pictures.push(marks.picture / 1000);
    ready.push(marks.ready / 1000);
    ({ticks, rows} = marks);
    rates['at the robot'].push(await play(page, session));
    await page.locator('#figures').evaluate((e) => e.scrollIntoView());
    await page.waitForTimeout(500);
    rates['at the plots'].push(await play(page, session));
    await page.context().close();
  }
  console.log(`ticks                           ${ticks}`);
  console.log(`rows in the page                ${rows}`);
  console.log(`file                            ${(statSync(html).size / 1e6).toFixed(2)} MB`);
  if (!there) console.log(`written, table included         ${median(written).toFixed(2)} s`);
  console.log(`first picture of the robot      ${median(pictures).toFixed(2)} s from opening`);
  console.log(`first plot                      ${median(plots).toFixed(2)} s from opening`);
  console.log(`page complete                   ${median(ready).toFixed(2)} s from opening`);
  console.log(`main thread until then          ${median(opening).toFixed(2)} s of processor time`);
  for (const [where, values] of Object.entries(rates)) {
    console.log(`playing, ${where.padEnd(22)} ${median(values.map((v) => v.rate)).toFixed(0)} frames per second, ` +
      `${(1000 * median(values.map((v) => v.cost))).toFixed(1)} ms of the main thread's processor time each`);
  }
} finally {
  await browser?.close();
  rmSync(folder, {recursive: true, force: true});
}
