// What the page of charts works out of its data, against figures found by hand.
import assert from 'node:assert/strict';
import {test} from 'node:test';
import {chartOf, colorOf, commandOf, layersOf, linesOf, ticksTo} from '../../web/src/charts/data.js';

/** `rows`: [at, outcome, values]. */
function part(variables, values, maps, rows, more = {}) {
  return {name: 'part', kind: 'sweep', command: 'poise run push', variables, maps, values: values.map((name) => ({name, label: `the ${name}`, unit: 'mm'})),
    rows: rows.map(([at, outcome, numbers], run) => ({run, at, outcome, told: outcome, values: numbers, set: ` --set a=${at[0]}`})), ...more};
}
const layers = (...parts) => layersOf(parts.map((p) => ({parts: [p]})))[0];
const force = {name: 'force', unit: 'N'};

test('what fell ruins no scale, and a mean is of the runs that stand', () => {
  const data = part([force, {name: 'seed', unit: ''}], ['error'], [{x: 0, value: 0}], [
    [[50, 1], 'stands', [1]], [[50, 2], 'stands', [2]], [[100, 1], 'stands', [5]], [[100, 2], 'fell', [1e6]],
    [[150, 1], 'fell', [1e7]], [[150, 2], 'hung', [null]], [[200, 1], 'crashed', [null]]]);
  const chart = chartOf(layers(data), data.maps[0]);
  assert.deepEqual(chart.marks.map((m) => [m.x, m.state, m.value]), [[50, 'value', 1.5], [100, 'value', 5], [150, 'fell', undefined], [200, 'untold', undefined]]);
  assert.deepEqual(chart.range, [1.5, 5]);
  assert.equal(chart.title, 'The error');
  assert.equal(chart.marks[1].someFell, true);
  assert.deepEqual(linesOf(chart.marks[1], chart, (v, unit) => `${v} ${unit}`), ['2 runs', '1 did not stand', 'the error: mean 5 mm']);
});

test('a share is between 0 and 1, of the runs that tell', () => {
  const data = part([force], [], [{x: 0}], [[[50], 'stands', []], [[50], 'missed', []], [[50], 'hung', []], [[50], 'stands', []], [[50], 'fell', []]]);
  const chart = chartOf(layers(data), data.maps[0]);
  assert.equal(chart.marks[0].value, 0.5);
  assert.ok(chart.share);
  assert.equal(colorOf(chart, 0), '#d55e00');  // Okabe and Ito's vermilion and blue
  assert.equal(colorOf(chart, 1), '#0072b2');
});

test('cells stand at the values that there are, coloured from the least to the largest', () => {
  const data = part([force, {name: 'law', unit: '', choices: ['paper', 'capture']}], ['error'], [{x: 0, y: 1, value: 0}],
    [[[200, 0], 'stands', [3]], [[50, 1], 'stands', [7]], [[200, 1], 'fell', [1e9]]]);
  const chart = chartOf(layers(data), data.maps[0]);
  assert.equal(chart.kind, 'cells');
  assert.deepEqual(chart.x.texts, ['50', '200']);
  assert.deepEqual(chart.y.texts, ['capture', 'paper']);  // upwards: the first on top
  assert.deepEqual(chart.marks.map((m) => [m.x, m.y]), [[1, 1], [0, 0], [1, 0]]);
  assert.equal(colorOf(chart, 3), '#440154');  // viridis' ends
  assert.equal(colorOf(chart, 7), '#fde725');
});

test('limits of other variables are told apart, and an angle is polar whichever variable it is', () => {
  const direction = {name: 'direction', unit: '°', angle: true}, law = {name: 'law', unit: '', choices: ['paper', 'capture']};
  const limit = part([direction, law], ['limit'], [{x: 0, value: 0}], [[[0, 0], 'stands', [100]], [[0, 1], 'stands', [120]], [[90, 0], 'unknown', [null]]], {kind: 'limit'});
  const chart = chartOf(layers(limit), limit.maps[0]);
  assert.ok(chart.polar);
  assert.deepEqual(chart.series, [[0, 'paper'], [0, 'capture']]);
  assert.equal(chart.marks[2].state, 'untold');
  const map = part([force, direction], [], [{x: 0, y: 1}], [[[50, 90], 'stands', []]]);
  const polar = chartOf(layers(map), map.maps[0]);
  assert.deepEqual([polar.polar, polar.x.label, polar.marks[0].x, polar.y.texts], [true, 'direction [°]', 90, ['50']]);
});

test('what was drawn at random is a place each', () => {
  const data = part([{...force, drawn: true}, {name: 'height', unit: 'm', drawn: true}], [], [{x: 0, y: 1}], [[[1.5, 0.2], 'stands', []], [[2.5, 0.3], 'fell', []]]);
  const chart = chartOf(layers(data), data.maps[0]);
  assert.deepEqual([chart.kind, chart.marks.map((m) => [m.x, m.y, m.value])], ['places', [[1.5, 0.2, 1], [2.5, 0.3, 0]]]);
});

test('two sets are laid over each other by names, in whatever order they have them', () => {
  const law = (choices) => ({name: 'law', unit: '', choices});
  const a = part([force, law(['paper', 'capture'])], ['error', 'torque'], [{x: 1, value: 0}], [[[50, 0], 'stands', [1, 9]]]);
  const b = part([law(['capture', 'paper', 'mine']), force], ['torque', 'error'], [], [[[1, 50], 'stands', [9, 4]], [[2, 50], 'stands', [9, 5]]]);
  const chart = chartOf(layers(a, b), a.maps[0]);
  assert.deepEqual(chart.x.texts, ['paper', 'capture', 'mine']);
  assert.deepEqual(chart.marks.map((m) => [m.set, m.x, m.value]), [[0, 0, 1], [1, 0, 4], [1, 2, 5]]);
  // A set without the quantity is left out.
  assert.deepEqual(chartOf(layers(a, part([force], ['error'], [], [[[50], 'stands', [4]]])), a.maps[0]).marks.length, 1);
  // Two benchmarks meet in the parts that have one name.
  const of = (...names) => ({parts: names.map((name) => ({...a, name}))});
  assert.deepEqual(layersOf([of('push', 'late'), of('late', 'soft')]).map((l) => l.map(({set, part: {name}}) => [set, name])),
    [[[0, 'push']], [[0, 'late'], [1, 'late']], [[1, 'soft']]]);
});

test('a run has its command unless it cannot be run', () => {
  const data = part([force], [], [], [[[50], 'stands', []]]);
  assert.equal(commandOf(data, data.rows[0]), 'poise run push --set a=50');
  assert.equal(commandOf(data, {run: 1}), '');
});

test('rings are at round numbers', () => {
  assert.deepEqual(ticksTo(287), [100, 200]);
  assert.deepEqual(ticksTo(1), [0.5, 1]);
  assert.deepEqual(ticksTo(0.132), [0.05, 0.1]);
});
