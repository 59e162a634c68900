// `poise report` from a short run to the page in a browser.
// Usage: node report_test.mjs --poise PROGRAM --web DIR, where DIR is build/web
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {mkdirSync, mkdtempSync, readFileSync, rmSync, statSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {after, before, test} from 'node:test';
import {fileURLToPath, pathToFileURL} from 'node:url';
import {parseArgs} from 'node:util';
import {launchBrowser, openPage} from './browser.mjs';
import {readLog, writeLog} from './lcm_log.mjs';

const {values: options} = parseArgs({options: {poise: {type: 'string'}, web: {type: 'string'}}});
const folder = mkdtempSync(join(tmpdir(), 'poise-web-'));
const path = (name) => join(folder, name);
let browser;

function poise(...parameters) {
  const {status, stdout, stderr} = spawnSync(options.poise, parameters, {encoding: 'utf8'});
  return {status, stdout, stderr};
}

/** 3 s of the push of 7.2; then `poise report` of it over the arguments' run. */
before(async () => {
  const push = ['run', 'push_double_support', '--inline', '--duration', '2'];
  for (const [out, more] of [['a', []], ['b', ['--set', 'sim.push[0].duration=0.09']]]) {
    const run = poise(...push, ...more, '--out', path(out));
    assert.ok(run.status === 0 || run.status === 1, run.stderr);  // a check of the shorter run may fail
  }
  poise('report', path('a'));
  browser = await launchBrowser(options.web);
});

after(async () => {
  await browser?.close();
  rmSync(folder, {recursive: true, force: true});
});

/** A signal's values, of the page's run in this place. */
const signal = (page, name, place = 0) => page.evaluate(async ([n, k]) => {
  const s = window.poise.runs[k].signals.get(n);
  await s.load();
  return [...s.values];
}, [name, place]);

const near = (actual, expected, tolerance) =>
  assert.ok(Math.abs(actual - expected) < tolerance, `${actual} is not ${expected}`);

/** The file that a click on `locator` gives. */
async function saved(page, locator) {
  const download = page.waitForEvent('download');
  await locator.click();
  const file = await download;
  await file.saveAs(path(file.suggestedFilename()));
  return {name: file.suggestedFilename(), bytes: readFileSync(path(file.suggestedFilename()))};
}

/** Where the soles are drawn at a time, and where the simulator says they are. */
const soles = (page, time) => page.evaluate((t) => {
  const {scene, run, player} = window.poise;
  player.seek(t);
  scene.scene.updateMatrixWorld(true);
  return run.robot.feet.map((foot, f) => {
    const sole = scene.robotView.groups[foot.body].children.find((c) => c.children[0]?.geometry?.type === 'ExtrudeGeometry');
    return [sole.matrixWorld.elements.slice(12, 15), scene.samples.pose(`sole${f}`, player.tick).position];
  });
}, time);

/** Standing, for a robot whose posture is not known. */
const robotScenario = (robot) => `name: "robot_test" description: "" robot: "${robot}" duration: 0.1
  task_controller { com { kp: 225 kd: 10 } orientation { kp: 225 kd: 10 } foot { kp: 225 kd: 10 } posture { kp: 100 kd: 20 } }
  step_planner { phase { name: "stand" support: DOUBLE } }
  contact_wrench_monitor {
    double_support { half_length: 0.1 half_width: 0.05 friction: 0.9 yaw_friction: 0.9 }
    single_support { half_length: 0.1 half_width: 0.05 friction: 0.9 yaw_friction: 0.9 } }
  redistributor {
    double_support { half_length: 0.1 half_width: 0.05 friction: 0.9 yaw_friction: 0.9 }
    single_support { half_length: 0.1 half_width: 0.05 friction: 0.9 yaw_friction: 0.9 } }
  sim { start { } ground { friction: 0.9 } }
`;

const state = (page) => page.evaluate(() => {
  const {player, view, run} = window.poise;
  return {time: player.time, tick: player.tick, playing: player.playing, min: view.min, max: view.max, period: run.period};
});

test('the command prints the table, writes the page where it is told to, and says what is wrong', () => {
  const report = poise('report', path('a'));
  assert.match(report.stdout, /checks/);
  assert.match(report.stdout, /report\.html/);
  assert.ok(statSync(path('a/report.html')).size > 1e5);
  const table = poise('report', path('b'), '--no-html');
  assert.match(table.stdout, /checks/);
  assert.throws(() => statSync(path('b/report.html')));
  assert.equal(poise('report', path('a'), '--html', path('none/there.html')).status, 2);
  assert.equal(poise('report', path('a'), '--html', path('x.html'), '--no-html').status, 2);
  assert.equal(poise('report', path('a'), path('missing')).status, 2);
  assert.match(poise('report', '--help').stdout, /--html/);
});

test('the page shows the run, plays it, and needs no network', async () => {
  const summary = JSON.parse(readFileSync(path('a/summary.json'), 'utf8'));
  const {page, problems} = await openPage(browser, path('a/report.html'));
  assert.equal(await page.locator('[role=alert]').count(), 0);
  assert.equal(await page.locator('h1').innerText(), 'push_double_support');

  // The page's numbers against those that C++ worked out for the table.
  const check = (name) => summary.checks.find((c) => c.name === name).measured;
  const largest = (values) => Math.max(...values.filter((x) => !Number.isNaN(x)).map(Math.abs));
  near(largest(await signal(page, 'DERIVED.push_magnitude')), check('push_peak'), 1e-3);
  near(1e3 * largest(await signal(page, 'DERIVED.com_error[1]')), check('com_error_max_y'), 1e-3);
  near(1e3 * largest(await signal(page, 'DERIVED.cop_measured[1]')), check('cop_measured_max_y'), 1e-3);
  near(1e3 * largest(await signal(page, 'DERIVED.cop_measured[0]')), check('cop_measured_max_x'), 1e-3);
  const phases = await page.evaluate(() => window.poise.grid.shared.phases.balancing);
  near(phases[0].from, check('balancing_first'), 1e-9);
  const table = await page.locator('#tables table').first().innerText();
  for (const c of summary.checks) assert.ok(table.includes(c.label), c.label);

  // The robot: its soles stand where the simulator says they are.
  for (const [drawn, truth] of await soles(page, 0.5)) drawn.forEach((x, i) => near(x, truth[i], 1e-4));

  // Play, pause, scrub, step.
  await page.click('#play');
  await page.waitForFunction(() => window.poise.player.time > 0.6);
  await page.keyboard.press('Space');
  assert.equal((await state(page)).playing, false);
  await page.selectOption('#speed', '0.1');
  assert.equal(await page.evaluate(() => window.poise.player.speed), 0.1);
  await page.locator('#scrub').fill('300');
  assert.equal((await state(page)).tick, 300);
  await page.locator('#header').click();
  await page.keyboard.press('ArrowRight');
  assert.equal((await state(page)).tick, 301);
  await page.keyboard.press('Shift+ArrowLeft');
  assert.equal((await state(page)).tick, 251);
  assert.match(await page.locator('#time').innerText(), /0\.502 s\s+tick 251/);

  // Zoom: all plots together, by key and by dragging; a click moves the cursor.
  await page.keyboard.press('+');
  const zoomed = await state(page);
  assert.ok(zoomed.max - zoomed.min < 1.9 && zoomed.min <= zoomed.time && zoomed.time <= zoomed.max);
  await page.keyboard.press('0');
  const plots = page.locator('.panel .u-over');
  await plots.first().scrollIntoViewIfNeeded();
  await page.waitForFunction(() => document.querySelectorAll('.panel .u-over').length >= 2);
  const box = await plots.first().boundingBox();
  await page.mouse.move(box.x + 0.25 * box.width, box.y + 20);
  await page.mouse.down();
  await page.mouse.move(box.x + 0.5 * box.width, box.y + 30, {steps: 4});
  await page.mouse.up();
  const dragged = await state(page);
  near(dragged.min, 0.5, 0.02);
  near(dragged.max, 1, 0.02);
  const scales = await page.evaluate(() => window.poise.grid.panels.filter((p) => p.plot && window.poise.grid.inSight.has(p))
    .map((p) => [p.plot.scales.x.min, p.plot.scales.x.max]));
  assert.ok(scales.length >= 2);
  for (const [min, max] of scales) assert.deepEqual([min, max], [dragged.min, dragged.max]);
  await page.mouse.click(box.x + 0.5 * box.width, box.y + 20);
  near((await state(page)).time, 0.75, 0.01);

  // Search and add.
  const before = await page.locator('.panel').count();
  await page.keyboard.press('/');
  await page.keyboard.type('joint_command eta_max');
  await page.keyboard.press('Enter');
  assert.equal(await page.locator('.panel').count(), before + 1);
  assert.equal(await page.locator('.panel h3').first().innerText(), 'JOINT_COMMAND.eta_max');
  await page.fill('#signal-search', 'joint_command eta_min');
  await page.click('text=into last');
  await page.waitForFunction(() => document.querySelector('.panel .legend').children.length === 2);
  // The field before its channel; the arrow keys go on from there.
  await page.fill('#signal-search', 'TASK_TORQUE.torque');
  const offered = await page.locator('.results .name').allInnerTexts();
  assert.match(offered[0], /^TASK_TORQUE\.torque\[/);
  await page.keyboard.press('ArrowDown');
  await page.keyboard.press('ArrowDown');
  await page.keyboard.press('ArrowUp');
  await page.keyboard.press('Enter');
  assert.equal(await page.locator('.panel h3').first().innerText(), offered[1]);
  await page.fill('#signal-search', 'no such signal');
  assert.match(await page.locator('.results').innerText(), /0 signals/);
  await page.keyboard.press('Escape');

  // Save.
  const save = (panel, name) => saved(page, page.locator('.panel', {hasText: panel}).first().getByRole('button', {name}));
  const csv = await save('External push', 'Save the stretch shown as CSV');
  assert.match(csv.name, /^push-double-support-fig-9b-.*\.csv$/);
  const rows = csv.bytes.toString().trim().split('\r\n');
  assert.equal(rows[0], 'time (s),measured (N)');
  const shown = await state(page);
  near(Number(rows[1].split(',')[0]), shown.min, shown.period);
  near(Number(rows.at(-1).split(',')[0]), shown.max, shown.period);
  const png = await save('External push', 'Save as PNG');
  assert.deepEqual([...png.bytes.subarray(0, 4)], [0x89, 0x50, 0x4e, 0x47]);
  assert.ok(png.bytes.length > 3000);
  assert.equal(png.bytes.readUInt32BE(16), 1800, 'its width: two pixels for each of 900 units, whatever the screen has');

  // Latencies: all that the log's last health counted, a sample a stage and tick.
  const label = await page.locator('svg.latencies').getAttribute('aria-label');
  const download = page.waitForEvent('download');
  await page.getByRole('button', {name: 'Save the latencies as CSV'}).click();
  await (await download).saveAs(path('latency.csv'));
  const samples = {};
  for (const line of readFileSync(path('latency.csv'), 'utf8').trim().split('\r\n').slice(1)) {
    const [component, from, to, count] = line.split(',');
    assert.ok(Number(from) < Number(to), line);
    samples[component] = (samples[component] ?? 0) + Number(count);
  }
  const ticks = await page.evaluate(() => window.poise.run.numRows);
  assert.ok(Object.keys(samples).length >= 6);
  for (const [component, count] of Object.entries(samples)) {
    assert.ok(count >= ticks && count % ticks === 0, `${component}: ${count} samples of ${ticks} ticks`);
    assert.ok(label.includes(`${component}: median`), component);
  }
  const picture = page.waitForEvent('download');
  await page.getByRole('button', {name: 'Save the latencies as PNG'}).click();
  await (await picture).saveAs(path('latency.png'));
  assert.deepEqual([...readFileSync(path('latency.png')).subarray(0, 4)], [0x89, 0x50, 0x4e, 0x47]);

  // Lines added to a plot before it is built and while it is.
  const added = await page.evaluate(async () => {
    const {grid, run} = window.poise;
    const [a, b, c] = ['eta', 'eta_min', 'eta_max'].map((field) => {
      const signal = run.signals.get(`JOINT_COMMAND.${field}`);
      return {label: signal.name, role: 'computed', name: signal.name, signal};
    });
    const plot = grid.add({title: 'three lines', unit: '', added: true, series: [a]}, true);
    plot.addLine(b);
    const built = plot.show();
    plot.addLine(c);
    await built;
    await plot.building;
    const counts = [plot.lines.length, plot.plot.series.length, plot.data.length];
    grid.remove(plot);
    return counts;
  });
  assert.deepEqual(added, [3, 4, 4]);

  // Nothing of the machine's folders.
  assert.match(await page.locator('#tables').innerText(), /a\/run\.lcm/);
  assert.ok(!readFileSync(path('a/report.html'), 'utf8').includes(folder));

  // Every plot can be built.
  const lines = await page.evaluate(async () => {
    const {grid, view} = window.poise;
    view.reset();
    await Promise.all(grid.panels.map((p) => p.show()));
    return grid.panels.map((p) => [p.definition.title, p.data.slice(1).map((v) => v.some((x) => x !== null)),
      p.data.every((v) => v.every((x) => x === null || Number.isFinite(x))),
      ['x', 'y'].every((axis) => Number.isFinite(p.plot.scales[axis].min) && Number.isFinite(p.plot.scales[axis].max))]);
  });
  for (const [title, filled, finite, ranges] of lines) {
    assert.ok(filled.every(Boolean), title);
    assert.ok(finite && ranges, `${title}: not all of it is finite`);
  }
  assert.deepEqual(problems, []);
  await page.context().close();
});

test('the keys work after a click with the mouse, and a control reached by tab keeps them', async () => {
  const {page, problems} = await openPage(browser, path('a/report.html'));
  await page.evaluate(() => window.poise.printer.drawAll());
  const controls = ['.toolbar button:has-text("front")', '.toolbar input[type=checkbox]', '.toolbar label:has-text("CoP")',
    '.dock-box input', '.legend .entry', 'button[title="Remove this plot"], .events button', 'summary', '#player button:has-text("all")',
    'a.badge[href]', '#scrub'];
  for (const control of controls) {
    await page.locator(control).first().click();
    await page.evaluate(() => window.poise.player.seek(0.5));
    await page.keyboard.press('Space');
    assert.equal((await state(page)).playing, true, `space after a click on ${control}`);
    await page.keyboard.press('Space');
    assert.equal((await state(page)).playing, false, `space after a click on ${control}`);
  }
  await page.selectOption('#speed', '2');
  const keys = {ArrowRight: (s) => s.tick === 251, ArrowLeft: (s) => s.tick === 250, 'Shift+ArrowRight': (s) => s.tick === 300,
    'Shift+ArrowLeft': (s) => s.tick === 250, End: (s) => s.tick === 999, Home: (s) => s.tick === 0,
    '[': async () => await page.evaluate(() => window.poise.player.speed) === 1, ']': async () => await page.evaluate(() => window.poise.player.speed) === 2,
    '+': (s) => s.max - s.min < 1.9, '-': (s) => s.max - s.min > 1.9, '0': (s) => s.max - s.min > 1.99};
  await page.evaluate(() => window.poise.player.seek(0.5));
  for (const [key, holds] of Object.entries(keys)) {
    await page.locator('.toolbar input[type=checkbox]').first().click();
    await page.keyboard.press(key);
    assert.ok(await holds(await state(page)), key);
  }
  await page.locator('.toolbar button').first().click();
  await page.keyboard.press('/');
  assert.equal(await page.evaluate(() => document.activeElement.id), 'signal-search');
  // Writing is no command.
  await page.keyboard.type(' 0');
  assert.equal((await state(page)).playing, false);
  // By the tab key a box keeps the space bar.
  await page.locator('.toolbar input[type=checkbox]').first().focus();
  const checked = await page.locator('.toolbar input[type=checkbox]').first().isChecked();
  await page.keyboard.press('Space');
  assert.equal(await page.locator('.toolbar input[type=checkbox]').first().isChecked(), !checked);
  assert.equal((await state(page)).playing, false);
  assert.deepEqual(problems, []);
  await page.context().close();
});

/** A run's page without its picture, for tests that change none of what others look at. */
const plain = () => plain.page ??= openPage(browser, path('a/report.html'), {picture: false});

test('joints are found by name, and are named with units in the file', async () => {
  const {page} = await plain();
  await page.fill('#signal-search', 'right knee');
  const found = (await page.locator('.results .name').allInnerTexts());
  for (const name of ['JOINT_COMMAND.torque[right_knee_pitch]', 'ROBOT_STATE.joint_position[right_knee_pitch]',
    'ROBOT_STATE.joint_velocity[right_knee_pitch]']) assert.ok(found.includes(name), `${name} is not among ${found}`);
  await page.click('text=JOINT_COMMAND.torque[right_knee_pitch]');
  const panel = page.locator('.panel').first();
  assert.equal(await panel.locator('h3').innerText(), 'JOINT_COMMAND.torque[right_knee_pitch]');
  await panel.locator('.legend', {hasText: 'N·m'}).waitFor();  // the column is unpacked after the panel is there
  assert.match(await panel.locator('.legend').innerText(), /torque\[right_knee_pitch\]\s+-?[\d.]+ (m|µ)?N·m/);
  const download = page.waitForEvent('download');
  await panel.getByRole('button', {name: 'CSV'}).click();
  await (await download).saveAs(path('knee.csv'));
  assert.match(readFileSync(path('knee.csv'), 'utf8'), /^time \(s\),torque\[right_knee_pitch\] \(N·m\)\r\n/);
});

/** A run's page in a window of a width, opened once for the tests of its layout. */
async function ofWidth(width, height = 800) {
  if (!widths.has(width)) widths.set(width, await openPage(browser, path('a/report.html'), {viewport: {width, height}}));
  await widths.get(width).page.setViewportSize({width, height});
  return widths.get(width);
}
const widths = new Map();

test('values and events are on the first screen, also of a phone; of a desk the outcome, the story, the robot and a plot, too', async () => {
  for (const [width, height] of [[1400, 900], [400, 800]]) {
    const {page} = await ofWidth(width, height);
    const bar = await page.evaluate(() => document.getElementById('player').getBoundingClientRect().top);
    for (const place of ['.now h2', '.now tr', '.events h2', '.events li']) {
      const box = await page.locator(place).first().boundingBox();
      assert.ok(box.y >= 0 && box.y + box.height <= bar, `${place} at ${width} px: ${JSON.stringify(box)}`);
    }
    if (width === 400) continue;
    for (const place of ['.badge.ok, .badge.failed', '.story', '#scene canvas', '.scene-key ul', '.panel h3']) {
      const box = await page.locator(place).first().boundingBox();
      assert.ok(box.y >= 0 && box.y + box.height <= bar, `${place}: ${JSON.stringify(box)}`);
    }
    const plot = await page.locator('.plot-host').first().boundingBox();
    assert.ok(plot.y + plot.height / 2 <= bar, `the first plot: ${JSON.stringify(plot)}`);
  }
});

test('the signs are beside the picture, and fold', async () => {
  for (const width of [1400, 400]) {
    const {page} = await ofWidth(width);
    const key = page.locator('.scene-key');
    if (width === 400) assert.equal(await key.locator('ul').isVisible(), false);
    if (width === 400) await key.locator('summary').click();
    assert.equal(await key.locator('ul').isVisible(), true);
    const [signs, picture] = [await key.boundingBox(), await page.locator('#scene').boundingBox()];
    assert.ok(signs.y >= picture.y + picture.height, `at ${width} px they lie over it`);
    assert.ok(await page.evaluate(() => [...document.querySelectorAll('.scene-key li')].every((li) => li.innerText.length < 50)));
    await key.locator('summary').click();
    assert.equal(await key.locator('ul').isVisible(), false);
    assert.doesNotMatch(await page.evaluate(() => document.body.innerText), /[\u23e9-\u23fa]/, 'a sign that fonts lack');
  }
});

test('nothing covers the plots and tables, and a phone needs no second direction', async () => {
  for (const width of [1400, 1000, 400]) {
    const {page, problems} = await ofWidth(width);
    await page.evaluate(() => window.poise.printer.drawAll());
    const wide = await page.evaluate(() => [document.documentElement.scrollWidth, document.documentElement.clientWidth]);
    assert.equal(wide[0], wide[1], `at ${width} px the page is ${wide[0]} wide`);
    const docked = (on) => page.waitForFunction((d) => (document.getElementById('scene').parentElement.id === 'dock') === d, on);
    for (const place of ['#figures', '#tables']) {
      await page.evaluate((id) => document.querySelector(id).scrollIntoView({block: 'center'}), place);
      await docked(width >= 900);
      const covered = await page.evaluate(() => {
        const box = (e) => e.getBoundingClientRect();
        const scene = box(document.getElementById('scene')), bar = box(document.getElementById('player'));
        return [...document.querySelectorAll('.panel, .table')].filter((e) => {
          const b = box(e);
          return b.top < bar.top && scene.bottom > 0 && b.left < scene.right && b.right > scene.left && b.top < scene.bottom && b.bottom > scene.top;
        }).length;
      });
      assert.equal(covered, 0, `${place} at ${width} px`);
    }
    // Words of tables are whole: none is wider than its cell.
    const broken = await page.evaluate(() => [...document.querySelectorAll('.table td, .table th')].filter((cell) => {
      const style = getComputedStyle(cell);
      return style.overflowWrap === 'anywhere' || style.wordBreak !== 'normal' || cell.scrollWidth > cell.clientWidth + 1;
    }).map((cell) => cell.textContent));
    assert.deepEqual(broken, [], `at ${width} px`);
    await page.evaluate(() => scrollTo(0, 0));
    await docked(false);
    assert.deepEqual(problems, []);
    await page.context().close();
  }
});

test('a page that nobody has scrolled prints with all its plots, light', async () => {
  const {page, problems} = await openPage(browser, path('a/report.html'), {colorScheme: 'dark'});
  await page.waitForFunction(() => 'drawn' in document.documentElement.dataset);
  await page.evaluate(() => {
    addEventListener('beforeprint', () => {
      const {panels} = window.poise.grid;
      window.printed = {panels: panels.length, drawn: panels.filter((p) => p.plot).length,
        paper: getComputedStyle(document.body).backgroundColor, pictures: document.querySelectorAll('img.paper[src^="data:image/png"]').length};
    });
  });
  const pdf = await page.pdf({format: 'A4'});
  const printed = await page.evaluate(() => window.printed);
  assert.ok(printed.panels > 15 && printed.drawn === printed.panels, JSON.stringify(printed));
  assert.equal(printed.paper, 'rgb(244, 246, 249)');
  assert.equal(printed.pictures, 1);
  assert.ok((pdf.toString('latin1').match(/\/Type\s*\/Page\b/g) ?? []).length >= 4);
  // And the screen is as it was.
  assert.equal(await page.evaluate(() => document.documentElement.hasAttribute('data-paper')), false);
  assert.equal(await page.locator('img.paper').count(), 0);
  const filled = await page.evaluate(() => window.poise.grid.panels.map((p) => {
    const {width, height} = p.plot.ctx.canvas;
    return p.plot.ctx.getImageData(0, 0, width, height).data.some((x) => x !== 0);
  }));
  assert.ok(filled.every(Boolean));
  assert.deepEqual(problems, []);
  await page.context().close();
});

test('a browser without 3D has the rest of the page', async () => {
  // What Chromium does without a graphics card and without its software renderer.
  const bare = await launchBrowser(options.web, ['--disable-gpu', '--disable-3d-apis']);
  const {page} = await openPage(bare, path('a/report.html'));  // Chromium's own complaint may be in the console
  assert.equal(await page.locator('[role=alert]').count(), 0);
  assert.match(await page.locator('#scene').innerText(), /No picture of the robot: this browser has no WebGL/);
  await page.waitForFunction(() => 'drawn' in document.documentElement.dataset);
  assert.ok(await page.evaluate(() => window.poise.grid.panels.length > 15 && window.poise.grid.panels.every((p) => p.plot)));
  assert.ok(await page.locator('.events').innerText() !== '');
  const before = await page.evaluate(() => window.poise.player.time);
  await page.keyboard.press('ArrowRight');
  assert.ok(await page.evaluate(() => window.poise.player.time) > before);
  await page.pdf({format: 'A4'});
  await bare.close();
});

test('a page too small for every tick shows rows, shaded between their least and largest values', async () => {
  poise('report', path('a'), '--html', path('rows.html'), '--page-size', '0.3');
  const names = ['ROBOT_SENSORS.foot_wrench[0].force[2]', 'GROUND_TRUTH.com_position[1]', 'EXTERNAL_PUSH.force[1]',
    'JOINT_COMMAND.eta', 'SUPPORT_PLAN.in_contact[1]'];
  const full = await plain();
  const values = await full.page.evaluate((list) => Promise.all(list.map(async (name) => {
    const s = window.poise.run.signals.get(name);
    await s.load();
    return [...s.values];
  })), names);
  const {page, problems} = await openPage(browser, path('rows.html'), {picture: false});
  const {ticks, rows} = await page.evaluate(async (list) => {
    const {run} = window.poise;
    return {ticks: [...Array(run.numRows + 1).keys()].map((row) => run.tickOf(row)), rows: await Promise.all(list.map(async (name) => {
      const s = run.signals.get(name);
      await s.load();
      return {values: [...s.values], least: s.least && [...s.least], largest: s.largest && [...s.largest]};
    }))};
  }, names);
  assert.equal(ticks.at(-1), values[0].length);
  assert.ok(ticks.length - 1 < 0.8 * values[0].length);
  let wide = 0;
  rows.forEach(({values: first, least, largest}, k) => {
    // Both pages round values, to 2^-20 of a span or finer.
    const slack = 1e-6 * Math.max(...values[k].map(Math.abs));
    for (let row = 0; row < first.length; ++row) {
      const all = values[k].slice(ticks[row], ticks[row + 1]);
      near(first[row], all[0], 2 * slack + 1e-9);
      assert.ok((least ?? first)[row] <= Math.min(...all) + slack, `${names[k]}, row ${row}`);
      assert.ok((largest ?? first)[row] >= Math.max(...all) - slack, `${names[k]}, row ${row}`);
      wide += all.length > 1;
    }
  });
  assert.ok(wide > 100);
  // Near the beginning there is every tick.
  assert.deepEqual(ticks.slice(0, 100), [...Array(100).keys()]);
  const bands = await page.evaluate(async () => {
    const panel = window.poise.grid.panels.find((p) => p.definition.title.startsWith('COM motion'));
    await panel.show();
    const force = window.poise.grid.add({title: 'raw', unit: 'N', series: [{label: 'x', role: 'computed', name: 'ROBOT_SENSORS.foot_wrench[0].force[2]'}]});
    await force.show();
    return [force.plot.bands.length, force.plot.series.length, force.data.length];
  });
  assert.deepEqual(bands, [1, 4, 4]);
  assert.match(await page.locator('.rows-note').textContent(), /every tick near the run's ends/);
  await page.evaluate(() => window.poise.player.seek(window.poise.run.timeAt(window.poise.run.numRows - 1)));
  assert.match(await page.locator('#time').textContent(), /tick \d+ of \d+|tick \d+/);
  await page.keyboard.press('Home');
  await page.keyboard.press('ArrowRight');
  assert.equal((await state(page)).tick, 1);
  assert.deepEqual(problems, []);
  await page.context().close();
});

test('a part of a run is told to be one', async () => {
  const cut = poise('log', 'cut', path('a'), '--from', '0.5', '--to', '1.1', '--out', path('part.lcm'));
  assert.equal(cut.status, 0, cut.stderr);
  poise('report', path('part.lcm'));
  const {page, problems} = await openPage(browser, path('part.html'), {picture: false});
  assert.match(await page.locator('#header').innerText(), /part of a run: 0\.5 s to 1\.1/);
  const checks = await page.locator('#tables table').first().innerText();
  assert.match(checks, /simulated time at which this part of the run ends/);
  assert.doesNotMatch(checks.split('\n').find((line) => line.startsWith('simulated time')), /FAILED|ok/);
  assert.doesNotMatch(await page.locator('.events').innerText(), /before its planned end/);
  assert.match(await page.locator('.events').innerText(), /or earlier/);
  const shown = await state(page);
  near(shown.min, 0.5, 0.003);
  near(shown.time, 0.5, 0.003);
  await page.evaluate(() => window.poise.printer.drawAll());
  assert.ok(await page.evaluate(() => window.poise.grid.panels.every((p) => p.data.slice(1).some((v) => v.some((x) => x !== null)))));
  assert.deepEqual(problems, []);
  await page.context().close();
});

test('the build and its commit tell the run apart', async () => {
  const {page} = await plain();
  const spec = readFileSync(path('a/run_spec.pbtxt'), 'utf8');
  const set = /instruction_set: "([^"]+)"/.exec(spec)[1];
  const commit = /poise_commit: "([^"]*)"/.exec(spec)?.[1] ?? '';
  const header = await page.locator('#header').innerText();
  assert.ok(header.includes(set) && header.includes(commit.slice(0, 12)), header);
  const tables = await page.locator('#tables').innerText();
  assert.ok(tables.includes(set) && tables.includes(commit));
});

test('a run that grows grows in the plots, the bar and the picture', async () => {
  const {page, problems} = await openPage(browser, path('a/report.html'));
  const ticks = await page.evaluate(async () => {
    const {run, grid} = window.poise;
    await Promise.all([...run.signals.values()].map((s) => s.load()));
    await Promise.all(grid.panels.map((p) => p.show()));
    // 0.1 s more, in which every signal stays as it is, but the push, which is there again along x.
    const n = 50, last = run.numRows - 1;
    const values = {};
    for (const s of run.signals.values()) values[s.name] = new Float64Array(n).fill(s.values[last]);
    for (const name of ['EXTERNAL_PUSH.force[0]', 'DERIVED.push_magnitude']) values[name] = new Float64Array(n).fill(250);
    run.appendTicks(n, values);
    return run.numRows;
  });
  await page.locator('.panel', {hasText: 'External push'}).first().scrollIntoViewIfNeeded();
  await page.waitForFunction((n) => document.getElementById('scrub').max === String(n - 1)
    && [...window.poise.grid.inSight].some((p) => p.definition.title.startsWith('External push'))
    && [...window.poise.grid.inSight].every((p) => p.data[0].length === n), ticks);
  near((await state(page)).max, (ticks - 1) * 0.002, 1e-9);
  const push = await page.evaluate(() => {
    const panel = window.poise.grid.panels.find((p) => p.definition.title.startsWith('External push'));
    return [panel.data[1].at(-1), panel.data[1].length];
  });
  near(push[0], 250, 1);
  assert.equal(push[1], ticks);
  await page.keyboard.press('End');
  assert.equal((await state(page)).tick, ticks - 1);
  assert.ok(await page.evaluate(() => window.poise.scene.pushArrow.object.visible));
  assert.deepEqual(problems, []);
  await page.context().close();
});

test('a second run says how it ended, and is told apart from the first', async () => {
  const fell = poise('run', 'push_double_support', '--inline', '--duration', '2', '--without', 'balancing', '--set', 'sim.push[0].peak=350', '--out', path('fell'));
  assert.equal(fell.status, 1, fell.stderr);
  poise('report', path('a'), path('fell'), '-o', path('fell.html'));
  const {page, problems} = await openPage(browser, path('fell.html'), {picture: false});
  const [first, second] = await page.locator('.run-head').allInnerTexts();
  const time = /fell at ([\d.]+) s/.exec(second)[1];
  for (const text of ['second run', 'without balancing', 'sim.push[0].peak=350', 'fell', `the robot fell at ${time} s`, 'FAILED']) assert.ok(second.includes(text), text);
  assert.match(first, /first run[^]*robot dyros_legs, a, [^]*stood on both feet/);
  assert.doesNotMatch(first, /fell/);
  // Its events are a list of their own, and marks of their own on the bar.
  const lists = page.locator('.events');
  assert.equal(await lists.count(), 2);
  assert.match(await lists.nth(1).innerText(), /Events of the second run[^]*fall/);
  assert.doesNotMatch(await lists.nth(0).innerText(), /fall/);
  assert.ok(await page.locator('.track .event.second').count() > 5);
  assert.equal(await page.locator('.track .event.second.fall').count(), 1);
  // A time of the story leads there; there its event is the current one, and both runs are told side by side.
  await page.locator('.run-head.second .time-link', {hasText: `${time} s`}).first().click();
  near((await state(page)).time, Number(time), 1e-6);
  assert.match(await lists.nth(1).locator('[aria-current]').first().innerText(), new RegExp(`${time} s`));
  await page.evaluate(() => window.poise.player.seek(1.25));
  const bridge = page.locator('.readout tr', {hasText: 'bridge'}).locator('td div');
  assert.deepEqual(await bridge.allInnerTexts(), ['running', 'stopping']);
  // Curves, desired ones and limits each have a line of their own.
  const panel = page.locator('.panel', {hasText: 'COM motion, lateral'}).first();
  await panel.scrollIntoViewIfNeeded();
  await panel.locator('.legend .entry').nth(5).waitFor();
  const dashes = Object.fromEntries(await panel.locator('.entry').evaluateAll((entries) => entries.map((e) => [e.title && e.innerText.replace(/[\d.]+ mm/, '').trim(),
    e.querySelector('line').getAttribute('stroke-dasharray')])));
  const limit = await page.locator('.panel', {hasText: 'resultant in frame O (37)'}).first().locator('.entry', {hasText: 'limit'}).locator('line').getAttribute('stroke-dasharray');
  const kinds = ['estimated', 'desired', 'estimated (second run)', 'desired (second run)'].map((label) => dashes[label]);
  assert.equal(new Set([...kinds, limit]).size, 5, JSON.stringify([dashes, limit]));
  assert.deepEqual(problems, []);
  await page.context().close();
});

test('what a robot has no sensor for is told as it is observed, not as zero', async () => {
  const run = poise('run', 'stand', '--robot', 'heron/heron', '--inline', '--duration', '0.5', '--out', path('heron'));
  assert.ok(run.status <= 1, run.stderr);
  poise('report', path('heron'));
  const {page, problems} = await openPage(browser, path('heron/report.html'), {picture: false});
  await page.evaluate(() => window.poise.player.seek(0.3));
  const value = (name) => page.locator('.readout tr', {hasText: name}).locator('td').innerText();
  for (const foot of ['right', 'left']) {
    for (const load of ['observed', 'computed']) assert.match(await value(`${foot} load, ${load}`), /^\d{2,} N$/);
  }
  assert.match(await page.locator('#header').innerText(), /robot=heron\/heron[^]*robot heron/);
  assert.deepEqual(problems, []);
  await page.context().close();
});

test('the address leads to the time, the stretch and the plots that were looked at, of this run and of another', async () => {
  const {page} = await openPage(browser, path('a/report.html'), {picture: false});
  assert.equal(new URL(page.url()).hash, '');
  await page.evaluate(() => {
    window.poise.view.set(0.5, 1.2);
    window.poise.player.seek(0.75);
  });
  await page.fill('#signal-search', 'joint_command eta_max');
  await page.keyboard.press('Enter');
  await page.fill('#signal-search', 'joint_command eta_min');
  await page.click('text=into last');
  const motion = page.locator('.panel', {hasText: 'COM motion, lateral'}).first();
  await motion.scrollIntoViewIfNeeded();
  await motion.locator('.entry', {hasText: 'desired'}).click();
  await page.waitForFunction(() => /plot=.*hide=/.test(location.hash));
  const {hash} = new URL(page.url());
  assert.deepEqual(Object.fromEntries(new URLSearchParams(hash.slice(1))), {t: '0.75', from: '0.5', to: '1.2',
    plot: 'JOINT_COMMAND.eta_max JOINT_COMMAND.eta_min', hide: `desired@${await motion.locator('h3').innerText()}`});
  const seen = async () => {
    await page.waitForFunction(() => document.documentElement.dataset.ready);
    await page.evaluate(() => window.poise.printer.drawAll());
    return page.evaluate(() => {
      const {player, view, grid} = window.poise;
      const added = grid.panels.filter((p) => p.definition.added);
      return [player.time, view.min, view.max, added.map((p) => [p.element.matches(':first-child'), ...p.lines.map((line) => line.signal.name)]),
        grid.panels.flatMap((p) => p.plot.series.filter((line) => line.show === false).map((line) => line.label))];
    });
  };
  const wanted = [0.75, 0.5, 1.2, [[true, 'JOINT_COMMAND.eta_max', 'JOINT_COMMAND.eta_min']], ['desired']];
  await page.reload();
  assert.deepEqual(await seen(), wanted);
  assert.equal(new URL(page.url()).hash, hash);
  // A link within the page: what it does not tell is as at first.
  await page.evaluate(() => { location.hash = '#t=0.25'; });
  await page.waitForFunction(() => window.poise.player.time === 0.25);
  const [, min, max, added, hidden] = await seen();
  assert.ok(min === 0 && max > 1.9 && added.length === 0 && hidden.length === 0, JSON.stringify([min, max, added, hidden]));
  // A place of the page is no such address.
  await page.locator('a.badge[href]').first().click();
  assert.equal(await page.evaluate(() => window.poise.player.time), 0.25);
  // Another run takes the layout over, less what it lacks.
  poise('report', path('b'));
  await page.goto(`${pathToFileURL(path('b/report.html'))}${hash}&plot=NO_CHANNEL.here`);
  assert.deepEqual(await seen(), wanted);
  await page.context().close();
});

/** Of an SVG's text: its words, and its curves in the units of its axes' numbers, which stand at even distances. */
const readSvg = (page, text) => page.evaluate((source) => {
  const svg = new DOMParser().parseFromString(source, 'image/svg+xml').documentElement;
  const words = [...svg.querySelectorAll('text')].map((e) => ({word: e.textContent, x: Number(e.getAttribute('x')), y: Number(e.getAttribute('y')), anchor: e.getAttribute('text-anchor')}));
  const scale = (place, anchor) => {
    const numbers = words.filter((w) => w.anchor === anchor && /^-?[\d.]+$/.test(w.word)).map((w) => [w[place], Number(w.word)]);
    const [[p, a], [q, b]] = [numbers[0], numbers.at(-1)];
    return (at) => a + (at - p) * (b - a) / (q - p);
  };
  const time = scale('x', 'middle'), value = scale('y', 'end');
  return {root: svg.nodeName, words: words.map((w) => w.word), curves: [...svg.querySelectorAll('polyline')].map((line) => ({dash: line.getAttribute('stroke-dasharray'),
    points: line.getAttribute('points').split(' ').map((point) => point.split(',').map(Number)).map(([x, y]) => [time(x), value(y + 4)])}))};  // numbers stand 4 lower
}, text);

test('a plot is saved as vectors, which name run, signal and unit, and have the run\'s numbers', async () => {
  const {page} = await plain();
  const svg = await saved(page, page.locator('.panel', {hasText: 'External push'}).first().getByRole('button', {name: 'Save as SVG'}));
  assert.match(svg.name, /^push-double-support-fig-9b-external-push.*\.svg$/);
  const {root, words, curves} = await readSvg(page, svg.bytes.toString());
  assert.equal(root, 'svg');
  assert.equal(words.find((word) => word.startsWith('push_double_support:')), 'push_double_support: Fig. 9b External push, magnitude (N)');
  assert.ok(words.some((word) => /^push_double_support \(a, \d{4}-/.test(word)) && words.includes('measured'), words.join('; '));
  const force = await signal(page, 'DERIVED.push_magnitude'), most = Math.max(...force);
  assert.equal(curves.length, 1);
  for (const [time, value] of curves[0].points) {
    // Places are rounded to 0.01 units, some 3 µs and 0.01 N; a signal's time is its tick's.
    near(value, force[Math.round(time / 0.002)], 2e-3 * most);
  }
  near(Math.max(...curves[0].points.map(([, value]) => value)), most, 1e-3 * most);
});

test('the picture is saved as PNG, and as a video while the run plays', async () => {
  const {page, problems} = await openPage(browser, path('a/report.html'));
  await page.evaluate(() => window.poise.player.seek(1.8));
  const png = await saved(page, page.locator('#scene button', {hasText: 'PNG'}));
  assert.equal(png.name, 'push-double-support-1.800-s.png');
  const width = await page.evaluate(() => document.getElementById('scene').clientWidth);
  assert.equal(png.bytes.readUInt32BE(16), 2 * width);
  const colors = await page.evaluate(async (data) => {
    const image = Object.assign(new Image(), {src: `data:image/png;base64,${data}`});
    await image.decode();
    const pen = new OffscreenCanvas(image.width, image.height).getContext('2d');
    pen.drawImage(image, 0, 0);
    return new Set(new Uint32Array(pen.getImageData(0, 0, image.width, image.height).data.buffer)).size;
  }, png.bytes.toString('base64'));
  assert.ok(colors > 500, `${colors} colours: no robot`);
  await page.evaluate(() => {  // 5 s: a busy machine draws some of them
    window.poise.player.setSpeed(0.1);
    window.poise.player.seek(1.5);
  });
  const video = await saved(page, page.locator('#scene button', {hasText: 'Video'}));
  assert.match(video.name, /^push-double-support-.* ?s\.webm$/);
  assert.equal((await state(page)).time, await page.evaluate(() => window.poise.run.end));
  // The browser's own player sees it move.
  const cinema = await page.context().newPage();  // the run's own page may load nothing
  const seen = await cinema.evaluate(async (data) => {
    const film = Object.assign(document.createElement('video'), {muted: true, src: `data:video/webm;base64,${data}`});
    const pictures = new Set();
    let size;
    await new Promise((done, failed) => {
      film.onerror = () => failed(film.error);
      film.onended = done;
      const look = () => {
        size = [film.videoWidth, film.videoHeight];
        const pen = new OffscreenCanvas(...size).getContext('2d');
        pen.drawImage(film, 0, 0);
        pictures.add(pen.getImageData(0, 0, ...size).data.reduce((sum, x, i) => (sum * 31 + x * (i % 7)) | 0, 0));
        film.requestVideoFrameCallback(look);
      };
      film.requestVideoFrameCallback(look);
      film.play();
    });
    return {size, pictures: pictures.size};
  }, video.bytes.toString('base64'));
  assert.ok(seen.pictures > 1 && seen.size[0] >= width / 2, JSON.stringify(seen));
  assert.equal(await page.locator('#scene button', {hasText: 'Video'}).textContent(), 'Video');
  assert.deepEqual(problems, []);
  await page.context().close();
});

test('a browser that records no video says why', async () => {
  const context = await browser.newContext();
  await context.addInitScript(() => { delete window.MediaRecorder; });
  const page = await context.newPage();
  await page.goto(pathToFileURL(path('a/report.html')).href);
  const button = page.locator('#scene button', {hasText: 'Video'});
  await button.waitFor();
  assert.equal(await button.isDisabled(), true);
  assert.match(await button.getAttribute('title'), /has no MediaRecorder/);
  await context.close();
});

test('any number of runs are drawn over the first', async () => {
  poise('run', 'push_double_support', '--inline', '--duration', '1', '--set', 'sim.push[0].duration=0.3', '--out', path('c'));
  assert.ok(poise('report', path('a'), path('b'), path('c'), '-o', path('three.html')).status <= 1);
  const {page, problems} = await openPage(browser, path('three.html'), {colorScheme: 'dark'});
  const first = await signal(page, 'EXTERNAL_PUSH.force[1]');
  const [second, third] = await Promise.all([1, 2].map((k) => signal(page, 'EXTERNAL_PUSH.force[1]', k)));
  const end = (values) => values.findLastIndex((x) => x > 20);
  assert.ok(end(second) < end(first) && end(first) < end(third));  // the pushes' lengths
  const panel = page.locator('.panel', {hasText: 'External push'}).first();
  await panel.scrollIntoViewIfNeeded();
  await panel.locator('.legend .entry').nth(2).waitFor();
  assert.match(await panel.locator('.legend').innerText(), /second run[^]*third run/);
  // Saved, each curve stands under its run's name.
  const {words, curves} = await readSvg(page, (await saved(page, panel.getByRole('button', {name: 'Save as SVG'}))).bytes.toString());
  const names = words.slice(words.findIndex((word) => word.startsWith('first run:')));
  for (const [i, pattern] of [/^first run: push_double_support \(a, /, /^measured$/, /^second run: push_double_support, sim\.push\[0\]\.duration=0\.09 \(b, /,
    /^measured \(second run\)$/, /^third run: push_double_support, sim\.push\[0\]\.duration=0\.3 \(c, /, /^measured \(third run\)$/].entries()) assert.match(names[i], pattern);
  assert.equal(new Set(curves.map(({dash}) => dash)).size, 3);
  await page.evaluate(() => window.poise.player.seek(0.8));
  const apart = await page.evaluate(() => {
    const {scene} = window.poise;
    return scene.ghosts.map(({view}) => view.object.position.distanceTo(scene.robotView.object.position));
  });
  assert.ok(apart.length === 2 && apart.every((d) => d > 0.002), `the ghosts stand ${apart} m away`);
  // Each run is told of as the first is: in the header, the events, the checks and its own table.
  assert.deepEqual(await page.locator('.which').allInnerTexts(), ['first run', 'second run', 'third run']);
  assert.equal(await page.locator('.run-head .story').count(), 3);
  assert.match(await page.locator('.events').nth(2).innerText(), /^Events of the third run/);
  const checks = page.locator('#tables table').first();
  assert.deepEqual((await checks.locator('th').allInnerTexts()).slice(0, 4), ['what', 'measured', 'second run', 'third run']);
  assert.match(await page.locator('#tables').innerText(), /The second run[^]*The third run/);
  // The third run has ended by then: its numbers are not those of its end.
  await page.evaluate(() => window.poise.player.seek(1.5));
  const told = await page.locator('.readout tr', {hasText: 'bridge'}).locator('td div').allInnerTexts();
  assert.equal(told.length, 3);
  assert.equal(told[0], 'running');
  assert.notEqual(told[2], 'running');
  assert.deepEqual(problems, []);
  await page.context().close();
});

test('a log with gaps, with numbers that are none, and with hostile names is shown all the same', async () => {
  const name = 'push_double_support';
  const hostile = "</script><b>&'</b>x";
  assert.equal(hostile.length, name.length);
  const events = readLog(path('a/run.lcm'));
  let info = events[0].data.toString('latin1').replaceAll(`"${name}"`, `"${hostile}"`);
  events[0].data = Buffer.from(info, 'latin1');
  const counts = {};
  const kept = events.filter((event) => {
    const tick = counts[event.channel] = (counts[event.channel] ?? -1) + 1;
    if (event.channel === 'JOINT_COMMAND' && tick === 40) event.data.writeDoubleBE(NaN, event.data.length - 200);
    return !(event.channel === 'ROBOT_SENSORS' && tick >= 100 && tick < 150)
      && !(event.channel === 'GROUND_TRUTH' && tick % 3 === 0) && event.channel !== 'BRIDGE_STATUS';
  });
  writeLog(path('damaged.lcm'), kept);
  assert.equal(poise('report', path('damaged.lcm')).status, 1);
  const {page, problems} = await openPage(browser, path('damaged.html'));
  assert.equal(await page.locator('h1').innerText(), hostile);
  const measured = await signal(page, 'ROBOT_SENSORS.foot_wrench[0].force[2]');
  assert.deepEqual([99, 100, 149, 150].map((i) => Number.isNaN(measured[i])), [false, true, true, false]);
  await page.evaluate(async () => {
    const {grid, player, run} = window.poise;
    await Promise.all(grid.panels.map((p) => p.show()));
    for (let tick = 90; tick < 160; ++tick) player.seek(tick * run.period);
  });
  assert.deepEqual(problems, []);
  await page.context().close();
});

test('a log that ends before its first tick, or after it, is a page too', async () => {
  const events = readLog(path('a/run.lcm'));
  const second = events.findIndex((e, i) => i > 1 && e.channel === events[1].channel);
  for (const [name, count] of [['none', 1], ['one', second]]) {
    writeLog(path(`${name}.lcm`), events.slice(0, count));
    assert.equal(poise('report', path(`${name}.lcm`)).status, 1);
    const {page, problems} = await openPage(browser, path(`${name}.html`));
    assert.equal(await page.evaluate(() => window.poise.run.numRows), count === 1 ? 0 : 1);
    assert.equal(await page.locator('[role=alert]').count(), 0);
    await page.click('#play');
    await page.keyboard.press('ArrowRight');
    assert.deepEqual(problems, []);
    await page.context().close();
  }
});

test('robots of other shapes, and with meshes only, are drawn where they stand', async () => {
  const sources = fileURLToPath(new URL('../../', import.meta.url));
  mkdirSync(path('robot'));
  const urdf = readFileSync(join(sources, 'deploy/robots/dyros/dyros_legs.urdf'), 'utf8');
  const shapes = ['<cylinder radius="0.06" length="0.36"/>', '<sphere radius="0.1"/>', '<mesh filename="none.stl"/>',
    '<box size="1 2"/>', '<box size="0.1 nan 0.1"/>', '<box/>', '<cylinder radius="-1" length="1"/>', ''];
  let k = 0;
  const box = /(<visual>\s*<origin[^>]*>\s*<geometry>)(<box [^>]*>)/g;
  const boxes = urdf.match(box).length;
  writeFileSync(path('robot/dyros_legs.urdf'), urdf.replace(box, (_, before, old) => before + (shapes[k++] ?? old)));
  writeFileSync(path('robot/robot.pbtxt'), readFileSync(join(sources, 'deploy/robots/dyros/dyros_legs.pbtxt')));
  writeFileSync(path('meshes.pbtxt'), robotScenario(join(sources, 'tests/robot/data/mantis.pbtxt')));
  for (const [name, scenario] of [['shapes', ['push_double_support', '--duration', '0.1', '--set', `robot=${path('robot/robot.pbtxt')}`]],
    ['meshes', [path('meshes.pbtxt')]]]) {
    const run = poise('run', ...scenario, '--inline', '--out', path(name));
    assert.ok(run.status === 0 || run.status === 1, run.stderr);
    poise('report', path(name));
    const {page, problems} = await openPage(browser, path(`${name}/report.html`));
    const visuals = await page.evaluate(() => window.poise.run.robot.visuals.map((v) => v.shape));
    if (name === 'meshes') {
      assert.equal(visuals.length, 0);
    } else {
      assert.equal(visuals.length, boxes - shapes.length + 2 + 1);  // a foot without shows what it collides with
      for (const shape of ['cylinder', 'sphere', 'box']) assert.ok(visuals.includes(shape), shape);
    }
    const drawn = await page.evaluate(() => {
      let meshes = 0;
      window.poise.scene.robotView.object.traverse((o) => { meshes += o.isMesh ? 1 : 0; });
      return meshes;
    });
    assert.ok(drawn > 12, `${drawn} shapes`);
    for (const time of [0, 0.1]) {
      for (const [sole, truth] of await soles(page, time)) sole.forEach((x, i) => near(x, truth[i], 1e-4));
    }
    assert.deepEqual(problems, []);
    await page.context().close();
  }
});
