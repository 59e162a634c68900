// Signals that follow from those of the log: centre of pressure, contact conditions, errors. They join a run's signals.
import {Column} from './column.js';
import {centerOfPressure, conjugate, rotate, transformWrench} from './spatial.js';

const GRAVITY = 9.80665;   // m/s²
// A ratio says something from the first share of the robot's weight |F_z| on; below the second, as in
// logging/metrics/contact_history.h, noise decides what a sole's sensor reads.
const LIGHT_SHARE = 0.01, NOISY_SHARE = 0.05;
const BRIDGED = 0.1;       // s without a message for which a phase goes on as it was

const weight = (run) => GRAVITY * run.robot.mass;

/** N: least |F_z| with a centre of pressure, and of a computed wrench with ratios; of a sole's sensor with ratios. */
export const lightLoad = (run) => LIGHT_SHARE * weight(run);
export const noisyLoad = (run) => NOISY_SHARE * weight(run);

const AXES = ['x', 'y', 'z'];
const vector = (type, field, n = 3) => Array.from({length: n}, (_, i) => [type, `${field}[${i}]`]);
const wrench = (type, foot) =>
  [...vector(type, `foot_wrench[${foot}].force`), ...vector(type, `foot_wrench[${foot}].moment`)];
const pose = (type, field) => [...vector(type, `${field}.position`), ...vector(type, `${field}.orientation`, 4)];
const poseOf = (v) => ({position: v.slice(0, 3), orientation: v.slice(3, 7)});
const wrenchOf = (v) => ({force: v.slice(0, 3), moment: v.slice(3, 6)});

/** Ratios of a sole's wrench to |F_z| that (30)-(33) limit. */
export const CONDITIONS = [
  {key: 'friction', number: '30', unit: '', ratio: (f) => Math.hypot(f[0], f[1]), text: '|(F_x, F_y)| / |F_z|'},
  {key: 'yaw', number: '31', unit: 'm', ratio: (f) => Math.abs(f[5]), text: '|M_z| / |F_z|'},
  {key: 'roll', number: '32', unit: 'm', ratio: (f) => Math.abs(f[3]), text: '|M_x| / |F_z|'},
  {key: 'pitch', number: '33', unit: 'm', ratio: (f) => Math.abs(f[4]), text: '|M_y| / |F_z|'},
];
const LIMIT_FIELDS = {friction: 'friction', yaw: 'yaw_friction', roll: 'half_width', pitch: 'half_length'};

// compute(arrays, i, memory) of a definition: its value in row i from its dependencies' values; `memory` is its own, rows
// come in order.

/** From values of the same row. */
const pointwise = (f) => (arrays, i) => f(arrays.map((values) => values[i]));

const firstNumber = (memory, value) => {
  if (memory.first === undefined && !Number.isNaN(value)) memory.first = value;
  return memory.first ?? NaN;
};

/** A sensor's reading shows the command of the tick before, so frame and soles are those of the tick before. */
function measuredCop(run, axis, least) {
  return (arrays, i) => {
    if (i === 0 || run.tickOf(i) - run.tickOf(i - 1) !== 1) return NaN;
    const at = (from, count, row) => arrays.slice(from, from + count).map((a) => a[row]);
    const frame = poseOf(at(28, 7, i - 1));
    const sum = {force: [0, 0, 0], moment: [0, 0, 0]};
    for (const foot of [0, 1]) {
      if (!(arrays[26 + foot][i - 1] > 0)) continue;
      const part = transformWrench(frame, poseOf(at(12 + 7 * foot, 7, i - 1)), wrenchOf(at(6 * foot, 6, i)));
      for (const k of [0, 1, 2]) {
        sum.force[k] += part.force[k];
        sum.moment[k] += part.moment[k];
      }
    }
    return Math.abs(sum.force[2]) > least ? centerOfPressure(sum)[axis] : NaN;
  };
}

const relative = ([values], i, memory) => values[i] - firstNumber(memory, values[i]);

/** In x and y the COM has a reference where it follows no centre of pressure; a run of old has no such field. */
const hasReference = (follows, axis) => axis === 2 || !(follows > 0);

function comSignals() {
  return AXES.flatMap((axis, i) => [
    {name: `com_motion_${axis}`, unit: 'm', text: 'estimated COM from where it was first',
      deps: [['planner_status_t', `com_position[${i}]`]], compute: relative},
    {name: `com_motion_true_${axis}`, unit: 'm', text: 'true COM from where it was first',
      deps: [['ground_truth_t', `com_position[${i}]`]], compute: relative},
    {name: `com_motion_desired_${axis}`, unit: 'm', text: 'desired COM from where the estimated one was first',
      deps: [['support_plan_t', `com_reference.position[${i}]`], ['planner_status_t', `com_position[${i}]`],
        ['support_plan_t', 'com_follows']],
      compute: ([desired, estimated, follows], k, memory) => {
        const first = firstNumber(memory, estimated[k]);
        return hasReference(follows[k], i) ? desired[k] - first : NaN;
      }},
    {name: `com_error_${axis}`, unit: 'm', text: 'estimated COM less desired',
      deps: [['planner_status_t', `com_position[${i}]`], ['support_plan_t', `com_reference.position[${i}]`],
        ['support_plan_t', 'com_follows']],
      compute: pointwise(([a, b, follows]) => hasReference(follows, i) ? a - b : NaN)},
  ]);
}

function copSignals(run) {
  const least = lightLoad(run);
  const both = [...wrench('robot_sensors_t', 0), ...wrench('robot_sensors_t', 1),
    ...pose('planner_status_t', 'foot_pose[0]'), ...pose('planner_status_t', 'foot_pose[1]'),
    ['support_plan_t', 'in_contact[0]'], ['support_plan_t', 'in_contact[1]'], ...pose('balance_torque_t', 'frame_o')];
  return [0, 1].flatMap((i) => [
    {name: `cop_measured_${AXES[i]}`, unit: 'm', text: 'measured centre of pressure, frame O',
      deps: both, compute: measuredCop(run, i, least)},
    {name: `cop_desired_${AXES[i]}`, unit: 'm', text: 'O_d: the bound while balancing controls this axis, frame O',
      deps: [['balance_torque_t', `cop_task[${i}]`], ['balance_torque_t', `cop_limit[${i}]`],
        ['balance_torque_t', `active_${AXES[i]}`], ['balance_torque_t', 'region'], ['balance_torque_t', `cop[${i}]`]],
      // In a polygon the bound of one axis depends on the other: the computed one is on it.
      compute: pointwise(([task, limit, active, region, cop]) =>
        active > 0 ? region > 0 ? cop : Math.sign(task) * limit : task)},
    ...['measured', 'computed'].map((kind) => ({
      name: `cop_${kind}_abs_${AXES[i]}`, unit: 'm', text: `${kind} centre of pressure, frame O, absolute`,
      deps: kind === 'measured' ? both : [['balance_torque_t', `cop[${i}]`]],
      compute: (arrays, k) => Math.abs(kind === 'measured' ? measuredCop(run, i, least)(arrays, k) : arrays[0][k]),
    })),
  ]);
}

function footSignals(run) {
  const config = run.scenario.redistributor ?? {};
  const loaded = (ratio, w, least) => Math.abs(w[2]) >= least ? ratio(w) / Math.abs(w[2]) : NaN;
  return run.robot.feet.flatMap((foot, f) => {
    const contact = [0, 1].map((k) => ['joint_command_t', `in_contact[${k}]`]);
    return [
      ...CONDITIONS.flatMap(({key, number, unit, ratio, text}) => [
        {name: `${foot.name}_${key}_ratio_computed`, unit, text: `(${number}): ${text}, ${foot.name} foot, computed`,
          deps: [contact[f], ...wrench('joint_command_t', f)],
          compute: pointwise(([on, ...w]) => on > 0 ? loaded(ratio, w, lightLoad(run)) : NaN)},
        {name: `${foot.name}_${key}_ratio_measured`, unit, text: `(${number}): ${text}, ${foot.name} foot, measured`,
          deps: wrench('robot_sensors_t', f),
          compute: pointwise((w) => loaded(ratio, w, noisyLoad(run)))},
        {name: `${foot.name}_${key}_limit`, unit, text: `(${number}): limit of ${text}, ${foot.name} foot`,
          deps: [contact[f], contact[1 - f]],
          compute: pointwise(([on, other]) => on > 0
            ? config[other > 0 ? 'double_support' : 'single_support']?.[LIMIT_FIELDS[key]] ?? NaN : NaN)},
      ]),
      ...[['computed', 'joint_command_t'], ['measured', 'robot_sensors_t'], ['true', 'ground_truth_t']]
        .map(([kind, type]) => ({
          name: `${foot.name}_load_${kind}`, unit: 'N', text: `-F_z: ground on ${foot.name} foot, ${kind}`,
          deps: [[type, `foot_wrench[${f}].force[2]`]], compute: pointwise(([x]) => -x)})),
    ];
  });
}

/** Index in estimator_status_t.covariance of the variance of error `i`: orientation, velocity, position. */
const variance = (i) => ['estimator_status_t', `covariance[${9 * i - i * (i - 1) / 2}]`];

/** Three standard deviations of an error, or of the norm of several, as the estimator publishes them. */
const threeSigma = (name, unit, text, ...errors) => ({
  name, unit, text: `three standard deviations of the estimate of the ${text}`,
  deps: [['estimator_status_t', 'has_covariance'], ...errors.map(variance)],
  compute: pointwise(([has, ...v]) => has > 0 ? 3 * Math.sqrt(v.reduce((sum, x) => sum + x, 0)) : NaN)});

function estimatorSignals(run) {
  const both = (field, n) => [...vector('robot_state_t', field, n), ...vector('ground_truth_t', field, n)];
  const up = [0, 0, 1];
  return [
    ...AXES.map((axis, i) => ({
      name: `base_position_error_${axis}`, unit: 'm', text: 'base, estimated less true',
      deps: [['robot_state_t', `base_position[${i}]`], ['ground_truth_t', `base_position[${i}]`]],
      compute: pointwise(([a, b]) => a - b)})),
    {name: 'base_velocity_error', unit: 'm/s', text: 'base, norm of estimated less true velocity',
      deps: both('base_linear_velocity', 3),
      compute: pointwise((v) => Math.hypot(v[0] - v[3], v[1] - v[4], v[2] - v[5]))},
    {name: 'base_tilt_error', unit: 'rad', text: 'angle between the estimated and the true vertical',
      deps: both('base_orientation', 4),
      compute: pointwise((q) => {
        const a = rotate(conjugate(q.slice(0, 4)), up), b = rotate(conjugate(q.slice(4)), up);
        return 2 * Math.asin(Math.min(1, Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]) / 2));
      })},
    threeSigma('base_position_bound', 'm', 'base\'s position', 6, 7, 8),
    threeSigma('base_velocity_bound', 'm/s', 'base\'s velocity', 3, 4, 5),
    threeSigma('base_tilt_bound', 'rad', 'base\'s tilt', 0, 1),
  ];
}

/** Where a joint's torque is told, the nearest to the truth first: a command of stiffness and damping has none of its own. */
const TORQUES = [
  {type: 'ground_truth_t', field: 'joint_torque', text: 'true torque of the motor'},
  {type: 'bridge_status_t', field: 'applied_torque', text: 'torque as the bridge ordered it, stiffness and damping included'},
  {type: 'joint_command_t', field: 'torque', text: 'commanded torque, without stiffness and damping'},
];
export const torqueOf = (run) => TORQUES.find(({type, field}) => run.find(type, `${field}[0]`)) ?? TORQUES.at(-1);

function otherSignals(run) {
  const torque = torqueOf(run);
  return [
    {name: 'push_magnitude', unit: 'N', text: 'external push, measured', deps: vector('external_push_t', 'force'),
      compute: pointwise((f) => Math.hypot(...f))},
    ...run.robot.joints.map((joint, i) => ({
      name: `torque_share_${joint.name}`, unit: '%', text: `${torque.text}, of the joint's limit`,
      deps: [[torque.type, `${torque.field}[${i}]`]], compute: pointwise(([x]) => 100 * x / joint.torque_limit)})),
  ];
}

/** A signal computed from others when it is loaded; from then on it grows with its run. */
class DerivedSignal {
  #signals = null;
  #column = null;
  #memory = {};
  #loading = null;

  constructor(run, definition) {
    Object.assign(this, definition);
    this.run = run;
    this.field = this.label = definition.name;
    this.channel = {name: 'derived', sparse: false};
    this.name = this.title = `derived.${definition.name}`;
    this.integer = false;
  }

  get values() { return this.#column?.values; }

  load() { return this.#loading ??= this.#load(); }

  async #load() {
    const signals = this.deps.map(([type, field]) => this.run.find(type, field));
    await Promise.all(signals.map((s) => s.load()));
    this.#signals = signals;
    this.#column = new Column(this.#rows(0));
  }

  /** After its run has grown and let go of the first `dropped` rows. */
  grow(dropped) {
    if (!this.#column) return;
    const held = this.values.length;
    // Rows that came and went in one piece were never here.
    const rows = this.#rows(Math.max(0, held - dropped));
    this.#column.append(rows, held + rows.length - this.run.numRows, this.run.keep);
  }

  /** Rows at the beginning that there are no values of yet. */
  prepend(count) { this.#column?.prepend(count); }

  /** After rows have come that were missing; the one behind them may be of the tick before, too. */
  fill(row, count) {
    if (this.#column) this.#column.set(row, this.#rows(row, Math.min(this.run.numRows, row + count + 1)));
  }

  /** Its run starts anew. */
  clear() {
    this.#memory = {};
    if (this.#column) this.#column = new Column(new Float32Array(0));
  }

  #rows(from, to = this.run.numRows) {
    const arrays = this.#signals.map((s) => s.values);
    const rows = new Float32Array(to - from);
    for (let i = 0; i < rows.length; ++i) {
      const value = Math.fround(this.compute(arrays, from + i, this.#memory));
      rows[i] = Number.isFinite(value) ? value : NaN;
    }
    return rows;
  }
}

/** Adds to `run` the derived signals for which it has what they need. */
export function addDerivedSignals(run) {
  const definitions = [...comSignals(), ...copSignals(run), ...footSignals(run), ...estimatorSignals(run),
    ...otherSignals(run)];
  for (const definition of definitions) {
    if (definition.deps.every(([type, field]) => run.find(type, field))) run.add(new DerivedSignal(run, definition));
  }
}

/** Runs of ticks of the same value, as they come; undefined: no message tells. */
class Stretches {
  #list = [];  // {from, to, value}, to included

  add(tick, value) {
    const last = this.#list.at(-1);
    if (last && last.value === value && last.to === tick - 1) last.to = tick;
    else this.#list.push({from: tick, to: tick, value});
  }

  dropBefore(tick) {
    while (this.#list.length > 0 && this.#list[0].to < tick) this.#list.shift();
    if (this.#list.length > 0) this.#list[0].from = Math.max(this.#list[0].from, tick);
  }

  /** Without the gaps of up to `bridged` ticks, which are as what came before them. */
  list(bridged) {
    const result = [];
    for (const {from, to, value: own} of this.#list) {
      const last = result.at(-1);
      const value = own === undefined && last && to - from < bridged ? last.value : own;
      if (last && last.value === value) last.to = to;
      else result.push({from, to, value});
    }
    return result;
  }
}

/**
 * {balancing, support, missing}, lists of {from, to, value} in seconds: where balancing runs; which feet the controller's
 * model stands on; where no message tells, which the other two leave out.
 */
class Phases {
  #active;
  #contact;
  #balancing = new Stretches();
  #support = new Stretches();
  #next = 0;  // tick

  constructor(run) {
    this.run = run;
    run.addEventListener('restart', () => {
      this.#balancing = new Stretches();
      this.#support = new Stretches();
      this.#next = 0;
    });
    const get = (type, field) => run.find(type, field);
    this.#active = [get('balance_torque_t', 'active_x'), get('balance_torque_t', 'active_y')].filter(Boolean);
    this.#contact = run.robot.feet.map((_, f) => get('support_plan_t', `in_contact[${f}]`)).filter(Boolean);
  }

  async load() {
    await Promise.all([...this.#active, ...this.#contact].map((s) => s.load()));
    this.update();
  }

  /** After the run has grown. */
  update() {
    const {run} = this;
    for (let row = Math.max(0, this.#next - run.firstTick); row < run.numRows; ++row) {
      const tick = run.firstTick + row;
      this.#balancing.add(tick, this.#isBalancing(row));
      this.#support.add(tick, this.#supportOf(row));
      this.#next = tick + 1;
    }
    const at = (tick) => run.timeAt(tick - run.firstTick);  // counted as if each row were a tick
    const seconds = ({from, to, value}) => ({from: at(from), to: at(to + 1), value});
    const list = (stretches) => {
      stretches.dropBefore(run.firstTick);
      return stretches.list(run.rows ? 0 : BRIDGED / run.period).map(seconds);
    };
    const support = list(this.#support);
    this.balancing = list(this.#balancing).filter((p) => p.value);
    this.support = this.#contact.length ? support.filter((p) => p.value !== undefined) : [];
    this.missing = this.#contact.length ? support.filter((p) => p.value === undefined) : [];
  }

  #isBalancing(row) {
    const values = this.#active.map((s) => (s.largest ?? s.values)[row]);  // in any of the row's ticks
    return values.length > 0 && values.every(Number.isNaN) ? undefined : values.some((v) => v > 0);
  }

  #supportOf(row) {
    const values = this.#contact.map((s) => s.values[row]);
    if (values.some(Number.isNaN)) return undefined;
    const on = this.run.robot.feet.filter((_, f) => values[f] > 0).map((foot) => foot.name);
    return on.length === values.length ? 'both feet' : on.length ? `${on.join(', ')} foot` : 'no foot';
  }
}

export async function findPhases(run) {
  const phases = new Phases(run);
  await phases.load();
  return phases;
}
