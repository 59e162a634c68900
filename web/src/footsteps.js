// Where the feet stood, where they are to come down, and from where steps bring the COM to rest: of a run's signals alone.
import {DERIVED} from './figures.js';
import {Samples, vector} from './samples.js';

const COVERED = 0.04;  // m between two prints of a foot of which one would hide the other
export const FOOTSTEPS = 'steps.footsteps_t';
export const PLANNED = 3;  // footholds, at the most
const CORNERS = 16;        // of a region, at the most
export const REGIONS = 3;  // for 0, 1 and 2 steps

/** The footprints of a run, in order: {foot, from, pose}, as lcmtypes/derived/foot_t.lcm says; `from`: s. */
export class Footprints {
  #samples = new Samples();
  #next = 0;     // tick
  #last = [];    // by foot
  #restarts = 0;

  constructor(run) {
    this.run = run;
    this.list = [];
  }

  async load() {
    await this.#samples.load(this.run, Object.assign({}, ...this.run.robot.feet.map((_, f) => ({
      [`from${f}`]: [DERIVED, `foot[${f}].print_time`], ...vector(`print${f}.position`, DERIVED, `foot[${f}].print_position`),
      ...vector(`print${f}.orientation`, DERIVED, `foot[${f}].print_orientation`, 4),
    }))));
    this.update();
  }

  /** Takes the ticks that have come. */
  update() {
    const {run} = this;
    if (run.restarts !== this.#restarts) {
      this.#restarts = run.restarts;
      this.list = [];
      this.#last = [];
      this.#next = 0;
    }
    let row = Math.max(0, run.rowOfTick(this.#next));
    if (run.tickOf(row) < this.#next) ++row;
    for (; row < run.numRows; ++row) run.robot.feet.forEach((_, f) => this.#take(f, row));
    if (run.numRows > 0) this.#next = run.tickOf(run.numRows - 1) + 1;
  }

  #take(foot, row) {
    const from = this.#samples.at(`from${foot}`, row);
    if (Number.isNaN(from)) return;
    if (this.#last[foot]?.from !== from) {
      this.list.push(this.#last[foot] = {foot, from});
      this.list.sort((a, b) => a.from - b.from);  // the first row's stand since before it
    }
    this.#last[foot].pose = this.#samples.pose(`print${foot}`, row);
  }

  /** Of those that had begun at a time the last `count`. */
  until(time, count) {
    const end = this.list.findLastIndex(({from}) => from <= time + this.run.period / 2) + 1;
    return this.list.slice(Math.max(0, end - count), end);
  }
}

/** Those that can be told apart: of prints of one foot that nearly cover each other, as of one that slides or steps on the spot, the last. */
export function apart(prints) {
  const kept = [];
  for (const print of [...prints].reverse()) {
    const covers = ({foot, pose: {position: [x, y]}}) => foot === print.foot && Math.hypot(x - print.pose.position[0], y - print.pose.position[1]) < COVERED;
    if (!kept.some(covers)) kept.unshift(print);
  }
  return kept;
}

/** What FOOTSTEPS says: the names under which Samples has it. */
export const plannedSignals = () => ({
  planned: [FOOTSTEPS, 'planned'],
  ...Object.assign({}, ...['foot', 'x', 'y', 'z', 'yaw', 'touch_down'].map((field) => vector(`planned_${field}`, FOOTSTEPS, field, PLANNED))),
  stance: [FOOTSTEPS, 'stance'], region_height: [FOOTSTEPS, 'height'],
  ...vector('region_corners', FOOTSTEPS, 'corners', REGIONS),
  ...vector('region_x', FOOTSTEPS, 'region_x', REGIONS * CORNERS), ...vector('region_y', FOOTSTEPS, 'region_y', REGIONS * CORNERS),
});

/** A count of a message, whatever it holds. */
const upTo = (most, count) => (count > 0 ? Math.min(most, count) : 0);

/** [{foot, position, yaw, touchDown}], the step under way first. */
export function plannedAt(samples, row) {
  return Array.from({length: upTo(PLANNED, samples.at('planned', row))}, (_, i) => ({
    foot: samples.at(`planned_foot[${i}]`, row), yaw: samples.at(`planned_yaw[${i}]`, row),
    position: ['x', 'y', 'z'].map((axis) => samples.at(`planned_${axis}[${i}]`, row)),
    touchDown: samples.at(`planned_touch_down[${i}]`, row),
  }));
}

/** By number of steps the region's corners, [x, y, z]; [] where there is none. */
export function regionsAt(samples, row) {
  const stands = samples.at('stance', row) >= 0;
  return Array.from({length: REGIONS}, (_, steps) => {
    const count = stands ? samples.at(`region_corners[${steps}]`, row) : 0;
    return Array.from({length: upTo(CORNERS, count)}, (__, i) => [samples.at(`region_x[${steps * CORNERS + i}]`, row),
      samples.at(`region_y[${steps * CORNERS + i}]`, row), samples.at('region_height', row)]);
  });
}
