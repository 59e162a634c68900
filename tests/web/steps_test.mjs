// Footprints, planned footholds and regions of a walk and of a recovery step, in a browser: drawn where the log's soles were.
// Usage: node steps_test.mjs --poise PROGRAM --web DIR, where DIR is build/web
import assert from 'node:assert/strict';
import {mkdtempSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {after, afterEach, before, test} from 'node:test';
import {parseArgs} from 'node:util';
import {apart} from '../../web/src/footsteps.js';
import {launchBrowser, openPage, PATIENCE} from './browser.mjs';
import {endTest, interactive} from './live_run.mjs';
import {poiseCaller} from './program.mjs';

const HIDES = 0.04;  // m between footprints of which the later one hides the earlier

const {values: options} = parseArgs({options: {poise: {type: 'string'}, web: {type: 'string'}}});
const folder = mkdtempSync(join(tmpdir(), 'poise-steps-'));
const path = (name) => join(folder, name);
const poise = poiseCaller(options.poise);
let browser;

before(async () => {
  poise('run', 'walk', '--variant', 'ahead', '--inline', '--set', 'duration=7', '--out', path('walk'));
  poise('run', 'push_double_support', '--variant', 'step', '--inline', '--duration', '3', '--out', path('step'));
  browser = await launchBrowser(options.web);
});

afterEach(() => endTest(browser));
after(async () => {
  await browser?.close();
  rmSync(folder, {recursive: true, force: true});
});

/**
 * What the picture shows at the run's end, and what the log says: by foot the ticks in which its measured load was above half of the
 * weight, with the true place of its sole.
 */
const shown = (page) => page.evaluate(async () => {
  const {run, scene, player} = window.poise;
  player.seek(run.end);
  const column = async (name) => {
    const signal = run.signals.get(name);
    await signal.load();
    return signal.values;
  };
  const half = 0.5 * 9.80665 * run.robot.mass;
  const stood = [[], []];
  for (const foot of [0, 1]) {
    const load = await column(`ROBOT_SENSORS.foot_wrench[${foot}].force[2]`);
    const place = await Promise.all([0, 1, 2].map((i) => column(`GROUND_TRUTH.foot_pose[${foot}].position[${i}]`)));
    load.forEach((force, row) => {
      if (-force > half && Number.isFinite(place[0][row] + place[1][row])) stood[foot].push([run.timeAt(row), ...place.map((values) => values[row])]);
    });
  }
  // Corners of the drawn soles: a pair each edge, an edge a corner.
  const drawn = scene.steps.prints.map((view, f) => {
    const corners = run.robot.feet[f].corners.length;
    const count = view.edges.geometry.drawRange.count / 2 / corners;
    return Array.from({length: count}, (_, k) => [0, 1, 2].map((axis) => {
      let sum = 0;
      for (let i = 0; i < corners; ++i) sum += view.edge.array[3 * 2 * (k * corners + i) + axis];
      return sum / corners;
    }));
  });
  const centre = run.robot.feet.map((foot) => [0, 1].map((i) => foot.corners.reduce((sum, c) => sum + c[i], 0) / foot.corners.length));
  return {stood, drawn, centre, prints: scene.steps.footprints.list.map(({foot, from, pose}, i, all) => ({foot, from, to: all.slice(i + 1).find((p) => p.foot === foot)?.from ?? run.end, pose})),
    steps: Math.max(...(await column('PLANNER_STATUS.num_steps')).filter(Number.isFinite)), labels: scene.steps.labels.filter((l) => l.object.visible).map((l) => l.shown)};
});

function compare({stood, drawn, prints, centre}, tolerance) {
  const told = apart(prints);  // a footprint that a later one hides is not drawn
  for (const foot of [0, 1]) {
    const own = prints.filter((print) => print.foot === foot), kept = told.filter((print) => print.foot === foot);
    assert.equal(drawn[foot].length, kept.length);
    for (const [time, x, y] of stood[foot]) {
      const print = own.findLast(({from}) => from <= time + 1e-3);  // half a tick: pages hold single precision
      assert.ok(print, `foot ${foot} carries the robot at ${time} s, without a footprint`);
      const [px, py] = print.pose.position;
      assert.ok(Math.hypot(px - x, py - y) < tolerance, `foot ${foot} stands ${Math.hypot(px - x, py - y)} m from its footprint at ${time} s`);
      const [dx, dy] = centre[foot];
      const aways = drawn[foot].map(([sx, sy]) => Math.hypot(sx - x - dx, sy - y - dy));
      const k = kept.indexOf(print);
      if (k >= 0) assert.ok(aways[k] < tolerance, `foot ${foot} stands ${aways[k]} m from where its footprint is drawn at ${time} s`);
      else assert.ok(Math.min(...aways) < tolerance + HIDES, `nothing is drawn where foot ${foot} stands at ${time} s`);
    }
    for (const print of own.filter((p) => p.to - p.from > 0.2)) {
      assert.ok(stood[foot].some(([time]) => print.from <= time && time <= print.to), `nothing stood at ${JSON.stringify(print)}`);
    }
  }
}

test('the footprints of a walk are where its soles were, and the planned footholds where they came down', async () => {
  poise('report', path('walk'));
  const {page, problems} = await openPage(browser, path('walk/report.html'));
  const seen = await shown(page);
  compare(seen, 0.02);
  assert.ok(seen.steps >= 5, `${seen.steps} steps`);
  assert.ok(seen.prints.length >= seen.steps && seen.prints.length <= seen.steps + 2);
  assert.ok(seen.labels.length >= 6 && seen.labels.every((text) => /^\d+\.\d\d s$/.test(text)), seen.labels.join());

  // Planned as the foot is about to land, and where it then stood; the regions hold the standing sole.
  const planned = await page.evaluate(() => {
    const {run, scene, player} = window.poise;
    return scene.steps.footprints.list.filter((print) => print.from > 2).map((print) => {
      player.seek(print.from - 0.05);
      const outlines = scene.steps.planned.filter((outline) => outline.object.visible);
      const first = outlines[0].positions.array;
      const corners = run.robot.feet[print.foot].corners.length;
      const middle = [0, 1].map((axis) => Array.from({length: corners}, (_, i) => first[3 * i + axis]).reduce((a, b) => a + b) / corners);
      const sizes = scene.steps.regions.map((region) => region.object.geometry.drawRange.count);
      return {count: outlines.length, sizes, away: Math.hypot(middle[0] - print.pose.position[0], middle[1] - print.pose.position[1])};
    });
  });
  assert.ok(planned.length >= 4);
  for (const {count, sizes, away} of planned) {
    assert.ok(count >= 1 && count <= 3);
    assert.ok(away < 0.04, `a foot came down ${away} m from its planned foothold`);
    assert.ok(sizes.every((corners) => corners >= 4), `regions with ${sizes} corners`);
  }
  assert.match(await page.locator('.key').first().innerText(), /footprints[\s\S]*approximate/);
  await page.click('.regions-note summary');
  assert.match(await page.locator('.regions-note').innerText(), /legs' reach/);
  await page.evaluate(() => window.poise.player.seek(4));
  assert.match(await page.locator('.readout').innerText(), /step\s+\S.*walk/);

  // The view goes with the robot.
  const away = await page.evaluate(() => {
    const {scene, run, player} = window.poise;
    player.seek(run.end);
    const {x, y} = scene.robotView.object.position;
    return Math.hypot(x - scene.controls.target.x, y - scene.controls.target.y);
  });
  assert.ok(away < 0.41, `the robot is ${away} m from the picture's middle`);
  assert.deepEqual(problems, []);
  await page.context().close();
});

test('the footprints of a step that catches a push are where its soles were, and the event says why it was made', async () => {
  poise('report', path('step'));
  const {page, problems} = await openPage(browser, path('step/report.html'));
  const seen = await shown(page);
  compare(seen, 0.03);
  assert.ok(seen.steps >= 1);
  assert.match(await page.locator('.events').innerText(),
    /step begins[\s\S]*(the capture point stays beyond the soles|than balancing brings back|out of reach)/);
  // Steps are known to catch it, from the decision until the foot comes down.
  const caught = await page.evaluate(async () => {
    const {run, player} = window.poise;
    const stepping = run.signals.get('PLANNER_STATUS.stepping');
    await stepping.load();
    const [unloads, lands] = [1, 3].map((stage) => run.timeAt(stepping.values.findIndex((x) => x === stage)));
    return [unloads, 0.5 * (unloads + lands), lands - 0.02].map((time) => {
      player.seek(time);
      return document.querySelector('.readout').innerText;
    });
  });
  for (const text of caught) assert.match(text, /capture point within\s+(1 step|2 steps)/);
  assert.deepEqual(problems, []);
  await page.context().close();
});

test('a page that follows a run draws the same', async () => {
  const run = await interactive(options.poise, 'push_double_support', path('live'), '--variant', 'step', '--duration', '2');
  const {page, problems} = await openPage(browser, run.url);
  await page.waitForFunction(() => window.poise?.run?.firstTick === 0 && window.poise.run.numRows === 1000, undefined, {timeout: PATIENCE});
  const seen = await shown(page);
  compare(seen, 0.03);
  assert.ok(seen.steps >= 1);
  const regions = await page.evaluate(async () => {
    const {run: r, scene, player} = window.poise;
    player.seek(r.timeAt(r.signals.get('PLANNER_STATUS.stepping').values.indexOf(2)));
    return scene.steps.regions.map((region) => region.object.geometry.drawRange.count);
  });
  assert.ok(regions.every((corners) => corners >= 4), `regions with ${regions} corners`);
  assert.deepEqual(problems, []);
  await page.context().close();
  await run.stop();
});
