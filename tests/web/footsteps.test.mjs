import assert from 'node:assert/strict';
import {test} from 'node:test';
import {apart, Footprints, plannedAt, regionsAt} from '../../web/src/footsteps.js';
import {makeRun} from './fixture.mjs';

/** A live run of so many ticks: the right foot's prints begin at ticks `begins`, a metre apart; the left one's at tick 5. */
async function walked(ticks, begins, keep = 1000) {
  const run = makeRun('', {}, 0, {keep});
  const footprints = new Footprints(run);
  await footprints.load();
  const print = (foot, t) => (foot === 1 ? [5] : begins).filter((begin) => begin <= t);
  for (let from = 0; from < ticks; from += 7) {
    const count = Math.min(7, ticks - from), values = {};
    const put = (name, f) => { values[`DERIVED.${name}`] = Float32Array.from({length: count}, (_, i) => f(from + i)); };
    for (const foot of [0, 1]) {
      put(`foot[${foot}].print_time`, (t) => (print(foot, t).at(-1) ?? NaN) * run.period);
      put(`foot[${foot}].print_position[0]`, (t) => (print(foot, t).length || NaN) + (t % 2) * 0.001);
    }
    run.appendTicks(count, values);
    footprints.update();
  }
  return {run, footprints};
}
const begun = ({run, footprints}) => footprints.list.map(({foot, from}) => [foot, Math.round(from / run.period)]);

test('footprints are those that the run tells, in order, each as it was last', async () => {
  const all = await walked(130, [0, 102]);
  assert.deepEqual(begun(all), [[0, 0], [1, 5], [0, 102]]);
  const {run, footprints} = all;
  assert.deepEqual(footprints.list.map(({pose}) => Math.round(1000 * pose.position[0])), [1001, 1001, 2001]);
  assert.deepEqual(footprints.until(30 * run.period, 10).map((print) => print.foot), [0, 1]);
  assert.deepEqual(footprints.until(102 * run.period, 1).map((print) => print.foot), [0]);
});

test('a live run that lets go of ticks keeps its footprints, and one that starts anew loses them', async () => {
  const all = await walked(130, [0, 102], 10);
  assert.equal(all.footprints.list.length, 3);
  all.run.restart();
  all.footprints.update();
  assert.equal(all.footprints.list.length, 0);
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
