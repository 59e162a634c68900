// `poise run --ros2`, read by a DDS reader whose types are made of ROS 2's own definitions (@foxglove/rosmsg-msgs-common: those of Humble), and
// decoded by a reader of ROS 2's CDR; against the run's log. Usage: node topics_test.mjs --poise PROGRAM --web DIR --cc COMPILER
import assert from 'node:assert/strict';
import {spawn, spawnSync} from 'node:child_process';
import {once} from 'node:events';
import {mkdtempSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import {tmpdir} from 'node:os';
import {join, resolve} from 'node:path';
import {after, before, test} from 'node:test';
import {setTimeout as sleep} from 'node:timers/promises';
import {fileURLToPath} from 'node:url';
import {parseArgs} from 'node:util';
import {forwardKinematics, nanoseconds, packages, pose, readMcap} from '../foxglove/readers.mjs';

const {values: options} = parseArgs({options: {poise: {type: 'string'}, web: {type: 'string'}, cc: {type: 'string'}}});
const libraries = packages(options.web);
const require = createRequire(join(resolve(options.web), 'package.json'));
const {ros2humble: definitions} = require('@foxglove/rosmsg-msgs-common');
const folder = mkdtempSync(join(tmpdir(), 'poise-ros2-'));
const here = (path) => fileURLToPath(new URL(path, import.meta.url));
const domain = 100 + process.pid % 100;
const TOPICS = {
  'rt/clock': ['rosgraph_msgs/Clock'], 'rt/joint_states': ['sensor_msgs/JointState'], 'rt/odom': ['nav_msgs/Odometry'],
  'rt/tf': ['tf2_msgs/TFMessage'], 'rt/tf_static': ['tf2_msgs/TFMessage', 'kept'], 'rt/robot_description': ['std_msgs/String', 'kept'],
  'rt/right_foot_wrench': ['geometry_msgs/WrenchStamped'], 'rt/left_foot_wrench': ['geometry_msgs/WrenchStamped'],
  'rt/rosout': ['rcl_interfaces/Log', 'kept']};
const LEAST = 250;  // messages of each topic that goes on: 2.5 s of a machine that loses none
const PATIENCE = 60000;  // ms
const seen = Object.fromEntries(Object.keys(TOPICS).map((name) => [name, []]));
let log;

/** Definitions of a type and of all that it uses, the innermost first. */
function closure(type, done = new Map()) {
  if (done.has(type)) return done;
  for (const field of definitions[type].definitions) {
    if (field.isComplex) closure(field.type, done);
    if (field.type === 'time') closure('builtin_interfaces/Time', done);
  }
  return done.set(type, definitions[type]);
}

/** OMG IDL of ROS 2's definitions, as its design article "Mapping between ROS interface types and DDS IDL types" has it. */
function idlOf(types) {
  const primitives = {bool: 'boolean', byte: 'octet', char: 'octet', float32: 'float', float64: 'double', int8: 'char', uint8: 'octet', int16: 'short',
    uint16: 'unsigned short', int32: 'long', uint32: 'unsigned long', int64: 'long long', uint64: 'unsigned long long', string: 'string'};
  const scoped = (name) => name.split('/').join('::msg::dds_::') + '_';
  const member = ({name, type, isArray, arrayLength}) => {
    const idl = type === 'time' ? scoped('builtin_interfaces/Time') : primitives[type] ?? scoped(type);
    if (!isArray) return `${idl} f_${name};`;
    return arrayLength ? `${idl} f_${name}[${arrayLength}];` : `sequence<${idl}> f_${name};`;
  };
  const all = new Map();
  for (const type of types) closure(type, all);
  return [...all].map(([type, {definitions: fields}]) => {
    const [name, struct] = type.split('/');
    return `module ${name} { module msg { module dds_ { @final struct ${struct}_ { `
      + `${fields.filter((f) => !f.isConstant).map(member).join(' ')} }; }; }; };\n`;
  }).join('');
}

function buildReader() {
  writeFileSync(join(folder, 'standard.idl'), idlOf(Object.values(TOPICS).map(([type]) => type)));
  const rows = Object.entries(TOPICS).map(([name, [type, kept]]) =>
    `{"${name}", &${type.replace('/', '_msg_dds__')}__desc, ${kept ? 1 : 0}},`);
  writeFileSync(join(folder, 'topics.h'), `#include "standard.h"\n#define NUM_TOPICS ${rows.length}\n`
    + `static const struct { const char* name; const dds_topic_descriptor_t* type; int kept; } topics[] = {${rows.join('')}};\n`);
  for (const command of [['idlc', '-l', 'c', '-t', 'standard.idl'],
    [options.cc, '-I.', '-o', 'reader', here('reader.c'), 'standard.c', '-lddsc']]) {
    const {status, stderr} = spawnSync(command[0], command.slice(1), {cwd: folder, encoding: 'utf8'});
    assert.equal(status, 0, stderr);
  }
}

before(async () => {
  buildReader();
  const interfaces = '<NetworkInterface name="lo" multicast="true"/>';
  const reader = spawn(join(folder, 'reader'), [String(domain)], {env: {...process.env,
    CYCLONEDDS_URI: `<CycloneDDS><Domain><General><Interfaces>${interfaces}</Interfaces></General></Domain></CycloneDDS>`}});
  let text = '';
  reader.stdout.on('data', (data) => { text += data; });
  await once(reader.stderr, 'data');
  const run = spawn(options.poise, ['run', 'push_double_support', '--ros2', '--realtime', '--duration', '600', '--quiet', '--out', join(folder, 'run')],
    {env: {...process.env, ROS_DOMAIN_ID: String(domain)}, stdio: 'ignore'});
  const ended = once(run, 'exit');
  const goingOn = Object.keys(TOPICS).filter((name) => TOPICS[name].length === 1);
  const counted = () => goingOn.every((name) => text.split(`${name} `).length > LEAST) && text.includes('rt/rosout ');
  for (const end = Date.now() + PATIENCE; !counted() && run.exitCode === null && Date.now() < end;) await sleep(100);
  run.kill('SIGINT');
  await ended;
  await sleep(300);
  reader.stdin.end();
  await once(reader, 'close');
  for (const line of text.split('\n').filter(Boolean)) {
    const [topic, hex] = line.split(' ');
    seen[topic].push(Buffer.from(hex, 'hex'));
  }
  const exported = spawnSync(options.poise, ['log', 'export', join(folder, 'run'), '--mcap', join(folder, 'run.mcap')], {encoding: 'utf8'});
  assert.equal(exported.status, 0, exported.stderr);
  log = (await readMcap(libraries, join(folder, 'run.mcap'))).topics;
});
after(() => rmSync(folder, {recursive: true, force: true}));

/** Values of a topic, by ROS 2's definitions. */
function values(topic) {
  const [type] = TOPICS[topic];
  const all = [...closure(type)].map(([name, d]) => ({name, definitions: d.definitions}));
  const reader = new libraries.ros2.MessageReader([all.at(-1), ...all.slice(0, -1)]);
  return seen[topic].map((bytes) => reader.readMessage(bytes));
}
const byTime = (topic) => new Map(log[topic].map(({message, value}) => [message.logTime, value]));
const xyz = ({x, y, z}) => [x, y, z];
const close = (a, b, tolerance, text) => a.forEach((x, i) => assert.ok(Math.abs(x - b[i]) <= tolerance, `${text} ${a} ${b}`));

test('joint states, byte by byte by the rules of CDR', () => {
  const state = byTime('ROBOT_STATE'), sensors = byTime('ROBOT_SENSORS');
  assert.ok(seen['rt/joint_states'].length >= LEAST, `${seen['rt/joint_states'].length}`);
  let withTorques = 0;
  for (const bytes of seen['rt/joint_states']) {
    assert.deepEqual([...bytes.subarray(0, 2)], [0, 1]);  // plain CDR, little-endian
    const body = bytes.subarray(4);
    let at = 0;
    const aligned = (size) => { at = Math.ceil(at / size) * size; return (at += size) - size; };
    const int = () => body.readInt32LE(aligned(4));
    const text = () => { const size = int(); at += size; assert.equal(body[at - 1], 0); return body.toString('utf8', at - size, at - 1); };
    const numbers = () => Array.from({length: int()}, () => body.readDoubleLE(aligned(8)));
    const time = BigInt(int()) * 1000000000n + BigInt(int());
    assert.equal(text(), '');
    const names = Array.from({length: int()}, text);
    const {joint_position: q, joint_velocity: v} = state.get(time);
    assert.deepEqual(names, Object.keys(q));
    assert.deepEqual(numbers(), Object.values(q));
    assert.deepEqual(numbers(), Object.values(v));
    const torques = numbers();
    // A busy machine may lose the sensors' datagram of a tick; then its torques are not known.
    if (torques.length > 0) assert.deepEqual(torques, Object.values(sensors.get(time).joint_torque));
    withTorques += torques.length > 0;
    assert.ok(body.length - at < 4);  // RTPS fills up to a multiple of four
  }
  assert.ok(withTorques >= LEAST / 2, `${withTorques} of ${seen['rt/joint_states'].length}`);
});

test('odometry: the estimate, its twist in the base\'s axes', () => {
  const state = byTime('ROBOT_STATE');
  const all = values('rt/odom');
  assert.ok(all.length >= LEAST);
  for (const {header, child_frame_id: child, pose: {pose: p}, twist: {twist}} of all) {
    assert.equal(header.frame_id, 'odom');
    assert.equal(child, 'upper_body');
    const s = state.get(nanoseconds(header.stamp));
    const [w, x, y, z] = s.base_orientation;
    assert.deepEqual(xyz(p.position), s.base_position);
    close([p.orientation.w, ...xyz(p.orientation)], [w, x, y, z], 1e-12, 'orientation');
    close(pose.rotate([x, y, z, w], xyz(twist.linear)), s.base_linear_velocity, 1e-12, 'linear');
    close(pose.rotate([x, y, z, w], xyz(twist.angular)), s.base_angular_velocity, 1e-12, 'angular');
  }
});

test('frames: the URDF\'s kinematics of the estimate; wrenches: of the ground on the robot', () => {
  const state = byTime('ROBOT_STATE');
  const [{data: urdf}] = values('rt/robot_description');
  assert.equal(urdf, readFileSync(here('../../deploy/robots/dyros/dyros_legs.urdf'), 'utf8'));
  const [{transforms: fixed}] = values('rt/tf_static');
  assert.deepEqual(fixed.map((t) => t.child_frame_id).filter((name) => /_sole$/.test(name)).sort(), ['left_sole', 'right_sole']);
  const frames = values('rt/tf');
  assert.ok(frames.length >= LEAST);
  for (const {transforms} of frames) {
    const s = state.get(nanoseconds(transforms[0].header.stamp));
    const [w, x, y, z] = s.base_orientation;
    const expected = forwardKinematics(urdf, {p: s.base_position, q: [x, y, z, w]}, s.joint_position);
    const world = {odom: {p: [0, 0, 0], q: [0, 0, 0, 1]}};
    for (const {header, child_frame_id: child, transform: t} of transforms) {
      world[child] = pose.join(world[header.frame_id], {p: xyz(t.translation), q: [...xyz(t.rotation), t.rotation.w]});
      assert.ok(pose.difference(world[child], expected[child])[0] < 1e-12, child);
    }
  }
  for (const foot of ['right', 'left']) {
    const wrenches = values(`rt/${foot}_foot_wrench`);
    assert.ok(wrenches.length >= LEAST);
    for (const {header, wrench} of wrenches) {
      assert.equal(header.frame_id, `${foot}_sole`);
      const {force, moment} = state.get(nanoseconds(header.stamp)).foot_wrench[foot];
      close(xyz(wrench.force), force.map((f) => -f), 0, 'force');
      close(xyz(wrench.torque), moment.map((m) => -m), 0, 'torque');
    }
  }
});

test('clock and events', () => {
  const times = values('rt/clock').map(({clock}) => nanoseconds(clock));
  assert.ok(times.slice(1).every((t, i) => t > times[i]));
  const events = values('rt/rosout');
  assert.ok(events.some((e) => e.function === 'phase_began'), JSON.stringify(events));
  assert.ok(events.every((e) => e.name === 'poise' && [20, 30, 40].includes(e.level)));
});
