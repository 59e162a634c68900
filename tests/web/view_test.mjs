// `poise view` of runs in progress, in a browser.
// Usage: node view_test.mjs --poise PROGRAM --web DIR, where DIR is build/web
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {mkdtempSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {after, afterEach, before, test} from 'node:test';
import {parseArgs} from 'node:util';
import {launchBrowser, openPage, PATIENCE} from './browser.mjs';
import {endTest, startRun, startView} from './live_run.mjs';

const {values: options} = parseArgs({options: {poise: {type: 'string'}, web: {type: 'string'}}});
const folder = mkdtempSync(join(tmpdir(), 'poise-view-'));
const path = (name) => join(folder, name);
let browser;

before(async () => { browser = await launchBrowser(options.web); });
afterEach(() => endTest(browser));
after(async () => {
  await browser?.close();
  rmSync(folder, {recursive: true, force: true});
});

async function start(name, parameters, viewParameters = []) {
  const run = startRun(options.poise, path(name), ...parameters);
  const view = await startView(options.poise, run, path(name), ...viewParameters);
  return {run, view};
}

const until = (page, condition, argument) => page.waitForFunction(condition, argument, {timeout: PATIENCE});
const end = (page) => page.evaluate(() => window.poise.run.firstTick + window.poise.run.numRows);
const more = async (page, ticks = 20) => until(page, (n) => window.poise.run.firstTick + window.poise.run.numRows > n,
  await end(page) + ticks);

test('a page follows a run in progress, looks back while it goes on, and has all of it in the end', async () => {
  const {run, view} = await start('live', ['--realtime', '--duration', '600'], ['--keep', '20']);  // more than it takes, but on a busy machine
  const {page, problems} = await openPage(browser, view.url);
  await until(page, () => /live|behind/.test(document.getElementById('live').innerText));
  await more(page);

  // Plots and picture stand at the end.
  await page.locator('.panel').first().scrollIntoViewIfNeeded();
  await until(page, () => [...window.poise.grid.inSight].some((p) => p.plot));
  const length = await page.evaluate(() => [...window.poise.grid.inSight].find((p) => p.plot).data[0].length);
  await until(page, (n) => {
    const {grid, view: shown, player, scene} = window.poise;
    const plots = [...grid.inSight].filter((p) => p.plot);
    return player.following && scene.row === player.row && shown.max > shown.min
      && plots.every((p) => p.data.every((values) => values.length > n) && p.plot.scales.x.max === shown.max);
  }, length);

  // What is shown while it goes on is so: values, not dashes; the cursor inside its plot; nothing has ended or failed.
  await page.evaluate(() => Promise.all([...window.poise.grid.inSight].map((p) => p.building)));
  await page.evaluate(() => {
    window.dashes = () => {
      const {grid, run: r, player} = window.poise;
      return [...grid.inSight].filter((p) => p.plot).flatMap((p) => p.lines.filter((line, i) => line.signal && p.values[i].textContent === '–'
        && !Number.isNaN(line.signal.values[r.rowAt(player.time)])).map((line) => line.signal.name));
    };
  });
  for (let k = 0; k < 8; ++k) {
    await more(page, 10);
    // Values are renewed some ten times a second: a dash may still be of a tick that a busy machine skipped.
    await until(page, () => window.dashes().length === 0);
    const seen = await page.evaluate(() => {
      const {grid} = window.poise;
      grid.updateValues();
      const plots = [...grid.inSight].filter((p) => p.plot);
      const box = (e) => e.getBoundingClientRect();
      return {
        dashes: window.dashes(),
        outside: plots.filter((p) => !p.cursor.hidden && (box(p.cursor).left > box(p.plot.over).right + 3 || box(p.cursor).left < box(p.plot.over).left - 3)).length,
        single: grid.shared.phases.support.filter((p) => p.value !== 'both feet').length,
        text: document.body.innerText};
    });
    assert.deepEqual(seen.dashes, []);
    assert.equal(seen.outside, 0);
    assert.equal(seen.single, 0);  // it stands on both feet all the time
    assert.match(seen.text, /in progress/);
    assert.doesNotMatch(seen.text, /run ended|FAILED|checks hold|planned end/);
  }

  // Events, checks and the components' health come with the run.
  await until(page, () => window.poise.feed.status.components.length > 6 && document.querySelector('svg.latencies'));
  assert.match(await page.locator('#tables').innerText(), /Checks up to -?[\d.]+ s: pending/);
  assert.match(await page.locator('.events').innerText(), /phase began/);
  const told = await page.evaluate(() => window.poise.feed.status);
  assert.ok(told.checks.every((c) => c.name !== 'log_defects' && !c.name.startsWith('duration_reached')));
  assert.ok(told.checked_ticks > 0);
  assert.ok(told.checks.every((c) => c.passed === null));
  assert.match(await page.locator('#tables table').first().innerText(), /pending/);

  // Looking back holds still while the run goes on.
  // In the middle of what the page holds: its beginning goes on with the run on a machine that took longer than the page keeps.
  await page.evaluate(() => window.poise.player.seek((window.poise.run.start + window.poise.run.end) / 2));
  const {time} = await page.evaluate(() => ({time: window.poise.player.time}));
  await more(page);
  assert.equal(await page.evaluate(() => window.poise.player.time), time);
  assert.equal(await page.locator('#live').getAttribute('aria-pressed'), 'false');
  await page.click('#live');
  assert.equal(await page.evaluate(() => window.poise.player.time === window.poise.run.end), true);

  // A second browser, and the first one closed and opened again.
  const other = await openPage(browser, view.url, {picture: false});
  await more(other.page);
  // Whoever comes late begins with what is new, and has the rest soon after.
  await until(page, () => window.poise.run.numRows > 3000);
  await page.addInitScript(() => {
    window.batches = [];
    window.WebSocket = class extends WebSocket {
      constructor(url) {
        super(url);
        this.addEventListener('message', ({data}) => {
          if (typeof data !== 'string') window.batches.push([8, 16].map((place) => new DataView(data).getFloat64(place, true)));
        });
      }
    };
  });
  await page.reload();
  await until(page, () => document.documentElement.dataset.ready);
  const [from, newest] = await page.evaluate(() => window.batches[0]);
  assert.ok(newest > 3000 && newest - from < 1000, `the first batch begins at tick ${from} of ${newest}`);
  await more(page);

  await run.stop();
  await until(page, () => window.poise.feed.state === 'ended');
  await until(other.page, () => window.poise.feed.state === 'ended');
  await view.prints(/the run has ended/);
  await until(page, () => window.poise.feed.missing === 0 && window.poise.run.numRows > 3000);
  // Its end: what is said of it is now that of the whole log.
  await until(page, () => window.poise.feed.status.ended);
  assert.match(await page.locator('.story').innerText(), /the robot stood .* until the run ended/);
  assert.doesNotMatch(await page.locator('#header').innerText(), /in progress|being checked/);
  assert.match(await page.locator('#header').innerText(), /FAILED/);  // it was to last longer
  assert.match(await page.locator('.events').innerText(), /run ended .* before its planned end/);
  const final = await page.locator('#tables').innerText();
  assert.match(final, /Channels in the log/);
  assert.doesNotMatch(final, /pending/);
  const late = await openPage(browser, view.url, {picture: false});  // what it has is still served
  await until(late.page, () => window.poise.feed.state === 'ended');

  // The same numbers as in the log.
  // A page of its usual size has rows of several ticks of a run that a busy machine made long.
  const report = spawnSync(options.poise, ['report', path('live'), '-o', path('live.html'), '--page-size', '1000'], {encoding: 'utf8'});
  assert.ok(report.status <= 1, report.stderr);
  const logged = await openPage(browser, path('live.html'), {picture: false});
  const compare = ['ROBOT_STATE.base_position[1]', 'GROUND_TRUTH.joint_position[3]', 'ROBOT_SENSORS.foot_wrench[0].force[2]'];
  const read = (from) => from.evaluate(async (names) => {
    const {run: r} = window.poise;
    return {first: r.firstTick, columns: await Promise.all(names.map(async (name) => {
      const s = r.signals.get(name);
      await s.load();
      return [...s.values];
    }))};
  }, compare);
  const truth = await read(logged.page);
  for (const {page: live} of [{page}, other, late]) {
    const {first, columns} = await read(live);
    columns.forEach((column, k) => {
      const numbers = truth.columns[k].filter((x) => !Number.isNaN(x));
      const range = Math.max(...numbers) - Math.min(...numbers);
      let compared = 0;
      column.forEach((value, i) => {
        const expected = truth.columns[k][first + i];
        if (Number.isNaN(value) || expected === undefined) return;
        ++compared;
        assert.ok(Math.abs(value - expected) <= 1e-6 * range + 1e-6 * Math.abs(expected), `${compare[k]} of tick ${first + i}: ${value}, not ${expected}`);
      });
      assert.ok(compared > 20, `${compare[k]}: ${compared} values to compare`);
    });
  }
  for (const {problems: found} of [{problems}, other, late]) assert.deepEqual(found, []);
  for (const p of [page, other.page, late.page, logged.page]) await p.context().close();
  assert.equal(await view.stop(), 0);
});

test('a page keeps the last ticks only', async () => {
  const {run, view} = await start('short', ['--realtime', '--duration', '600'], ['--keep', '1']);
  const {page, problems} = await openPage(browser, view.url, {picture: false});
  // Full, however late the page came, and some have gone.
  const first = await page.evaluate(() => window.poise.run.firstTick);
  await until(page, (from) => window.poise.run.numRows >= 500 && window.poise.run.firstTick > from + 300, first);
  const held = await page.evaluate(() => {
    const {run: r} = window.poise;
    return [r.numRows, ...[...r.signals.values()].filter((s) => s.values).map((s) => s.values.length)];
  });
  for (const n of held) assert.equal(n, 500);
  await page.evaluate(() => window.poise.player.seek(window.poise.run.start));
  await more(page, 100);
  assert.ok(await page.evaluate(() => window.poise.player.time >= window.poise.run.start));
  assert.deepEqual(problems, []);
  await page.context().close();
  await run.stop();
  await view.stop();
});

test('a page that loses its server goes on with the next one where it was', async () => {
  const {run, view} = await start('again', ['--realtime', '--duration', '600']);
  const {page} = await openPage(browser, view.url, {picture: false});
  await more(page);
  assert.equal(await view.stop(), 0);
  await until(page, () => window.poise.feed.state === 'waiting');
  const ticks = await page.evaluate(() => window.poise.run.numRows);
  const next = await startView(options.poise, run, path('again'), '--port', String(view.port));
  await until(page, () => window.poise.feed.state === 'live');
  await more(page);
  // What came between the two is a gap, and what was there has stayed.
  await until(page, () => !Number.isNaN([...window.poise.run.signals.get('ROBOT_STATE.utime').values].at(-1)));
  // Read together: what was before the page's beginning may still come.
  const [first, values] = await page.evaluate(() => [window.poise.run.firstTick,
    [...window.poise.run.signals.get('ROBOT_STATE.utime').values]]);
  values.forEach((utime, row) => assert.ok(Number.isNaN(utime) || utime === 2000 * (first + row), `${utime} in row ${row}`));
  assert.ok(values.slice(0, ticks).some((x) => !Number.isNaN(x)));
  await page.context().close();
  await run.stop();
  await next.stop();
});
