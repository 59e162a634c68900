// Pages that act: on a run of processes (`poise view --control`) and on an interactive one. Replays repeat what they did.
// Usage: node control_test.mjs --poise PROGRAM --web DIR, where DIR is build/web. POISE_PICTURES=FOLDER keeps pictures.
import assert from 'node:assert/strict';
import {mkdirSync, mkdtempSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {after, afterEach, before, test} from 'node:test';
import {parseArgs} from 'node:util';
import {grab, launchBrowser, openPage, PATIENCE} from './browser.mjs';
import {endTest, replays, replaysInPart, startInteractive, startStanding, startView} from './live_run.mjs';

const {values: options} = parseArgs({options: {poise: {type: 'string'}, web: {type: 'string'}}});
const folder = mkdtempSync(join(tmpdir(), 'poise-control-'));
const path = (name) => join(folder, name);
const pictures = process.env.POISE_PICTURES;
let browser;

before(async () => {
  if (pictures) mkdirSync(pictures, {recursive: true});
  browser = await launchBrowser(options.web);
});
afterEach(() => endTest(browser));
after(async () => {
  await browser?.close();
  rmSync(folder, {recursive: true, force: true});
});

const until = (page, condition, argument) => page.waitForFunction(condition, argument, {timeout: PATIENCE});
const standing = (page) => page.evaluate(() => window.poise.control.standing);
const picture = async (page, name) => { if (pictures) await page.screenshot({path: join(pictures, `${name}.png`)}); };

/** Drags the robot by some pixels, checks what is shown, and lets go. */
async function drag(page, name, pixels = 25) {
  await page.locator('#scene').scrollIntoViewIfNeeded();
  const turned = await page.evaluate(() => window.poise.scene.camera.position.toArray());
  const at = await grab(page);
  await page.mouse.move(at.x + pixels, at.y, {steps: 4});
  // In force, as the receiver said, and measured by the simulator's own sensor.
  const seenThen = await until(page, () => {
    const {control, scene} = window.poise;
    const force = control.standing.push?.force;
    const text = document.querySelector('output.force').innerText;
    return force && Math.hypot(...scene.samples.vector('push', scene.row)) > 0.5 * Math.hypot(...force) && Math.hypot(...force) > 5
      && /measured \d/.test(text) && {force, limit: control.standing.push_limit, text};
  });
  const {force, limit, text} = await seenThen.jsonValue();
  assert.match(text, /asked \d+ N, in force \d+ N, measured \d+ N/);
  assert.ok(Math.hypot(...force) <= limit * (1 + 1e-9));
  await picture(page, name);
  await page.mouse.up();
  await until(page, () => !window.poise.control.standing.push);
  assert.ok(await page.locator('output.force').isHidden());
  assert.deepEqual(await page.evaluate(() => window.poise.scene.camera.position.toArray()), turned, 'the view has turned');
}

/** Moves a slider, and takes it back. */
async function change(page, name) {
  const setting = (await standing(page)).settings[0];
  // The browser keeps 15 digits of it.
  const wanted = await page.locator('.setting input[type=range]').first().evaluate((slider, value) => {
    slider.value = value;
    slider.dispatchEvent(new Event('change'));
    return Number(slider.value);
  }, setting.value + 0.5 * (setting.high - setting.value));
  const value = (field) => window.poise.control.setting(field).value;
  await until(page, ([field, asked]) => window.poise.control.setting(field).value === asked, [setting.field, wanted]);
  await picture(page, name);
  await page.click('#undo');
  await until(page, ([field, asked]) => window.poise.control.setting(field).value === asked, [setting.field, setting.value]);
  assert.equal(await page.evaluate(value, setting.field), setting.value);
  assert.equal(await page.locator('#undo').isDisabled(), true);
  // What is out of range is refused, and nothing changes.
  await page.evaluate(([field, high]) => window.poise.control.act('set', {field, value: 2 * high + 1}), [setting.field, setting.high]);
  await until(page, () => window.poise.control.standing.acts.at(-1).state === 'refused');
  assert.equal(await page.evaluate(value, setting.field), setting.value);
}

test('a page pushes, changes, takes back and stops a run of processes, and a replay repeats it', async () => {
  const run = startStanding(options.poise, path('bus'), '--realtime', '--duration', '600');
  const view = await startView(options.poise, run, path('bus'), '--control');
  const {page, problems} = await openPage(browser, view.url);
  await until(page, () => window.poise.control.standing?.settings.length > 0 && !document.getElementById('control').hidden);
  await drag(page, 'bus_drag');
  await change(page, 'bus_setting');
  await page.click('#estop');
  await until(page, () => window.poise.control.standing.stopped);
  await picture(page, 'bus_stopped');
  // A page without the token neither reads nor acts.
  for (const wrong of [view.url.replace(/token=.*/, ''), view.url.replace(/.$/, 'x')]) {
    const answer = await fetch(wrong);
    assert.equal(answer.status, 403);
  }
  assert.deepEqual(problems, []);
  await page.context().close();
  await run.stop();
  await view.stop();
  replaysInPart(options.poise, path('bus'));
});

test('an interactive run waits, steps, slows, goes back, goes on changed, and its log replays', async () => {
  const run = await startInteractive(options.poise, path('stand'), '--duration', '600');
  const {page, problems} = await openPage(browser, run.url);
  await until(page, () => window.poise.control.standing?.settings.length > 0);
  await until(page, () => window.poise.run.firstTick + window.poise.run.numRows > 300);
  await drag(page, 'interactive_drag', 15);
  await change(page, 'interactive_setting');

  await page.click('#go');
  await until(page, () => window.poise.control.standing.run.paused);
  const {run: {tick}} = await standing(page);
  await until(page, (t) => window.poise.run.firstTick + window.poise.run.numRows === t, tick);
  await page.click('#one-tick');
  await until(page, (t) => window.poise.control.standing.run.tick === t + 1, tick);

  // Back, to a tick at which nothing had been done; what was left stays, and is whole.
  await until(page, () => window.poise.feed.missing === 0);
  const base = await page.evaluate(() => window.poise.run.signals.get('GROUND_TRUTH.base_position[1]').values[250 - window.poise.run.firstTick]);
  await page.evaluate(() => window.poise.player.seek(window.poise.run.timeOfTick(251)));
  await page.click('#back');
  await until(page, () => window.poise.control.standing.run.branch === 1 && window.poise.control.standing.run.tick === 251);
  await until(page, () => window.poise.run.firstTick + window.poise.run.numRows === 251);
  assert.equal(await page.evaluate(() => window.poise.run.signals.get('GROUND_TRUTH.base_position[1]').values[250 - window.poise.run.firstTick]), base);
  await picture(page, 'interactive_back');
  await page.selectOption('#run-speed', '0.5');
  // The page goes on with the run.
  await page.click('#go');
  await until(page, () => window.poise.player.following && window.poise.player.tick > 400 && window.poise.scene.row === window.poise.player.row);
  assert.ok(await page.evaluate(() => Number(document.getElementById('time').innerText.split(' ')[0]) > window.poise.run.timeOfTick(400)));
  assert.equal((await standing(page)).run.speed, 0.5);
  await drag(page, 'interactive_after', -15);

  // A stop is taken when the bridge says so: not while the run waits.
  await page.click('#go');
  await until(page, () => window.poise.control.standing.run.paused);
  await page.click('#estop');
  const stop = () => window.poise.control.standing.acts.findLast((act) => act.do === 'stop');
  await until(page, () => window.poise.control.standing.acts.some((act) => act.do === 'stop'));
  assert.equal((await page.evaluate(stop)).state, 'sent');
  assert.equal((await standing(page)).stopped, false);
  await page.click('#one-tick');
  await page.click('#one-tick');
  await until(page, () => window.poise.control.standing.stopped);
  const {state, tick: stoppedAt} = await page.evaluate(stop);
  assert.equal(state, 'accepted');
  // The log's own word, at the tick that was told: 0 to 4 are no stop.
  const bridge = (at) => page.evaluate((t) => {
    const {run: r} = window.poise;
    return r.signals.get('BRIDGE_STATUS.state').values[t - r.firstTick];
  }, at);
  assert.ok(await bridge(stoppedAt) > 4);
  assert.ok(await bridge(stoppedAt - 1) <= 4);
  await page.click('#go');

  // Narrow, by keyboard alone.
  await page.setViewportSize({width: 390, height: 800});
  await page.evaluate(() => scrollTo(0, 0));
  const lowest = await page.evaluate(() => document.getElementById('player').getBoundingClientRect().top);
  for (const [place, bottom] of [['#estop', 800], ['.now h2', lowest], ['.now tr', lowest], ['.events h2', lowest]]) {
    // The page measures at once: a running page replaces its rows between a locator's find and its measuring.
    const box = await (await until(page, (selector) => document.querySelector(selector)?.getBoundingClientRect().toJSON(), place)).jsonValue();
    assert.ok(box.y >= 0 && box.y + box.height <= bottom, `${place} is not on a phone's first screen: ${JSON.stringify(box)}`);
  }
  await page.keyboard.press('p');
  await until(page, () => window.poise.control.standing.run.paused);
  await picture(page, 'interactive_narrow');
  assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), 'wider than the window');
  assert.deepEqual(problems, []);
  await page.context().close();
  await run.stop();
  assert.match(run.output, /of \d+ checks/);  // the report
  replays(options.poise, path('stand/run.lcm'));
  replays(options.poise, path('stand/branch_1.lcm'));
});

test('after a fall the page starts the run again, and goes back to its first tick', async () => {
  const run = await startInteractive(options.poise, path('again'), '--duration', '600');
  const {page, problems} = await openPage(browser, run.url);
  const end = () => page.evaluate(() => window.poise.run.firstTick + window.poise.run.numRows);
  const height = (at) => page.evaluate((t) => {
    const {run: r} = window.poise;
    return r.signals.get('GROUND_TRUTH.base_position[2]').values[t - r.firstTick];
  }, at);
  await until(page, () => window.poise.control.standing?.settings.length > 0);
  await until(page, () => window.poise.run.firstTick + window.poise.run.numRows > 250);
  // The page may have come late: while the run waits it gets the rest.
  const pause = async () => {
    await page.keyboard.press('p');
    await until(page, () => window.poise.control.standing.run.paused && window.poise.feed.missing === 0);
  };
  await pause();
  const stood = await height(200);
  await page.keyboard.press('p');
  // It cannot walk: the buttons are grey, and say why.
  for (const button of ['#walk', '#stop-walking', 'text="step, left"']) {
    assert.equal(await page.locator(button).isDisabled(), true, button);
    assert.match(await page.locator(button).getAttribute('title'), /needs a scenario with base: "base\/walking"/);
  }
  await page.click('.walking summary');
  assert.match(await page.locator('.reason').innerText(), /needs a scenario with/);
  const {settings: [setting]} = await standing(page);
  await page.evaluate(([field, value]) => window.poise.control.act('set', {field, value}), [setting.field, 0.9 * setting.value + 0.1 * setting.high]);
  await until(page, ([field, value]) => window.poise.control.setting(field).value !== value, [setting.field, setting.value]);
  // Until it falls: half of the weight from the side, for long.
  await page.evaluate(() => {
    const {standing: {push_limit: limit, push_longest: longest}} = window.poise.control;
    window.poise.control.act('push', {body: window.poise.run.robot.bodies[0].name, point: [0, 0, 0], force: [0, limit, 0], duration: longest});
  });
  await until(page, () => window.poise.control.standing.run.ended);
  const {run: {detail}} = await standing(page);
  assert.match(detail, /fell/);
  await page.keyboard.press('p');
  await until(page, () => window.poise.control.standing.acts.some((act) => act.do === 'go' && act.state === 'refused'));
  await until(page, () => /go refused: the run has ended/.test(document.querySelector('.answer.refused').innerText));
  const fallen = await end();
  assert.ok(fallen > 500);
  // Why it fell is told at once, and nothing is offered that an ended run cannot do.
  await until(page, () => /fell at [\d.]+ s/.test(document.getElementById('header').innerText));
  assert.match(await page.locator('.story').innerText(), /the robot fell at/);
  assert.doesNotMatch(await page.locator('#header').innerText(), /in progress/);
  await until(page, () => /fall/.test(document.querySelector('.events').innerText));
  for (const button of ['#go', '#one-tick', '#push']) {
    assert.equal(await page.locator(button).isDisabled(), true);
    assert.match(await page.locator(button).getAttribute('title'), /the run has ended/);
  }
  await picture(page, 'again_fallen');

  await page.click('#restart');
  await until(page, () => window.poise.control.standing.run.branch === 1);
  await until(page, () => window.poise.run.numRows > 250 && !window.poise.control.standing.run.paused);
  const again = await standing(page);
  assert.equal(again.run.ended, false);
  await until(page, () => /in progress/.test(document.getElementById('header').innerText) && !document.querySelector('.story'));
  assert.doesNotMatch(await page.locator('#header').innerText(), /fell/);
  assert.equal(again.settings[0].value, setting.value, 'settings are those of the start');
  await picture(page, 'again_stands');

  // A run that waits starts again as well.
  await pause();
  assert.equal(await page.evaluate(() => window.poise.run.firstTick < 250), true);
  assert.equal(await height(200), stood, 'the same bits');
  await page.click('#restart');
  await until(page, () => window.poise.control.standing.run.branch === 2 && !window.poise.control.standing.run.paused);
  await until(page, () => window.poise.run.numRows > 100);
  await pause();
  assert.equal(await page.evaluate(() => window.poise.run.firstTick), 0);
  // Back to tick 0 by the cursor: there the run waits, with nothing to show yet, and goes on from there.
  await page.evaluate(() => window.poise.player.seek(window.poise.run.timeOfTick(0)));
  await page.click('#back');
  await until(page, () => window.poise.control.standing.run.branch === 3 && window.poise.control.standing.run.tick === 0);
  await page.click('#go');
  await until(page, () => window.poise.run.numRows > 250);
  await pause();
  assert.equal(await height(200), stood);
  assert.deepEqual(problems, []);
  await page.context().close();
  await run.stop();
  for (const name of ['run.lcm', 'branch_1.lcm']) replays(options.poise, path(`again/${name}`));
});
