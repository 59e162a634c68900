import assert from 'node:assert/strict';
import {test} from 'node:test';
import {deflateSync} from 'node:zlib';
import {unpack} from '../../web/src/codec.js';

/** Packs 32-bit words, as docs/reference/report_format.md says, without any arithmetic of the code under test. */
function pack(words) {
  const planes = [0, 8, 16, 24].flatMap((shift) => words.map((w) => Number((BigInt(w) >> BigInt(shift)) & 255n)));
  return deflateSync(Uint8Array.from(planes)).toString('base64');
}
const zigzag = (x) => x >= 0 ? 2 * x : -2 * x - 1;
const read = (words, step, order, integer = false) =>
  unpack({blob: 'b', step, order}, words.length, (id) => id === 'b' ? pack(words) : '', integer);

test('plain values', async () => {
  const values = [0, 1, -1, 300, -70000, 0x3fffffff];
  assert.deepEqual([...await read(values.map(zigzag), 0.5, 0, true)], values.map((v) => 0.5 * v));
});

test('first differences of a line, second of a parabola', async () => {
  assert.deepEqual([...await read([5, 3, 3, 3].map(zigzag), 1, 1)], [5, 8, 11, 14]);
  // 0, 1, 4, 9, 16: differences 0, 1, 3, 5, 7, of these 0, 1, 2, 2, 2.
  assert.deepEqual([...await read([0, 1, 2, 2, 2].map(zigzag), 0.25, 2)], [0, 1, 4, 9, 16].map((x) => x / 4));
});

test('the smallest integer is no number, also between differences', async () => {
  const least = 0xffffffff;  // zigzag of -2^31
  assert.deepEqual([...await read([zigzag(7), least], 1, 0)], [7, NaN]);
  // 1, none, 1: differences 1, -2^31 - 1 = 2^31 - 1 (modulo 2^32), 1 + 2^31 = -2^31 + 1.
  const differences = [1, 0x7fffffff, -0x7fffffff].map(zigzag);
  assert.deepEqual([...await read(differences, 2, 1)], [2, NaN, 2]);
});

test('a constant, and a column without any number', async () => {
  assert.deepEqual([...await unpack({value: 2.5}, 3, null, false)], [2.5, 2.5, 2.5]);
  assert.deepEqual([...await unpack({value: null}, 2, null, false)], [NaN, NaN]);
});

test('a column of another length is refused', async () => {
  await assert.rejects(unpack({blob: 'b', step: 1, order: 0}, 3, () => pack([1, 2]), false), /2 values, not 3/);
});
