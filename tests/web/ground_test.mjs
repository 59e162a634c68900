// Stairs as a page draws them: the robot's soles stand on their tops. Its story and its variant stand above the picture.
// Usage: node ground_test.mjs --poise PROGRAM --web DIR, where DIR is build/web
import assert from 'node:assert/strict';
import {mkdtempSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {after, before, test} from 'node:test';
import {parseArgs} from 'node:util';
import {launchBrowser, openPage} from './browser.mjs';
import {poiseCaller} from './program.mjs';

const {values: options} = parseArgs({options: {poise: {type: 'string'}, web: {type: 'string'}}});
const folder = mkdtempSync(join(tmpdir(), 'poise-ground-'));
const path = (name) => join(folder, name);
const poise = poiseCaller(options.poise);
let browser;

before(async () => {
  poise('run', 'walk_stairs', '--variant', 'down', '--inline', '--duration', '24', '--out', path('stairs'));
  poise('run', 'push_double_support', '--without', 'balancing', '--inline', '--out', path('fall'));
  browser = await launchBrowser(options.web);
});

after(async () => {
  await browser?.close();
  rmSync(folder, {recursive: true, force: true});
});

/** By foot: [height of the true sole, height of what is drawn below it] of ticks in which it carries more than half of the weight. */
const standing = (page) => page.evaluate(async () => {
  const {run, scene} = window.poise;
  const {position} = scene.blocks.mesh.geometry.attributes;
  const corner = (i) => [position.getX(i), position.getY(i), position.getZ(i)];
  /** Of the drawn triangles the highest above (x, y); undefined beside them. */
  const drawn = (x, y) => {
    let height;
    for (let i = 0; i < position.count; i += 3) {
      const [a, b, c] = [corner(i), corner(i + 1), corner(i + 2)];
      const area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
      if (Math.abs(area) < 1e-9) continue;  // a wall
      const u = ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / area;
      const v = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / area;
      if (u < 0 || v < 0 || u + v > 1) continue;
      height = Math.max(height ?? -Infinity, a[2] + u * (b[2] - a[2]) + v * (c[2] - a[2]));
    }
    return height;
  };
  const column = async (name) => {
    const signal = run.signals.get(name);
    await signal.load();
    return signal.values;
  };
  const half = 0.5 * 9.80665 * run.robot.mass;
  return Promise.all([0, 1].map(async (foot) => {
    const load = await column(`ROBOT_SENSORS.foot_wrench[${foot}].force[2]`);
    const [x, y, z] = await Promise.all([0, 1, 2].map((i) => column(`GROUND_TRUTH.foot_pose[${foot}].position[${i}]`)));
    const pairs = [];
    for (let row = 0; row < load.length; row += 25) {
      if (-load[row] > half && Number.isFinite(z[row])) pairs.push([z[row], drawn(x[row], y[row]) ?? 0]);
    }
    return pairs;
  }));
});

test('stairs are drawn where the soles stand, and the view goes down with the robot', async () => {
  poise('report', path('stairs'));
  const {page, problems} = await openPage(browser, path('stairs/report.html'));
  assert.equal(await page.locator('[role=alert]').count(), 0);
  for (const pairs of await standing(page)) {
    assert.ok(pairs.length > 20);
    const lowest = Math.min(...pairs.map(([, top]) => top));
    assert.ok(lowest < -0.09, `${lowest}: it has come down no tread`);
    for (const [sole, top] of pairs) assert.ok(Math.abs(sole - top) < 0.015, `a sole at ${sole} m stands on what is drawn at ${top} m`);
  }
  assert.match(await page.locator('.blocks-key').innerText(), /as nothing stands on them/);
  assert.match(await page.locator('#header').innerText(), /variant down/);
  assert.match(await page.locator('.story').innerText(), /It walked \d+ steps/);
  assert.deepEqual(problems, []);
});

test('what led to a fall stands at the top; a run that was changed is not called the paper\'s', async () => {
  poise('report', path('fall'));
  const {page} = await openPage(browser, path('fall/report.html'));
  const header = await page.locator('#header').innerText();
  assert.match(await page.locator('.story').innerText(), /fell at .*Before it fell: at /s);
  assert.match(header, /without balancing/);
  assert.match(header, /changed from the paper's section 7\.2/);
  assert.equal(await page.evaluate(() => window.poise.scene.blocks), undefined);
});
