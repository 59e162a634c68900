import assert from 'node:assert/strict';
import {test} from 'node:test';
import {BLOCK_CORNERS, blockRise, blockTop, convexHull, rotate} from '../../web/src/spatial.js';

const close = (a, b) => a.forEach((x, i) => assert.ok(Math.abs(x - b[i]) < 1e-12, `${a} is not ${b}`));

/** Unit quaternion about an axis. */
function about(axis, angle) {
  const n = Math.hypot(...axis);
  return [Math.cos(angle / 2), ...axis.map((x) => x / n * Math.sin(angle / 2))];
}

test('quarter turns', () => {
  close(rotate(about([0, 0, 1], Math.PI / 2), [1, 0, 0]), [0, 1, 0]);
  close(rotate(about([1, 0, 0], Math.PI / 2), [0, 1, 0]), [0, 0, 1]);
  close(rotate(about([0, 1, 0], Math.PI / 2), [0, 0, 1]), [1, 0, 0]);
});

test('the hull of a square with points inside and on its edges is the square, anticlockwise', () => {
  const hull = convexHull([[1, 1], [0, 0], [0.5, 0.5], [1, 0], [0.5, 0], [0, 1], [0.2, 0.9]]);
  assert.deepEqual(hull, [[0, 0], [1, 0], [1, 1], [0, 1]]);
});

test('a block comes at its start and rises with minimum jerk', () => {
  const block = {start: 12, rise: 2};
  assert.equal(blockRise(block, 11.999), undefined);
  assert.equal(blockRise(block, 12), 0);
  assert.ok(Math.abs(blockRise(block, 13) - 0.5) < 1e-12);
  assert.equal(blockRise(block, 14), 1);
  assert.equal(blockRise(block, 20), 1);
  // At rest at both ends, fastest in the middle: 15/8 of the mean speed.
  const speed = (time) => (blockRise(block, time + 1e-5) - blockRise(block, time - 1e-5)) / 2e-5;
  for (const time of [12.0001, 13.9999]) assert.ok(speed(time) < 1e-6);
  assert.ok(Math.abs(speed(13) - 15 / 8 / block.rise) < 1e-6);
  assert.equal(blockRise({start: 12, rise: 0}, 12), 1);
});

test("the top of a block lies in its tilted plane", () => {
  const block = {length: 0.4, width: 0.3, height: 0.05, tilt_roll: 0.1, tilt_pitch: -0.2};
  const normal = rotate(about([0, 1, 0], block.tilt_pitch), rotate(about([1, 0, 0], block.tilt_roll), [0, 0, 1]));
  for (const rise of [0, 0.3, 1]) {
    blockTop(block, rise).forEach((z, k) => {
      const [i, j] = BLOCK_CORNERS[k];
      const fromCenter = [i * block.length / 2, j * block.width / 2, z - block.height * rise];
      assert.ok(Math.abs(normal.reduce((sum, n, a) => sum + n * fromCenter[a], 0)) < 1e-12);
    });
  }
});
