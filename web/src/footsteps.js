// Where the feet stood, where they are to come down, and from where steps bring the COM to rest: of a run's signals alone.
import {Samples, pose, vector} from './samples.js';

const BOUNCE = 0.1;  // s without a load that leave a footprint what it is
const SLID = 0.02;   // m, from above, that make it another one
const ROLLED = 0.01;  // m that its centre is higher than when it first stood firmly: it rolls off
const COVERED = 0.04;  // m between two prints of a foot of which one would hide the other
const LIGHT = 0.05, FIRM = 0.25;  // of the weight, of a foot that stands where it is planned to; of one that stands firmly
const GRAVITY = 9.80665;  // m/s²
export const FOOTSTEPS = 'steps.footsteps_t';
export const PLANNED = 3;  // footholds, at the most
const CORNERS = 16;        // of a region, at the most
export const REGIONS = 3;  // for 0, 1 and 2 steps

/**
 * The footprints of a run, in order: {foot, from, to, pose}. A foot stands while it carries something: 5 % of the weight where the plan
 * has it in contact, else a quarter; `to` is undefined while it still does. `pose` is its sole's in the last of these ticks in which
 * it carried a quarter and lay flat (if in none: carried anything): before that it may bounce, afterwards roll off. One that slides
 * leaves several.
 */
export class Footprints {
  #samples = new Samples();
  #next = 0;     // tick
  #open = [];    // by foot
  #restarts = 0;

  constructor(run) {
    this.run = run;
    this.list = [];
    this.weight = GRAVITY * run.robot.mass;
  }

  async load() {
    const {run} = this;
    const truth = run.find('ground_truth_t', 'foot_pose[0].position[0]');
    await this.#samples.load(run, Object.assign({}, ...run.robot.feet.map((_, f) => ({
      ...pose(`sole${f}`, truth ? 'ground_truth_t' : 'planner_status_t', `foot_pose[${f}]`),
      [`contact${f}`]: ['support_plan_t', `in_contact[${f}]`],
      [`load${f}`]: ['robot_state_t', `foot_wrench[${f}].force[2]`],
    }))));
    this.update();
  }

  /** Takes the ticks that have come. */
  update() {
    const {run} = this;
    if ((run.restarts ?? 0) !== this.#restarts) {
      this.#restarts = run.restarts;
      this.list = [];
      this.#open = [];
      this.#next = 0;
    }
    let row = Math.max(0, run.rowOfTick(this.#next));
    if (run.tickOf(row) < this.#next) ++row;
    for (; row < run.numRows; ++row) run.robot.feet.forEach((_, f) => this.#take(f, row));
    if (run.numRows > 0) this.#next = run.tickOf(run.numRows - 1) + 1;
  }

  #take(foot, row) {
    const contact = this.#samples.at(`contact${foot}`, row), load = -this.#samples.at(`load${foot}`, row);
    if (Number.isNaN(contact + load)) return;
    const time = this.run.timeAt(row);
    let open = this.#open[foot];
    const firm = load > FIRM * this.weight;
    if (!firm && !(contact > 0 && load > LIGHT * this.weight)) {
      if (open && time - open.loaded > BOUNCE) {
        open.to = open.loaded;
        this.#open[foot] = undefined;
      }
      return;
    }
    const before = open?.loaded;  // until when it has stood there, should it stand elsewhere now
    if (open) open.loaded = time;
    if (open?.firm && !firm) return;
    const stands = this.#samples.pose(`sole${foot}`, row);
    if (![...stands.position, ...stands.orientation].every(Number.isFinite)) return;
    if (open?.firm && Math.hypot(...[0, 1].map((i) => stands.position[i] - open.first[i])) > SLID) {
      open.to = before;
      open = undefined;
    }
    if (!open) {
      open = {foot, from: time, to: undefined};
      this.list.push(open);
      this.#open[foot] = open;
    }
    if (open.firm && stands.position[2] > open.first[2] + ROLLED) return;
    if (firm && !open.firm) open.first = stands.position;
    Object.assign(open, {pose: stands, firm, loaded: time});
  }

  /** Of those that had begun at a time the last `count`. */
  until(time, count) {
    let end = this.list.length;
    while (end > 0 && this.list[end - 1].from > time) --end;
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
