// Numbers in rows, of which the first are let go as others come.

const LEAST = 1024;
const SPARE = 1.25;  // of the rows kept: how seldom they are moved

export class Column {
  #array;
  #start = 0;
  #length;

  /** Takes `array`, a Float32Array or Float64Array. */
  constructor(array) {
    this.#array = array;
    this.#length = array.length;
  }

  get values() { return this.#array.subarray(this.#start, this.#start + this.#length); }

  /** Makes room for `count` rows at the beginning, of NaN. */
  prepend(count) {
    const array = new this.#array.constructor(count + this.#length).fill(NaN, 0, count);
    array.set(this.values, count);
    this.#array = array;
    this.#start = 0;
    this.#length = array.length;
  }

  /** Other values in the rows from `row` on. */
  set(row, values) { this.#array.set(values, this.#start + row); }

  /** Adds `values` at the end and lets go of the first `dropped`. `keep`: the most rows that there will be. */
  append(values, dropped = 0, keep = Infinity) {
    const length = this.#length + values.length;
    if (this.#start + length > this.#array.length) {
      const capacity = Math.max(LEAST, length, Math.min(2 * length, Math.ceil(SPARE * keep)));
      const room = this.#array.length >= capacity ? this.#array : new this.#array.constructor(capacity);
      room.set(this.values);
      this.#array = room;
      this.#start = 0;
    }
    this.#array.set(values, this.#start + this.#length);
    this.#start += dropped;
    this.#length = length - dropped;
  }
}
