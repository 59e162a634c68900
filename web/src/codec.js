// Columns as logging/export/column_codec.h packs them; see docs/reference/report_format.md.

function bytesOfBase64(text) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < bytes.length; ++i) bytes[i] = binary.charCodeAt(i);
  return bytes;
}

async function inflate(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

const NOT_A_NUMBER = -0x80000000;

/** Values from inflated byte planes, into `values` (Float32Array or Float64Array). */
function decodePlanes(planes, step, order, values) {
  const n = values.length;
  if (planes.length !== 4 * n) throw new Error(`a column holds ${planes.length / 4} values, not ${n}`);
  const ints = new Int32Array(n);
  for (let i = 0; i < n; ++i) {
    const z = planes[i] | planes[n + i] << 8 | planes[2 * n + i] << 16 | planes[3 * n + i] << 24;
    ints[i] = (z >>> 1) ^ -(z & 1);
  }
  for (let k = 0; k < order; ++k) {
    for (let i = 1; i < n; ++i) ints[i] = (ints[i] + ints[i - 1]) | 0;
  }
  for (let i = 0; i < n; ++i) values[i] = ints[i] === NOT_A_NUMBER ? NaN : ints[i] * step;
  return values;
}

/** {blob, step, order} or {value} as `count` values. `blob` gives the text of an id. */
export async function unpack(packed, count, blob, integer) {
  const values = integer ? new Float64Array(count) : new Float32Array(count);
  if (packed.blob === undefined) return values.fill(packed.value ?? NaN);
  const planes = await inflate(bytesOfBase64(blob(packed.blob)));
  return decodePlanes(planes, packed.step, packed.order, values);
}
