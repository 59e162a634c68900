import assert from 'node:assert/strict';
import {test} from 'node:test';
import {apart, Footprints, plannedAt, regionsAt} from '../../web/src/footsteps.js';
import {makeRun} from './fixture.mjs';

const ORIENTATION = [1, 0, 0, 0];

/** A live run of so many ticks; `tick(t)`: [contact, load, x] of the right foot. The left one stands at y = 1 all the time. */
function walked(ticks, tick, keep = 1000) {
  const run = makeRun('', {}, 0, {keep});
  const footprints = new Footprints(run);
  const add = (from, to) => {
    const values = {};
    const put = (name, f) => { values[name] = Float32Array.from({length: to - from}, (_, i) => f(from + i)); };
    for (const foot of [0, 1]) {
      put(`SUPPORT_PLAN.in_contact[${foot}]`, (t) => (foot === 1 ? 1 : tick(t)[0]));
      put(`ROBOT_STATE.foot_wrench[${foot}].force[2]`, (t) => -(foot === 1 ? 60 : tick(t)[1]));
      [0, 1, 2].forEach((axis) => put(`GROUND_TRUTH.foot_pose[${foot}].position[${axis}]`,
        (t) => [foot === 1 ? 0 : tick(t)[2], foot, 0][axis]));
      ORIENTATION.forEach((q, i) => put(`GROUND_TRUTH.foot_pose[${foot}].orientation[${i}]`, () => q));
    }
    run.appendTicks(to - from, values);
    footprints.update();
  };
  return footprints.load().then(() => {
    for (let t = 0; t < ticks; t += 7) add(t, Math.min(t + 7, ticks));
    return {run, footprints};
  });
}

// The robot weighs 98 N: the foot stands from tick 0, swings from 20, touches with a bounce from 100 on, and lies from 110 on.
const swing = (t) => {
  if (t < 20) return [1, 50, 0.1];
  if (t < 100) return [0, 3, 0.1 + 0.0025 * (t - 20)];
  if (t < 102) return [1, 0, 0.3];  // in the plan's contact, and not on the ground yet
  if (t < 104) return [1, 10, 0.31];
  if (t < 110) return [0, 0, 0.32];
  return [1, 50, 0.32];
};

// It carries before the plan says so, and slides later.
const slide = (t) => [t < 10 ? 0 : 1, 50, t < 50 ? 0 : 0.0011 * (t - 50)];

test('a footprint is where a foot stood firmly, from when it carried to when it left', async () => {
  const {run, footprints} = await walked(130, swing);
  const right = footprints.list.filter((print) => print.foot === 0);
  assert.equal(right.length, 2);
  assert.deepEqual(right.map((print) => Math.round(print.from / run.period)), [0, 102]);
  assert.deepEqual(right.map((print) => (print.to === undefined ? undefined : Math.round(print.to / run.period))), [19, undefined]);
  right.forEach((print, i) => assert.ok(Math.abs(print.pose.position[0] - [0.1, 0.32][i]) < 1e-6));
  assert.equal(footprints.list.filter((print) => print.foot === 1).length, 1);
  assert.deepEqual(footprints.until(30 * run.period, 10).map((print) => print.foot), [0, 1]);
  assert.deepEqual(footprints.until(1, 1).map((print) => print.from), [102 * run.period]);
});

test('a foot stands as soon as it carries, whatever the plan says, and leaves more footprints where it slides', async () => {
  const {run, footprints} = await walked(100, slide);
  const right = footprints.list.filter((print) => print.foot === 0);
  assert.deepEqual(right.map((print) => Math.round(print.from / run.period)), [0, 69, 88]);
  right.slice(1).forEach((print) => assert.ok(print.pose.position[0] > 0.02));
});

test('a live run that lets go of ticks keeps its footprints, and one that starts anew loses them', async () => {
  const {run, footprints} = await walked(130, swing, 10);
  assert.equal(footprints.list.length, 3);
  run.restart();
  footprints.update();
  assert.equal(footprints.list.length, 0);
});

test('regions and planned footholds are what the message says', async () => {
  const type = 'steps.footsteps_t';
  const square = [[-1, -1], [1, -1], [1, 1], [-1, 1]];
  const constants = {[`${type}.planned`]: 2, [`${type}.foot[0]`]: 1, [`${type}.x[0]`]: 0.4, [`${type}.yaw[1]`]: 0.2, [`${type}.stance`]: 0,
    [`${type}.touch_down[1]`]: 1.5, [`${type}.height`]: 0.05};
  [0.1, 0.3, 0.6].forEach((size, steps) => {
    constants[`${type}.corners[${steps}]`] = 4;
    square.forEach(([x, y], i) => {
      constants[`${type}.region_x[${16 * steps + i}]`] = size * x;
      constants[`${type}.region_y[${16 * steps + i}]`] = size * y;
    });
  });
  const run = makeRun('', constants);
  const {Samples} = await import('../../web/src/samples.js');
  const {plannedSignals} = await import('../../web/src/footsteps.js');
  const samples = new Samples();
  await samples.load(run, plannedSignals());
  assert.deepEqual(plannedAt(samples, 1).map((step) => [step.foot, step.position[0], step.yaw, step.touchDown]),
    [[1, Math.fround(0.4), 0, 0], [0, 0, Math.fround(0.2), 1.5]]);
  const regions = regionsAt(samples, 1);
  assert.deepEqual(regions.map((region) => region[2]), 
    [[0.1, 0.1, 0.05], [0.3, 0.3, 0.05], [0.6, 0.6, 0.05]].map((corner) => corner.map(Math.fround)));
});

test('a message with more footholds and corners than it has room for shows those that it has', async () => {
  const type = 'steps.footsteps_t';
  const run = makeRun('', {[`${type}.planned`]: 127, [`${type}.stance`]: 1, [`${type}.corners[0]`]: 127, [`${type}.corners[1]`]: -1});
  const {Samples} = await import('../../web/src/samples.js');
  const {plannedSignals} = await import('../../web/src/footsteps.js');
  const samples = new Samples();
  await samples.load(run, plannedSignals());
  assert.equal(plannedAt(samples, 0).length, 3);
  assert.deepEqual(regionsAt(samples, 0).map((region) => region.length), [16, 0, 0]);
});

test('of prints that would hide each other the last is drawn', () => {
  const print = (foot, from, x) => ({foot, from, pose: {position: [x, 0.1 * foot, 0]}});
  // The left foot slides by 25 mm at a time, the right one steps on the spot and then ahead.
  const prints = [print(1, 0, 0), print(0, 0, 0), print(1, 1, 0.025), print(0, 2, 0.001), print(1, 3, 0.05), print(0, 4, 0.2), print(1, 5, 0.075)];
  assert.deepEqual(apart(prints).map(({foot, from}) => [foot, from]), [[1, 1], [0, 2], [0, 4], [1, 5]]);
  assert.equal(prints.length, 7);
});
