import assert from 'node:assert/strict';
import {test} from 'node:test';
import {deflateSync} from 'node:zlib';
import {Run} from '../../web/src/data.js';
import {figuresFor, panelOf, pitchJoints} from '../../web/src/figures.js';
import {addBatch, decodeBatch, LiveFeed} from '../../web/src/live/live.js';
import {liveText} from '../../web/src/bar.js';
import {findPhases} from '../../web/src/phases.js';
import {searchSignals} from '../../web/src/search.js';
import {formatNumber, leastSpan, limitedEnd, paddedRange, quantity, scaled, withUnit} from '../../web/src/units.js';
import {makeRun, messages, robot, valuesOf} from './fixture.mjs';

const near = (actual, expected, message) => assert.ok(Math.abs(actual - expected) < 1e-6, message ?? `${actual} is not ${expected}`);

test('units, texts and names of values come from the .lcm files', () => {
  const run = makeRun('7.2');
  const signal = (name) => run.signals.get(name);
  assert.equal(signal('ROBOT_STATE.base_position[1]').unit, 'm');
  assert.equal(signal('JOINT_COMMAND.foot_wrench[0].moment[2]').unit, 'N·m');
  assert.equal(signal('GROUND_TRUTH.foot_pose[1].position[2]').unit, 'm');
  assert.equal(signal('ROBOT_SENSORS.imu_acceleration[0]').unit, 'm/s²');
  assert.equal(signal('SUPPORT_PLAN.status').valueNames[2], 'waiting');
  assert.match(signal('JOINT_COMMAND.eta').text, /share of the right foot/);
  assert.equal(messages.health_t.fields.latency_p99.unit, 'µs');
  assert.equal(messages.drive_feedback_t.fields.current.unit, 'A');
  assert.equal(messages.joint_command_t.fields.margins.unit, '');  // "of foot_wrench"
});

test('every section of the paper gets its figures', () => {
  const wanted = {
    '7.1': ['6', '7'], '7.2': ['9a', '9b', '10a', '10b', '11a', '11b', '11c', '11d', '12a', '12b', '12c', '12d'],
    '7.3': ['14a', '14b', '14c', '15a', '15b', '15c', '15d'], '7.4': ['16a', '17'],
    '7.5': ['19a', '19b', '20a', '20b', '21', '22a', '22b', '23a', '23b', '23c', '23d', '24a', '24b', '24c', '24d'],
  };
  for (const [section, numbers] of Object.entries(wanted)) {
    const figures = figuresFor(makeRun(section));
    assert.deepEqual([...new Set(figures.map((f) => f.figure).filter(Boolean))], numbers, `section ${section}`);
    for (const f of figures) assert.ok(f.series.length > 0 && f.unit !== undefined, f.title);
  }
});

test("a run's lead lies before the scenario's time 0", () => {
  const run = makeRun('7.2');
  run.leadTicks = 3;
  near(run.start, -0.006);
  near(run.timeAt(3), 0);
  assert.deepEqual([-0.006, 0, 0.0019].map((time) => run.rowAt(time)), [0, 3, 3]);
  assert.equal(run.signals.get('GROUND_TRUTH.crane_force[2]').unit, 'N');
});

test('conditions have a red limit, another scenario gets the general figures', () => {
  const figures = figuresFor(makeRun('7.2'));
  for (const f of figures.filter((x) => /^1[0-2]/.test(x.figure ?? ''))) {
    assert.ok(f.series.some((s) => s.role === 'limit'), f.title);
  }
  assert.equal(figuresFor(makeRun('section 7.3, without balancing'))[0].figure, '14a');
  const others = figuresFor(makeRun(''));
  assert.ok(others.length > 15);
  assert.ok(others.every((f) => !f.figure));
});

test('loads of feet without sensors are called observed', () => {
  const labels = (run) => figuresFor(run).flatMap(({series}) => series).filter(({type, field}) => type === 'derived.signals_t' &&
    /load_measured|ratio_measured|cop_measured/.test(field)).map(({label}) => label);
  const sensed = labels(makeRun('7.2')), switchedOff = labels(makeRun('7.2', {}, 4, undefined, {sim: {foot_sensors: false}}));
  const bare = makeRun('7.2');
  bare.robot = {...bare.robot, feet: bare.robot.feet.map((foot) => ({...foot, force_sensor: false}))};
  assert.ok(sensed.length >= 12 && sensed.every((label) => label.endsWith('measured')), `${sensed}`);
  assert.deepEqual(switchedOff, sensed.map((label) => label.replace('measured', 'observed')));
  assert.deepEqual(labels(bare), switchedOff);
});

test('a run without ground truth and push keeps the figures that it can show', () => {
  const run = makeRun('7.2', {}, 4, undefined, {}, ['ground_truth_t', 'external_push_t']);
  for (const name of [...run.signals.keys()]) if (/^DERIVED.*(true|push|_error)/.test(name)) run.signals.delete(name);
  const figures = figuresFor(run);
  assert.ok(figures.some((f) => f.figure === '9a'));
  assert.ok(!figures.some((f) => f.figure === '9b'));
});

test('the estimator\'s errors have a bound where the run has one', () => {
  const bound = (run) => figuresFor(run).find((f) => f.title === 'Estimator: velocity error').series.find((s) => s.role === 'limit');
  const run = makeRun('7.2');
  assert.ok(bound(run));
  run.signals.delete('DERIVED.base_velocity_bound');
  assert.equal(bound(run), undefined);
});

test('pitch joints are found by their axis', () => {
  assert.deepEqual(pitchJoints(robot, 0), [0]);
  assert.deepEqual(pitchJoints(robot, 1), []);
  // A roll axis turned by a quarter about z is a pitch axis.
  const q = Math.SQRT1_2;
  const turned = {...robot, bodies: robot.bodies.map((b, i) => i === 2 ? {...b, origin: {position: [0, 0, 0],
    orientation: [q, 0, 0, q]}} : b)};
  assert.deepEqual(pitchJoints(turned, 0), [0, 1]);
});

test('a run grows by ticks', async () => {
  const run = makeRun('', {}, 0);
  let appended = 0;
  run.addEventListener('append', () => { ++appended; });
  for (let k = 0; k < 5; ++k) {
    run.appendTicks(700, {'EXTERNAL_PUSH.force[0]': new Float32Array(700).fill(3), 'EXTERNAL_PUSH.force[1]': new Float32Array(700).fill(4 * k)});
  }
  assert.equal(appended, 5);
  assert.equal(run.numRows, 3500);
  const push = await valuesOf(run, 'EXTERNAL_PUSH.force[1]');
  assert.equal(push.length, 3500);
  assert.deepEqual([push[699], push[700], push[3499]], [0, 4, 16]);
  assert.ok(Number.isNaN((await valuesOf(run, 'PLANNER_STATUS.phase'))[10]));
  run.appendTicks(1, {});
  assert.equal((await valuesOf(run, 'DERIVED.push_magnitude')).length, 3501);
});

test('phases of a run, and of one that grows', async () => {
  const run = makeRun('', {'support_plan_t.in_contact[0]': 1, 'balance_torque_t.active_y': 1});
  const phases = await findPhases(run);
  assert.deepEqual(phases.support, [{from: 0, to: 4 * 0.002, value: 'right foot'}]);
  assert.deepEqual(phases.balancing, [{from: 0, to: 4 * 0.002, value: true}]);
  assert.deepEqual(phases.missing, []);
});

test('a missed message changes no phase, a long gap is known as one', async () => {
  const run = makeRun('', {}, 0);
  const phases = await findPhases(run);
  const add = (n, right, left, active = 0) => {
    const fill = (x) => new Float64Array(n).fill(x);
    run.appendTicks(n, right === undefined ? {} : {'SUPPORT_PLAN.in_contact[0]': fill(right), 'SUPPORT_PLAN.in_contact[1]': fill(left),
      'BALANCE_TORQUE.active_x': fill(0), 'BALANCE_TORQUE.active_y': fill(active)});
    phases.update();
  };
  const ticks = (list) => list.map(({from, to, value}) => [Math.round(from / 0.002), Math.round(to / 0.002), value]);
  add(10, 1, 1);
  add(3);  // missed
  assert.deepEqual(ticks(phases.support), [[0, 13, 'both feet']]);
  add(10, 1, 1, 1);
  add(2);
  add(5, 1, 0, 0);
  assert.deepEqual(ticks(phases.support), [[0, 25, 'both feet'], [25, 30, 'right foot']]);
  assert.deepEqual(ticks(phases.balancing), [[13, 25, true]]);
  assert.deepEqual(phases.missing, []);
  add(60);  // 0.12 s
  add(5, 1, 1);
  assert.deepEqual(ticks(phases.support), [[0, 25, 'both feet'], [25, 30, 'right foot'], [90, 95, 'both feet']]);
  assert.deepEqual(ticks(phases.missing), [[30, 90, undefined]]);
});

test('phases of a live run begin with what it keeps', async () => {
  const run = makeRun('', {}, 0, {keep: 100});
  const phases = await findPhases(run);
  for (let k = 0; k < 4; ++k) {
    run.appendTicks(50, {'SUPPORT_PLAN.in_contact[0]': new Float64Array(50).fill(1), 'SUPPORT_PLAN.in_contact[1]': new Float64Array(50).fill(k % 2)});
    phases.update();
  }
  assert.deepEqual(phases.support.map(({from, to, value}) => [Math.round(from / 0.002), Math.round(to / 0.002), value]),
    [[100, 150, 'right foot'], [150, 200, 'both feet']]);
});

test('quantities have units with prefixes', () => {
  for (const [value, unit, text] of [[7.656e-6, 'm', '7.656 µm'], [-0.0351, 'm', '-35.1 mm'], [1.5, 'm', '1.5 m'], [1234, 'N', '1.234 kN'],
    [0.00099999, 'm', '1 mm'], [0, 'N', '0 N'], [NaN, 'N', '–'], [Infinity, 'm', '–'], [250000, 'µs', '250 ms'], [0.5, '', '0.5'], [12.345678, '%', '12.35 %'],
    [3e-9, 'rad', '3 nrad'], [2e-4, 'N·m', '200 µN·m'], [5e-14, 'm', '5e-5 nm']]) {
    assert.equal(quantity(value, unit), text);
  }
  assert.equal(quantity([0.0123, -0.000456, NaN], 'm', 3), '12.3, -0.5, – mm');
  assert.deepEqual(scaled(0.02, 'm'), {unit: 'mm', factor: 1000});
  assert.equal(withUnit(12.3, 'mm'), '12.3 mm');
  assert.equal(withUnit(7.656e-6, 'mm'), '7.656 nm');
  assert.equal(withUnit(31, ''), '31');
  assert.equal(formatNumber(-Infinity), '–');
});

test('a plot\'s range holds its data and no noise fills it', () => {
  const holds = ([low, high], a, b) => low <= a && b <= high;
  const noise = paddedRange(-2e-5, 2e-5, leastSpan('m'));
  assert.ok(noise[1] - noise[0] >= 5e-4 && holds(noise, -2e-5, 2e-5));
  for (const [a, b] of [[0, 0], [3, 3], [-1e-5, 4], [0, 1e-4], [-500, -499.9], [1e6, 1e6]]) {
    const range = paddedRange(a, b, leastSpan('N'));
    assert.ok(holds(range, a, b) && range[1] - range[0] >= 5, `${range} of ${a}, ${b}`);
    if (a === 0) assert.ok(range[0] > -0.5, `${range} of what is never negative`);
  }
  assert.deepEqual(paddedRange(Infinity, -Infinity, 5), [0, 5]);
  assert.deepEqual(paddedRange(null, null, 0), [0, 1]);
  const exact = paddedRange(1e-9, 2e-9, 0);
  assert.ok(exact[1] - exact[0] < 2e-9);
});

test('a ratio beyond any sense does not flatten what led to it', () => {
  assert.equal(limitedEnd(3000, [0.05, 0.05, NaN]), 0.25);
  assert.equal(limitedEnd(0.1, [0.05]), 0.1, 'nothing is added');
  assert.equal(limitedEnd(3000, []), 3000, 'without a limit all is shown');
});

test('signals of joints and feet have their names', () => {
  const signals = [...makeRun('').signals.values()];
  const titles = (query) => searchSignals(signals, query).map((s) => s.title);
  for (const title of ['JOINT_COMMAND.torque[ankle_roll]', 'ROBOT_STATE.joint_position[ankle_roll]', 'ROBOT_STATE.joint_velocity[ankle_roll]',
    'GROUND_TRUTH.joint_torque[ankle_roll]', 'DRIVE_FEEDBACK.current[ankle_roll]', 'DERIVED.torque_share[ankle_roll]']) {
    assert.ok(titles('ankle').includes(title), title);
  }
  assert.deepEqual(titles('robot_sensors left force 2'), ['ROBOT_SENSORS.foot_wrench[left].force[2]']);
  assert.deepEqual(titles('ROBOT_STATE.joint_position[1]'), ['ROBOT_STATE.joint_position[ankle_roll]']);
  assert.equal(panelOf(signals.find((s) => s.name === 'JOINT_COMMAND.torque[0]')).series[0].label, 'torque[hip_pitch]');
});

test('a part of a run begins where it was cut', async () => {
  const whole = makeRun('7.2', {'support_plan_t.in_contact[0]': 1}, 10);
  const {meta} = whole;
  const ticks = {blob: 'ticks', step: 1, order: 0};
  const zigzag = deflateSync(Uint8Array.from([...[7, 8, 9].map((x) => 2 * x), ...new Array(9).fill(0)])).toString('base64');
  const part = new Run({...meta, run: {...meta.run, ticks: 10, cut: {first_tick: 7, last_tick: 9}},
    channels: meta.channels.map((c) => ({...c, count: 3, ticks}))}, messages, () => zigzag);
  assert.deepEqual([part.firstTick, part.numRows, part.start, part.rowAt(0.016)], [7, 3, 0.014, 1]);
  assert.deepEqual(await valuesOf(part, 'SUPPORT_PLAN.in_contact[0]'), [1, 1, 1]);
  assert.ok([...part.channels].every((c) => !c.sparse));
  assert.deepEqual((await findPhases(part)).support, [{from: 0.014, to: 0.02, value: 'right foot'}]);
  assert.match(figuresFor(part).find((f) => f.figure === '9a').note, /0\.014 s/);
  assert.doesNotMatch(figuresFor(whole).find((f) => f.figure === '9a').note, / s,/);
});

/** A run of 1,004 ticks of 2 ms, 4 of which stand before time 0, in rows: 4 of one tick, 8 of up to 100, 5, 2 of up to 100. */
function rowsRun(columns = {}) {
  const whole = makeRun('7.2', {'support_plan_t.in_contact[0]': 1, 'support_plan_t.in_contact[1]': 1}, 10);
  const {meta} = whole;
  return new Run({...meta, run: {...meta.run, ticks: 1004, lead_ticks: 4}, rows: [[0, 1, 4], [4, 100, 8], [804, 1, 5], [809, 100, 2]],
    channels: meta.channels.map((c) => ({...c, count: 1004, signals: c.signals.map((s) => ({...s, ...columns[`${c.name}.${s.field}`]}))}))},
  messages, () => { throw new Error('no packed column here'); });
}

test('rows of several ticks are found by time, and times by row', () => {
  const run = rowsRun();
  assert.equal(run.numRows, 19);
  const ticks = [0, 1, 2, 3, 4, 104, 204, 304, 404, 504, 604, 704, 804, 805, 806, 807, 808, 809, 909];
  assert.deepEqual(ticks.map((_, row) => run.tickOf(row)), ticks);
  for (let tick = 0; tick < 1004; ++tick) {
    const row = ticks.findLastIndex((first) => first <= tick);
    assert.equal(run.rowOfTick(tick), row, `tick ${tick}`);
    assert.equal(run.rowOf((tick - 4) * 0.002), row, `tick ${tick}`);
  }
  assert.deepEqual([0, 3, 4, 11, 12, 18].map((row) => run.strideOf(row)), [1, 1, 100, 100, 1, 100]);
  near(run.start, -0.008);
  near(run.end, 1.81);
  assert.ok(run.rowOf(-1) < 0 && run.rowOf(5) >= run.numRows);
  assert.deepEqual([run.rowAt(-1), run.rowAt(5)], [0, 18]);
});

test('a row of several ticks has bounds', async () => {
  const run = rowsRun({'BALANCE_TORQUE.active_x': {least: {value: 0}, largest: {value: 1}},
    'ROBOT_SENSORS.foot_wrench[0].force[2]': {value: -50, least: {value: -60.5}, largest: {value: -40}}});
  const force = run.signals.get('ROBOT_SENSORS.foot_wrench[0].force[2]');
  await force.load();
  assert.deepEqual([force.values.length, force.least[5], force.largest[18]], [19, -60.5, -40]);
  const bare = run.signals.get('ROBOT_SENSORS.foot_wrench[1].force[2]');
  await bare.load();
  assert.equal(bare.least, undefined);
  // Balancing was on in some tick of each row, and its last row's end is not known to be before the run's.
  const {balancing, support} = await findPhases(run);
  assert.deepEqual(balancing.map((p) => p.value), [true]);
  near(balancing[0].from, -0.008);
  assert.deepEqual(support.map((p) => p.value), ['both feet']);
  near(support[0].to, 2);
});

test('the search finds signals by all words of name and text', () => {
  const signals = [...makeRun('').signals.values()];
  const names = (query) => searchSignals(signals, query).map((s) => s.name);
  assert.deepEqual(names('joint command eta max'), ['JOINT_COMMAND.eta_max']);
  assert.deepEqual(names('ROBOT_STATE.base_position[2]'), ['ROBOT_STATE.base_position[2]']);
  assert.ok(names('gyro bias').length === 0 && names('robot state imu bias').length === 3);
  assert.ok(names('peak current').length === 0);
  assert.deepEqual(names('   '), []);
  assert.equal(names('force').length, names('FORCE').length);
});

test('a live run keeps its last ticks', async () => {
  const run = makeRun('', {}, 0, {keep: 1500});
  const ramp = (first, n) => Float32Array.from({length: n}, (_, i) => first + i);
  for (const [first, n] of [[0, 700], [700, 700], [1400, 7], [1407, 2000], [3407, 33]]) {
    run.appendTicks(n, {'EXTERNAL_PUSH.force[0]': ramp(first, n), 'DERIVED.com_motion[1]': ramp(first, n)});
  }
  assert.deepEqual([run.firstTick, run.numRows], [1940, 1500]);
  near(run.start, 3.88);
  near(run.end, 6.878);
  assert.deepEqual([run.rowAt(0), run.rowAt(4), run.rowAt(100)], [0, 60, 1499]);
  const ticks = Array.from({length: 1500}, (_, i) => 1940 + i);
  for (const name of ['EXTERNAL_PUSH.force[0]', 'DERIVED.com_motion[1]']) assert.deepEqual(await valuesOf(run, name), ticks, name);
});

/** A batch as docs/reference/report_format.md says, every number telling its column and tick. */
function batchOf(run, first, count, {end = first + count, time = 0} = {}) {
  const signals = [...run.signals.values()];
  const integers = signals.filter((s) => s.integer), reals = signals.filter((s) => !s.integer);
  const buffer = new ArrayBuffer(32 + count * (8 * integers.length + 4 * reals.length));
  const data = new DataView(buffer);
  data.setUint32(0, 2, true);
  data.setUint32(4, count, true);
  [first, end, time].forEach((x, i) => data.setFloat64(8 + 8 * i, x, true));
  let at = 32;
  integers.forEach((_, k) => { for (let i = 0; i < count; ++i, at += 8) data.setFloat64(at, 1e6 * k + first + i, true); });
  reals.forEach((_, k) => { for (let i = 0; i < count; ++i, at += 4) data.setFloat32(at, 1000 * k + first + i, true); });
  return {buffer, name: reals[3].name};
}

test('batches of the stream: in order, with a gap, sent twice, damaged', async () => {
  const run = makeRun('', {}, 0, {keep: 100});
  const add = (first, count) => {
    const {buffer, name} = batchOf(run, first, count);
    addBatch(run, decodeBatch(buffer, run));
    return valuesOf(run, name);
  };
  assert.deepEqual(await add(40, 3), [3040, 3041, 3042]);
  assert.equal(run.firstTick, 40);
  assert.deepEqual(await add(42, 3), [3040, 3041, 3042, 3043, 3044]);
  assert.deepEqual(await add(41, 2), [3040, 3041, 3042, 3043, 3044]);
  assert.deepEqual(await add(47, 1), [3040, 3041, 3042, 3043, 3044, NaN, NaN, 3047]);
  const values = await add(5000, 2);
  assert.deepEqual([values.length, run.firstTick, values.at(-3), values.at(-2), values.at(-1)], [100, 4902, NaN, 8000, 8001]);
  const {buffer} = batchOf(run, 5002, 2);
  for (const damaged of [buffer.slice(0, 8), buffer.slice(0, 32), buffer.slice(0, -4), new ArrayBuffer(buffer.byteLength)]) {
    assert.throws(() => decodeBatch(damaged, run));
  }
});

/** A feed of `run` whose server is this test: its socket, and what `answer(tick)` says of earlier ticks. */
function fakeFeed(t, run, answer) {
  let socket;
  const asked = [];
  t.after(() => { for (const name of ['WebSocket', 'location', 'fetch']) delete globalThis[name]; });
  globalThis.location = {href: 'http://127.0.0.1:1/?token=ab'};
  globalThis.WebSocket = class extends EventTarget { constructor() { super(); socket = this; } };
  globalThis.fetch = async (url) => {
    const query = new URL(url, location.href).searchParams;
    assert.equal(query.get('token'), 'ab');
    asked.push(Number(query.get('before')));
    return {arrayBuffer: async () => answer(asked.at(-1))};
  };
  const feed = new LiveFeed(run);
  const come = (data) => socket.dispatchEvent(Object.assign(new Event('message'), {data}));
  const text = (more) => come(JSON.stringify({run_id: run.meta.run.run_id, state: 'live', lost: 0, end_tick: 0, ...more}));
  return {feed, come, text, asked};
}

const settled = async (condition) => { while (!condition()) await new Promise((done) => { setTimeout(done, 1); }); };

test('a page begins with what is new, and what was before comes behind it', async (t) => {
  const run = makeRun('', {}, 0, {keep: 2000});
  const error = run.signals.get('DERIVED.com_error[2]');
  // The server holds ticks from 100 on, and gives 50 at a time.
  const {feed, come, text, asked} = fakeFeed(t, run, (before) => {
    const first = Math.max(100, Math.min(before, 5000) - 50);
    return batchOf(run, first, Math.max(0, before - first)).buffer;
  });
  text();
  come(batchOf(run, 1000, 10).buffer);
  assert.deepEqual([run.firstTick, run.numRows], [1000, 10], 'at once what is new');
  await settled(() => feed.missing === 0);
  assert.deepEqual(asked.slice(0, 2), [1000, 950]);
  assert.deepEqual([run.firstTick, run.numRows], [100, 910]);
  const {name} = batchOf(run, 0, 1);
  const all = () => [...run.signals.get(name).values];
  assert.deepEqual(all(), Array.from({length: 910}, (_, i) => 3100 + i), 'every tick in its row');
  assert.equal(error.values.length, 910);
  assert.ok(error.values.every((x) => !Number.isNaN(x)), 'of every signal');
  // A server that leaves out what it could not send in time: the page shows what is new, then has all of it.
  come(batchOf(run, 1300, 10).buffer);
  assert.equal(run.firstTick + run.numRows, 1310);
  await settled(() => feed.missing === 0);
  assert.deepEqual(all(), Array.from({length: 1210}, (_, i) => 3100 + i));
  assert.deepEqual([error.values.length, error.values.filter(Number.isNaN).length], [1210, 0]);
  // No more than it keeps.
  come(batchOf(run, 4000, 10).buffer);
  await settled(() => feed.missing === 0);
  assert.deepEqual([run.firstTick, run.numRows], [2010, 2000]);
  assert.deepEqual(all(), Array.from({length: 2000}, (_, i) => 5010 + i));
});

test('a page is live when it shows what is, and else says how far it is behind', (t) => {
  const run = makeRun('', {}, 0, {keep: 2000});
  let now = 50;
  t.mock.method(performance, 'now', () => 1000 * now);
  const {feed, come, text} = fakeFeed(t, run, () => batchOf(run, 0, 0).buffer);
  text();
  assert.doesNotMatch(liveText(feed)[1], /live|behind/, 'nothing has come yet');
  come(batchOf(run, 0, 10, {time: 7}).buffer);  // another clock
  assert.deepEqual(liveText(feed), ['live', '● live']);
  now += 2;
  assert.deepEqual(liveText(feed), ['behind', '◐ 2.0 s behind'], 'nothing comes');
  come(batchOf(run, 10, 10, {time: 7.5}).buffer);  // 1.5 s on its way
  assert.deepEqual(liveText(feed), ['behind', '◐ 1.5 s behind']);
  come(batchOf(run, 20, 10, {time: 9, end: 1030}).buffer);  // at once, but the server has 1000 ticks more, 2 s
  assert.deepEqual(liveText(feed), ['behind', '◐ 2.0 s behind']);
  come(batchOf(run, 30, 1000, {time: 9}).buffer);
  assert.deepEqual(liveText(feed), ['live', '● live']);
  // A run that waits is shown as it is, however long; one that is made again is neither.
  text({control: {run: {paused: true, tick: 1030, again: -1}, acts: []}});
  now += 60;
  assert.deepEqual(liveText(feed), ['live', '● live']);
  text({control: {run: {paused: true, tick: 1030, again: 500}, acts: []}});
  assert.deepEqual(liveText(feed), ['again', '○ made again, up to 1.000 s']);
  text({state: 'ended', end_tick: 1030});
  assert.match(liveText(feed)[1], /ended/);
});

test('which torques are drawn is told', () => {
  const panelOfLeg = (run) => figuresFor(run).find(({title}) => title === 'Torques of the right leg, of their limits');
  for (const [gone, words] of [[[], /true torque/], [['ground_truth_t'], /as the bridge ordered it/],
    [['ground_truth_t', 'bridge_status_t'], /commanded torque, without stiffness/]]) {
    assert.match(panelOfLeg(makeRun('', {}, 4, undefined, {}, gone)).note, words);
  }
});

test('the search finds the field before its channel, and units before counts', () => {
  const signals = [...makeRun('').signals.values()];
  const first = (query) => searchSignals(signals, query)[0].name;
  assert.equal(first('TASK_TORQUE.torque'), 'TASK_TORQUE.torque[0]');
  assert.equal(first('torque'), searchSignals(signals, 'torque')[0].name);
  assert.match(first('torque'), /\.torque/);
  assert.equal(first('eta'), 'JOINT_COMMAND.eta');
  assert.equal(first('com_error 1'), 'DERIVED.com_error[1]');
  const ankle = searchSignals(signals, 'ankle_roll');
  assert.ok(ankle[0].unit && ankle[0].channel.type !== 'drive_feedback_t', ankle[0].name);
  const counts = ankle.findIndex((s) => s.field.startsWith('position_counts'));
  assert.ok(counts > ankle.findIndex((s) => s.name === 'ROBOT_STATE.joint_position[1]'));
});

test('values that are read have a finest', () => {
  for (const [value, unit, text] of [[3e-9, 'm', '0.00 mm'], [0.145, 'N', '0 N'], [189.1234, 'N', '189 N'], [1234.4, 'N', '1.234 kN'], [-0.0347149, 'm', '-34.71 mm'],
    [0.26, 'm', '260 mm'], [1.5, 'm', '1.5 m'], [2e-4, 'N·m', '0.0 N·m'], [-2e-7, 'rad', '0.00 mrad'], [0.35, 's', '350 ms'], [0, 'N', '0 N'], [7.123456, 'mm', '7.12 mm'],
    [0.5, '', '0.5'], [12.345678, '%', '12.35 %'], [NaN, 'm', '–']]) {
    assert.equal(quantity(value, unit, 4, true), text);
  }
  assert.equal(quantity([0, -0.00267e-9, 0], 'm', 3, true), '0.00, 0.00, 0.00 mm');
  assert.equal(quantity([0.0347, -2e-6, NaN], 'm', 3, true), '34.7, 0, – mm');
});

test('a page says that the run has ended once its last tick has come', (t) => {
  let socket;
  t.after(() => { for (const name of ['WebSocket', 'location']) delete globalThis[name]; });
  globalThis.location = {href: 'http://127.0.0.1:1/'};
  globalThis.WebSocket = class extends EventTarget { constructor() { super(); socket = this; } };
  const run = makeRun('', {}, 0, {keep: 100});
  const feed = new LiveFeed(run);
  const come = (data) => socket.dispatchEvent(Object.assign(new Event('message'), {data}));
  const text = (state, end) => come(JSON.stringify({run_id: run.meta.run.run_id, state, lost: 0, end_tick: end}));
  text('live', 0);
  come(batchOf(run, 0, 3).buffer);
  assert.equal(feed.state, 'live');
  text('ended', 5);  // it overtakes the ticks
  assert.equal(feed.state, 'live');
  come(batchOf(run, 3, 2).buffer);
  assert.equal(feed.state, 'ended');
  text('live', 5);  // an interactive run went back
  come(batchOf(run, 5, 2).buffer);
  assert.equal(feed.state, 'live');
});
