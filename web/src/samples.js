// Signals of a run by the names that a picture has for them.

/** Numbers by row that the picture needs, all loaded; a name that the run lacks is NaN. */
export class Samples {
  #signals = new Map();

  async load(run, wanted) {
    const found = Object.entries(wanted).map(([name, [type, field]]) => [name, run.find(type, field)])
      .filter(([, signal]) => signal);
    this.#signals = new Map(found);
    await Promise.all(found.map(([, s]) => s.load()));
  }

  at(name, row) { return this.#signals.get(name)?.values?.[row] ?? NaN; }
  vector(name, row, n = 3) { return Array.from({length: n}, (_, i) => this.at(`${name}[${i}]`, row)); }
  pose(name, row) {
    return {position: this.vector(`${name}.position`, row), orientation: this.vector(`${name}.orientation`, row, 4)};
  }
}

export const vector = (key, type, field, n = 3) =>
  Object.fromEntries(Array.from({length: n}, (_, i) => [`${key}[${i}]`, [type, `${field}[${i}]`]]));
export const pose = (key, type, field) => ({...vector(`${key}.position`, type, `${field}.position`),
  ...vector(`${key}.orientation`, type, `${field}.orientation`, 4)});
