// Which plots a run gets: the paper's figures of its section, then what every run is looked at for.
import {rotate} from './spatial.js';
import {LIMITS_SHOWN} from './units.js';

const series = (label, role, type, field) => ({label, role, type, field});
/** The message of what follows from others: lcmtypes/derived/. */
export const DERIVED = 'derived.signals_t';
const derived = (label, role, field) => series(label, role, DERIVED, field);
/** A line for each axis of a vector `field`. */
const ofAxes = (field, type = DERIVED) =>
  ['x', 'y', 'z'].map((axis, i) => series(axis, `axis-${axis}`, type, `${field}[${i}]`));

/** Ratios of a sole's wrench to |F_z| that (30)-(33) limit. */
const CONDITIONS = [
  {key: 'friction', number: '30', unit: '', limit: 'μ_s', text: '|(F_x, F_y)| / |F_z|'},
  {key: 'yaw', number: '31', unit: 'm', limit: 'μ_z', text: '|M_z| / |F_z|'},
  {key: 'roll', number: '32', unit: 'm', limit: 'l_y/2', text: '|M_x| / |F_z|'},
  {key: 'pitch', number: '33', unit: 'm', limit: 'l_x/2', text: '|M_y| / |F_z|'},
];

const SUPPORT_NOTE = 'The yellow areas show when balancing runs.';

/** The motion along all three axes, or where `lateral` sideways only. */
function comMotion(run, figure, lateral, note = '') {
  // Whoever came late, or has a part of the run, knows no earlier place.
  const origin = run.meta.live ? ' Motion from where it was in the first tick that the viewer heard.'
    : run.firstTick > 0 ? ` Motion from where it was at ${run.start.toFixed(3)} s, the first that this page has.` : '';
  const title = lateral ? 'COM motion, lateral (y)' : 'COM motion';
  return {figure, title, unit: 'm', note: (note + origin).trim(), series: lateral
    ? [derived('estimated', 'computed', 'com_motion[1]'), derived('true', 'truth', 'com_motion_true[1]'),
      derived('desired', 'desired', 'com_motion_desired[1]')]
    : ['x', 'y', 'z'].flatMap((axis, i) => [derived(axis, `axis-${axis}`, `com_motion[${i}]`),
      derived(`${axis}, true`, `axis-${axis}-thin`, `com_motion_true[${i}]`)])};
}

const push = (figure) => ({figure, title: 'External push, magnitude', unit: 'N',
  series: [derived('measured', 'measured', 'push_magnitude')]});

/** What the feet's measured loads are called: without sensors in the feet the estimator observes them. */
export const measuredName = ({robot, scenario}) =>
  (scenario.sim?.foot_sensors === false || robot.feet.every(({force_sensor: sensor}) => sensor === false) ? 'observed' : 'measured');

const UP_TO_LIMITS = {upToLimits: true, note: `Drawn up to ${LIMITS_SHOWN} times the limit.`};

function resultantConditions(run, figure) {
  return [['a', 1, 'l_y/2 > |M_x| / |F_z|, resultant in frame O (37)'],
    ['b', 0, 'l_x/2 > |M_y| / |F_z|, resultant in frame O (38)']].map(([letter, i, title]) => ({
    figure: figure && `${figure}${letter}`, title, unit: 'm', ...UP_TO_LIMITS, series: [
      derived(measuredName(run), 'measured', `cop_measured_abs[${i}]`),
      derived('computed', 'computed', `cop_computed_abs[${i}]`),
      series('limit', 'limit', 'balance_torque_t', `cop_limit[${i}]`)]}));
}

function footConditions(run, figure, foot) {
  const {name} = run.robot.feet[foot];
  return CONDITIONS.map(({key, number, unit, limit, text}, i) => ({
    figure: figure && `${figure}${'abcd'[i]}`, unit, ...UP_TO_LIMITS,
    title: `${limit} > ${text}, ${name} foot (${number})`, series: [
      derived(measuredName(run), 'measured', `foot[${foot}].ratio_measured.${key}`),
      derived('computed', 'computed', `foot[${foot}].ratio_computed.${key}`),
      derived('limit', 'limit', `foot[${foot}].limit.${key}`)]}));
}

/** Measured of both feet, then computed, which is drawn over it. */
const ofFeet = (run, make) =>
  ['measured', 'computed'].flatMap((what) => run.robot.feet.map((foot, f) => make(foot, f, what)));

function footWrenches(run, figure) {
  const part = {force: ['F', 'N'], moment: ['M', 'N·m']};
  return Object.entries(part).flatMap(([kind, [letter, unit]]) => ['x', 'y', 'z'].map((axis, i) => ({
    figure, title: `${letter}_${axis} of each foot, robot on ground, sole frame`, unit,
    series: ofFeet(run, (foot, f, what) =>
      series(`${foot.name}, ${what}`, `foot-${f}-${what}`, what === 'measured' ? 'robot_sensors_t' : 'joint_command_t',
        `foot_wrench[${f}].${kind}[${i}]`)),
  })));
}

function footMotion(figure, run, foot, axis, note) {
  return {figure, title: `Position of the ${run.robot.feet[foot].name} sole, ${'xyz'[axis]}`, unit: 'm', note, series: [
    series('estimated', 'computed', 'planner_status_t', `foot_pose[${foot}].position[${axis}]`),
    series('true', 'truth', 'ground_truth_t', `foot_pose[${foot}].position[${axis}]`),
    series('desired', 'desired', 'support_plan_t', `foot_reference[${foot}].position[${axis}]`)]};
}

/** Indices of the bodies between the base and a foot, the foot's last. */
function legOf(robot, foot) {
  const chain = [];
  for (let b = robot.feet[foot].body; robot.bodies[b].joint >= 0; b = robot.bodies[b].parent) chain.unshift(b);
  return chain;
}

/** Indices of the joints between base and foot that turn about the world's y axis in the zero posture, nearly. */
export function pitchJoints(robot, foot) {
  const leg = legOf(robot, foot);
  const across = (k) => leg.slice(0, k + 1)
    .reduceRight((axis, b) => rotate(robot.bodies[b].origin.orientation, axis), robot.bodies[leg[k]].axis)[1];
  return leg.filter((_, k) => Math.abs(across(k)) > 0.8).map((b) => robot.bodies[b].joint);
}

function jointTorque(figure, run, joint) {
  return {figure, title: `Torque of ${run.robot.joints[joint].name}`, unit: 'N·m', series: [
    series('commanded', 'computed', 'joint_command_t', `torque[${joint}]`),
    series('delivered', 'truth', 'ground_truth_t', `joint_torque[${joint}]`)]};
}

const bodyRoll = (figure, note) => ({figure, title: 'Orientation error of the body about x', unit: 'rad', note,
  series: [series('desired less actual', 'computed', 'task_torque_t', 'body_orientation_error[0]')]});

/** "variant step", "without balancing", "sim.push[0].peak=300": what the run has besides its scenario. */
export function changesOf({variant, ablations = [], changes = []}) {
  return [variant ? `variant ${variant}` : '', ...ablations.map((flag) => flag.replace(/^--/, '')),
    ...changes.filter((change) => ['--set', '--robot'].includes(change.by)).map(({set}) => set)].filter(Boolean);
}

/** The paper's figures by section. */
const SECTIONS = {
  '7.1': (run) => [...footWrenches(run, '6'),
    comMotion(run, '7', false, 'The paper sees 1 to 3 mm.')],
  '7.2': (run) => [
    comMotion(run, '9a', true, `${SUPPORT_NOTE} The paper\'s largest: 35 mm.`), push('9b'),
    ...resultantConditions(run, '10'), ...footConditions(run, '11', 0), ...footConditions(run, '12', 1)],
  '7.3': (run) => [
    comMotion(run, '14a', true, `${SUPPORT_NOTE} The paper\'s largest: 10.6 mm.`),
    footMotion('14b', run, 1, 1, 'The paper\'s largest error: 15 mm.'), push('14c'),
    ...footConditions(run, '15', 0)],
  '7.4': (run) => [
    ...pitchJoints(run.robot, 0).map((joint, i) => jointTorque(`16${'abcdef'[i]}`, run, joint)),
    footMotion('17', run, 1, 2)],
  '7.5': (run) => [
    comMotion(run, '19a', true, SUPPORT_NOTE), footMotion('19b', run, 1, 2),
    footMotion('20a', run, 1, 2, 'As 19b: zoom in on the contact.'),
    {figure: '20b', title: 'Vertical force on the left foot', unit: 'N', series: [
      derived(measuredName(run), 'measured', 'foot[1].load_measured'),
      derived('computed', 'computed', 'foot[1].load_computed')]},
    bodyRoll('21', 'a: first double support; b: second, with balancing.'),
    ...resultantConditions(run, '22'), ...footConditions(run, '23', 0), ...footConditions(run, '24', 1)],
};

function defaults(run) {
  return [comMotion(run, '', true), comMotion(run, '', false), push(''),
    ...resultantConditions(run, ''), ...run.robot.feet.flatMap((_, f) => footConditions(run, '', f))];
}

/** Which torque torque_share is of: the nearest to the truth. */
const torqueDrawn = (run) => (run.find('ground_truth_t', 'joint_torque[0]') ? 'true torque of the motor'
  : run.find('bridge_status_t', 'applied_torque[0]') ? 'torque as the bridge ordered it, stiffness and damping included'
    : 'commanded torque, without stiffness and damping');

/** What every run is looked at for. */
function common(run, covered) {
  const {bodies, joints, feet} = run.robot;
  const note = `Drawn: ${torqueDrawn(run)}.`;
  const share = (joint, i) => derived(joints[joint].name, `hue-${i}`, `torque_share[${joint}]`);
  const legs = feet.map((foot, f) => (
    {title: `Torques of the ${foot.name} leg, of their limits`, unit: '%', limits: [-100, 100], note,
      series: legOf(run.robot, f).map((b) => bodies[b].joint).map(share)}));
  const eta = (label, role, field) => series(label, role, 'joint_command_t', field);
  return [
    {title: 'Vertical force of the ground on each foot', unit: 'N', series: ofFeet(run, (foot, f, what) =>
      derived(`${foot.name}, ${what === 'measured' ? measuredName(run) : what}`, `foot-${f}-${what}`, `foot[${f}].load_${what}`))},
    {title: 'η: the right foot\'s share of F_z (61)', unit: '', series: [
      eta('commanded', 'computed', 'eta'), eta('optimal (71)', 'desired', 'eta_optimal'),
      eta('lower bound', 'limit', 'eta_min'), eta('upper bound', 'limit', 'eta_max')]},
    ...legs,
    {title: 'COM error', unit: 'm', series: ofAxes('com_error')},
    {title: 'Orientation error of the body', unit: 'rad', series: ofAxes('body_orientation_error', 'task_torque_t')},
    {title: 'Estimator: base position, estimated less true', unit: 'm',
      series: [...ofAxes('base_position_error'), derived('3 σ of the norm', 'limit', 'base_position_bound')]},
    {title: 'Estimator: tilt error', unit: 'rad',
      series: [derived('tilt', 'computed', 'base_tilt_error'), derived('3 σ', 'limit', 'base_tilt_bound')]},
    {title: 'Estimator: velocity error', unit: 'm/s',
      series: [derived('norm', 'computed', 'base_velocity_error'), derived('3 σ', 'limit', 'base_velocity_bound')]},
    ...(covered === '7.1' ? [] : footWrenches(run, '')),
  ];
}

/** Panels {figure, title, unit, note, limits, series: [{label, role, signal}]}; those of a run without their signals are left out. */
export function figuresFor(run) {
  const section = /7\.[1-5]/.exec(run.scenario.paper_section ?? '')?.[0];
  const wanted = [...(SECTIONS[section] ?? defaults)(run), ...common(run, section)];
  const changed = changesOf(run.meta.run).length > 0;
  const noteOf = ({note}) => (changed ? note?.replace(/The paper's largest( error)?:/, "The paper's largest$1, of its own experiment:") : note);
  return wanted.map((panel) => ({...panel, note: noteOf(panel), series: panel.series
    .map((s) => ({...s, signal: findSignal(run, s)})).filter((s) => s.signal)}))
    .filter((panel) => panel.series.some((s) => s.role !== 'limit'));
}

/** The signal that a series shows of `run`; undefined when it has none. */
export function findSignal(run, {type, field, name}) {
  return name ? run.signals.get(name) : run.find(type, field);
}

/** A panel of one signal, from the search. */
export function panelOf(signal) {
  return {title: signal.title, unit: signal.unit, note: signal.text, added: true,
    series: [{label: signal.label, role: 'computed', name: signal.name, signal}]};
}

/** A signal as a further line, of `count` others. */
export const lineOf = (signal, count) => ({label: signal.title, role: `hue-${count}`, name: signal.name, signal});
