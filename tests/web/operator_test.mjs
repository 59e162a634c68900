// What a page's buttons do beyond control_test.mjs: walk, stop walking, a step, a stop without a connection, and a browser that dies while it pushes.
// Usage: node operator_test.mjs --poise PROGRAM --web DIR, where DIR is build/web.
import assert from 'node:assert/strict';
import {mkdtempSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {after, afterEach, before, test} from 'node:test';
import {parseArgs} from 'node:util';
import {grab, launchBrowser, openPage, PATIENCE} from './browser.mjs';
import {endTest, replays, startInteractive} from './live_run.mjs';

const {values: options} = parseArgs({options: {poise: {type: 'string'}, web: {type: 'string'}}});
const folder = mkdtempSync(join(tmpdir(), 'poise-operator-'));
let browser;

before(async () => { browser = await launchBrowser(options.web); });
afterEach(() => endTest(browser));
after(async () => {
  await browser?.close();
  rmSync(folder, {recursive: true, force: true});
});

const until = (page, condition, argument) => page.waitForFunction(condition, argument, {timeout: PATIENCE});

/** `picture`: the robot is drawn, and can be grabbed. */
async function start(name, picture, ...more) {
  const run = await startInteractive(options.poise, join(folder, name), '--duration', '600', ...more);
  const {page, problems} = await openPage(browser, run.url, {picture});
  await until(page, () => window.poise.control.standing?.settings.length > 0 && window.poise.run.numRows > 100);
  return {run, page, problems};
}

/** Presses a button until what it asks for is on its way: a page whose connection a busy machine lost sends nothing, and says so. */
async function press(page, button, what) {
  const newest = () => page.evaluate((kind) => window.poise.control.standing.acts.findLast((a) => a.do === kind)?.id ?? 0, what);
  const before = await newest();
  for (;;) {
    await page.click(button);
    const unsent = await page.evaluate(() => Boolean(window.poise.control.unsent));
    if (!unsent) break;
    assert.match(await page.locator('.acts').innerText(), /not sent: no connection/);
    await page.waitForTimeout(500);
  }
  await until(page, ([kind, id]) => window.poise.control.standing.acts.some((a) => a.do === kind && a.id > id), [what, before]);
  return answered(page, what);
}

/** Waits until the last act of a kind is answered; gives the answer. */
async function answered(page, what) {
  const found = await until(page, (kind) => {
    const act = window.poise.control.standing.acts.findLast((a) => a.do === kind);
    return act && act.state !== 'sent' && act;
  }, what);
  return found.jsonValue();
}

test('buttons walk the robot, stop it, and make one step', async () => {
  const {run, page, problems} = await start('walk', false, '--set', 'step_planner.walk.enabled=true');
  await page.locator('input[aria-label^=forward]').evaluate((slider) => {
    slider.value = 0.1;
    slider.dispatchEvent(new Event('input'));
  });
  const walk = await press(page, '#walk', 'walk');
  assert.equal(walk.state, 'accepted', walk.reason);
  // The simulator's own body, not what a planner says.
  await until(page, (tick) => {
    const {run: r} = window.poise;
    const {values} = r.signals.get('GROUND_TRUTH.base_position[0]');
    return values[r.numRows - 1] - values[Math.max(0, tick - r.firstTick)] > 0.1;
  }, walk.tick);
  // A step while it walks is refused, and says why; once it stands, the foot that was named leaves the ground.
  const early = await press(page, 'text="step, left"', 'step');
  assert.equal(early.state, 'refused');
  assert.match(early.reason, /not now/);
  const stop = await press(page, '#stop-walking', 'stop_walking');
  assert.equal(stop.state, 'accepted', stop.reason);
  let step;
  while ((step = await press(page, 'text="step, left"', 'step')).state !== 'accepted') await page.waitForTimeout(300);
  const left = await page.evaluate(() => window.poise.run.robot.feet.findIndex(({name}) => name === 'left'));
  await until(page, ([foot, tick]) => {
    const {run: r} = window.poise;
    const points = r.signals.get(`GROUND_TRUTH.foot_contact_points[${foot}]`).values.subarray(Math.max(0, tick - r.firstTick), r.numRows);
    return points.includes(0) && points.at(-1) > 0;  // up, and down again
  }, [left, step.tick]);
  assert.deepEqual(problems, []);
  await page.context().close();
  await run.stop();
  replays(options.poise, join(folder, 'walk/run.lcm'));
});

test('a stop without a connection says so, and is sent once there is one', async () => {
  const {run, page, problems} = await start('unsent', false);
  // The connection breaks, and in that moment the button is pressed.
  const told = await page.evaluate(() => {
    const {send} = WebSocket.prototype;
    WebSocket.prototype.send = function () { this.close(); };
    window.poise.control.act('set', {field: 'none', value: 0});
    WebSocket.prototype.send = send;
    document.getElementById('estop').click();
    return {acts: document.querySelector('.acts').innerText, stopped: window.poise.control.standing.stopped};
  });
  assert.match(told.acts, /stop not sent: no connection; it will be as soon as there is one/);
  assert.equal(told.stopped, false);
  await until(page, () => window.poise.control.standing.stopped);
  assert.doesNotMatch(await page.locator('.acts').innerText(), /not sent/);
  assert.deepEqual(problems, []);
  await page.context().close();
  await run.stop();
});

test('a push ends when its browser dies', async () => {
  const {run, page} = await start('dying', true);
  await page.locator('#scene').scrollIntoViewIfNeeded();
  const at = await grab(page);
  await page.mouse.move(at.x + 25, at.y, {steps: 4});
  await until(page, () => window.poise.control.standing.push);
  const crash = await page.context().newCDPSession(page);
  crash.send('Page.crash').catch(() => {});  // no page can say goodbye in that
  const {page: other, problems} = await openPage(browser, run.url, {picture: false});
  // Measured by the simulator: a force, and for 250 ticks none. (What stands now is told before the ticks until now have come.)
  const ended = await until(other, () => {
    const {run: r, control} = window.poise;
    if (!control.standing || control.standing.push) return false;
    const axes = [0, 1, 2].map((i) => r.signals.get(`GROUND_TRUTH.push_force[${i}]`).values);
    let row = r.numRows - 1;
    while (row >= 0 && axes.every((values) => values[row] === 0)) --row;
    return row >= 0 && r.numRows - row > 250 && {last: r.firstTick + row, act: control.standing.acts.findLast((a) => a.do === 'push')};
  });
  const {last, act} = await ended.jsonValue();
  assert.ok(last < act.tick + 125, `pushed at tick ${act.tick} for the last time, and until tick ${last}`);
  assert.deepEqual(problems, []);
  await other.context().close();
  await run.stop();
  replays(options.poise, join(folder, 'dying/run.lcm'));
});
