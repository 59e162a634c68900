// Runs for tests, with every signal given in the page's own format.
import {readFileSync, readdirSync} from 'node:fs';
import {parseMessage} from '../../web/src/messages.js';
import {Run} from '../../web/src/data.js';

const lcm = new URL('../../lcmtypes/', import.meta.url);
const files = [...readdirSync(lcm).filter((f) => f.endsWith('.lcm')), 'steps/footsteps_t.lcm',
  ...['ratios_t', 'foot_t', 'signals_t'].map((name) => `derived/${name}.lcm`)];
const sources = new Map(files.map((f) => readFileSync(new URL(f, lcm), 'utf8')).map((text) => [parseMessage(text).name, text]));
export const messages = Object.fromEntries([...sources.values()].map(parseMessage).map((m) => [m.name, m]));

const identity = {position: [0, 0, 0], orientation: [1, 0, 0, 0]};
const COUNTS = {num_joints: 2, num_motors: 2, num_feet: 2};

/** Field paths of a message whose counts are COUNTS. */
function paths(type, source) {
  return [...source.matchAll(/^\s+(\w+)\s+(\w+)(?:\[(\w+)\])?;/gm)].flatMap(([, fieldType, name, size]) => {
    if (name.startsWith('num_') || name === 'run_id' || name === 'tick' || fieldType === 'string') return [];
    const names = size ? Array.from({length: COUNTS[size] ?? Number(size)}, (_, i) => `${name}[${i}]`) : [name];
    const own = messages[type].fields[name].type;  // in full
    return messages[own] ? names.flatMap((n) => paths(own, sourceOf(own)).map((p) => `${n}.${p}`)) : names;
  });
}
const sourceOf = (type) => sources.get(type);

const TYPES = ['drive_feedback_t', 'robot_sensors_t', 'robot_state_t', 'estimator_status_t', 'support_plan_t', 'planner_status_t', 'task_torque_t',
  'balance_torque_t', 'joint_command_t', 'bridge_status_t', 'external_push_t', 'ground_truth_t', 'steps.footsteps_t',
  'derived.signals_t'];

/** A robot with a pitch and a roll joint in the right leg, none in the left. */
export const robot = {
  name: 'hopper', mass: 10,
  bodies: [{name: 'trunk', parent: -1, joint: -1},
    {name: 'thigh', parent: 0, joint: 0, origin: identity, axis: [0, 1, 0]},
    {name: 'foot', parent: 1, joint: 1, origin: identity, axis: [1, 0, 0]}],
  joints: [{name: 'hip_pitch', torque_limit: 50}, {name: 'ankle_roll', torque_limit: 20}],
  feet: ['right', 'left'].map((name, i) => ({name, body: [2, 0][i], sole: identity,
    corners: [[-0.15, -0.075], [0.15, -0.075], [0.15, 0.075], [-0.15, 0.075]]})),
  visuals: [], meshes: [], capsules: [0, 1, 2],
};

/** `constants`: value by "type.field"; all others are 0. `live`: {keep} of a run in progress. `more`: of its scenario. `gone`: types it lacks. */
export function makeRun(section, constants = {}, ticks = 4, live = undefined, more = {}, gone = []) {
  const channels = TYPES.filter((type) => !gone.includes(type)).map((type) => ({name: type === 'derived.signals_t' ? 'DERIVED' : type.replace(/_t$/, '').toUpperCase(), type, count: ticks,
    signals: paths(type, sourceOf(type)).map((field) => ({field, integer: false, value: constants[`${type}.${field}`] ?? 0}))}));
  return new Run({
    format: 1, channels, robot, events: [], live,
    run: {tick_period: 0.002, ticks, checks: [], assumptions: [], components: [], channels: []},
    scenario: {name: 'test', paper_section: section, ...more},
  }, messages, () => { throw new Error('no packed column here'); });
}

export async function valuesOf(run, name) {
  const signal = run.signals.get(name);
  if (!signal) throw new Error(`the run has no signal ${name}`);
  await signal.load();
  return [...signal.values];
}
