// What `poise log export --mcap` writes for Foxglove, read with Foxglove's own packages; the robot's frames against forward kinematics of
// the URDF's text and against the engine's bodies. Usage: node export_test.mjs --poise PROGRAM --web DIR, where DIR is build/web
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {mkdtempSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {after, before, test} from 'node:test';
import {fileURLToPath} from 'node:url';
import {parseArgs} from 'node:util';
import {forwardKinematics, nanoseconds, packages, pose, readMcap, schemaProblems} from './readers.mjs';

const {values: options} = parseArgs({options: {poise: {type: 'string'}, web: {type: 'string'}}});
const libraries = packages(options.web);
const folder = mkdtempSync(join(tmpdir(), 'poise-foxglove-'));
const file = join(folder, 'run.mcap');
const SCENE = ['/tf', '/tf_static', '/robot', '/ground', '/forces', '/support', '/events', '/joint_states', '/robot_description'];
let reader, topics, decoders;

function poise(...parameters) {
  const {status, stdout, stderr} = spawnSync(options.poise, parameters, {encoding: 'utf8'});
  return {status, output: stdout + stderr};
}

before(async () => {
  // A block under a lifted foot, a push: everything that is drawn.
  const run = poise('run', 'push_double_support', '--inline', '--quiet', '--out', join(folder, 'run'), '--duration', '1.5',
    '--set', 'sim.block.x=1', '--set', 'sim.block.tilt_roll=0.1');
  assert.ok(run.status <= 1, run.output);  // it is shorter than its checks want
  const exported = poise('log', 'export', join(folder, 'run'), '--mcap', file);
  assert.equal(exported.status, 0, exported.output);
  assert.doesNotMatch(exported.output, /warning/);
  ({reader, topics, decoders} = await readMcap(libraries, file));
});
after(() => rmSync(folder, {recursive: true, force: true}));

const numbersOf = (message, fields) => fields.map((f) => message[f]);
const xyz = (v) => numbersOf(v, ['x', 'y', 'z']);
const base = ({base_position: p, base_orientation: [w, x, y, z]}) => ({p, q: [x, y, z, w]});
const byTime = (topic) => new Map(topics[topic].map(({message, value}) => [message.logTime, value]));

test('chunks are compressed and indexed; checksums, statistics and summary hold', async () => {
  assert.ok(reader.chunkIndexes.length > 3);
  for (const chunk of reader.chunkIndexes) {
    assert.equal(chunk.compression, 'zstd');
    assert.ok(chunk.compressedSize < chunk.uncompressedSize);
    assert.ok(chunk.messageIndexOffsets.size > 0);
  }
  const ends = reader.chunkIndexes.map((c) => c.messageEndTime);
  assert.ok(reader.chunkIndexes.slice(1).every((c, i) => c.messageStartTime + 20000000n >= ends[i]));  // a seek reads few
  const handlers = await libraries.support.loadDecompressHandlers();
  const stream = new libraries.mcap.McapStreamReader({validateCrcs: true, decompressHandlers: handlers});
  stream.append(readFileSync(file));
  const counts = new Map(), attachments = {};
  for (let record; (record = stream.nextRecord());) {
    if (record.type === 'Message') counts.set(record.channelId, (counts.get(record.channelId) ?? 0n) + 1n);
    if (record.type === 'Attachment') attachments[record.name] = new TextDecoder().decode(record.data);
  }
  assert.ok(stream.done());
  assert.deepEqual([...reader.statistics.channelMessageCounts].sort(), [...counts].sort());
  assert.equal(reader.statistics.attachmentCount, 3);
  assert.equal(reader.attachmentIndexes.length, 3);
  assert.match(attachments['robot.urdf'], /<robot name="/);
  assert.match(attachments['scenario.pbtxt'], /push_double_support/);
  assert.match(attachments['robot.pbtxt'], /motor/);
});

test('schemas are those that Foxglove publishes, and every message is one of them', () => {
  for (const channel of reader.channelsById.values()) {
    const {type} = decoders.get(channel.id);
    if (type?.fullName.startsWith('.foxglove.')) {
      assert.deepEqual(schemaProblems(libraries, type), []);
    }
  }
  assert.deepEqual(SCENE.filter((name) => !topics[name]), []);
  assert.equal(topics['/tf'].length, 150);  // 100 Hz
  const quaternions = [];
  const walk = (value, path) => {
    if (typeof value === 'number') assert.ok(Number.isFinite(value), path);
    if (value && typeof value === 'object') {
      if ('w' in value && 'z' in value) quaternions.push(Math.hypot(value.x, value.y, value.z, value.w));
      for (const [key, inner] of Object.entries(value)) walk(inner, `${path}.${key}`);
    }
  };
  for (const name of SCENE) topics[name].forEach(({value}, i) => walk(value, `${name} ${i}`));
  assert.ok(quaternions.length > 3000);
  assert.ok(quaternions.every((n) => Math.abs(n - 1) < 1e-9));
  const stamped = ['/tf', '/ground', '/forces', '/support', '/events'];
  for (const name of stamped) {
    for (const {message, value} of topics[name]) {
      const stamps = (value.transforms ?? value.entities ?? [value]).map((v) => nanoseconds(v.timestamp));
      assert.ok(stamps.every((t) => t === message.logTime), name);
    }
  }
});

test('a checker that sees no difference would not do', () => {
  const other = libraries.protobuf.parse('syntax="proto3"; package foxglove; message Color { double r = 1; double b = 2; double g = 3; double a = 4; }',
    {keepCase: true}).root.lookupType('foxglove.Color');
  assert.equal(schemaProblems(libraries, other).length, 1);
});

test('frames: the URDF\'s own kinematics, and the engine\'s bodies', () => {
  const urdf = topics['/robot_description'][0].value.data;
  assert.equal(urdf, readFileSync(fileURLToPath(new URL('../../deploy/robots/dyros/dyros_legs.urdf', import.meta.url)), 'utf8'));
  const fixed = topics['/tf_static'][0].value.transforms;
  const truth = byTime('GROUND_TRUTH');
  const soles = new Map();
  let worst = [0, 0], drift = 0, compared = 0;
  for (const {message, value} of topics['/tf']) {
    const state = truth.get(message.logTime);
    const expected = forwardKinematics(urdf, base(state), state.joint_position);
    const world = {world: {p: [0, 0, 0], q: [0, 0, 0, 1]}};
    for (const t of [...value.transforms, ...fixed]) {
      assert.ok(world[t.parent_frame_id], `${t.parent_frame_id} is told before what hangs from it`);
      world[t.child_frame_id] = pose.join(world[t.parent_frame_id],
        {p: xyz(t.translation), q: [...xyz(t.rotation), t.rotation.w]});
    }
    assert.deepEqual(Object.keys(world).sort(), [...Object.keys(expected), 'world'].sort());
    for (const [link, p] of Object.entries(expected)) {
      worst = pose.difference(p, world[link]).map((d, i) => Math.max(d, worst[i]));
      ++compared;
    }
    // The engine's soles, which no kinematics of ours made, hold still in the feet's frames.
    for (const [foot, sole] of Object.entries(state.foot_pose)) {
      const link = Object.keys(world).find((l) => new RegExp(`^${foot}.*(foot|sole)`).test(l)) ?? `${foot}_foot`;
      const [w, x, y, z] = sole.orientation;
      const here = pose.join(pose.inverse(world[link]), {p: sole.position, q: [x, y, z, w]});
      if (!soles.has(foot)) soles.set(foot, here);
      drift = Math.max(drift, pose.difference(here, soles.get(foot))[0]);
    }
  }
  assert.ok(compared > 1500);
  assert.ok(worst[0] < 1e-12 && worst[1] < 1e-6, `${worst}`);  // an arccos beside 1 has half of the digits
  assert.equal(soles.size, 2);
  assert.ok(drift < 1e-3, `${drift} m`);
});

test('forces: those of the log, where they act, upward', () => {
  const sensors = byTime('ROBOT_SENSORS'), command = byTime('JOINT_COMMAND'), truth = byTime('GROUND_TRUTH'), push = byTime('EXTERNAL_PUSH');
  let arrows = 0, pushes = 0;
  for (const {message, value} of topics['/forces']) {
    const entity = (id) => value.entities.find((e) => e.id === id);
    for (const [id, from] of [['measured forces', sensors], ['computed forces', command]]) {
      const wrenches = Object.entries(from.get(message.logTime).foot_wrench);
      assert.equal(entity(id).arrows.length, wrenches.length);
      wrenches.forEach(([foot, {force, moment}], i) => {
        const arrow = entity(id).arrows[i];
        const sole = truth.get(message.logTime).foot_pose[foot];
        const [w, x, y, z] = sole.orientation;
        const at = {p: sole.position, q: [x, y, z, w]};
        const direction = pose.rotate(pose.of(arrow.pose).q, [1, 0, 0]);
        const length = 900 * (arrow.shaft_length + arrow.head_length);  // N
        const expected = pose.rotate(at.q, force.map((f) => -f));
        expected.forEach((f, k) => assert.ok(Math.abs(f - length * direction[k]) < 1e-6));
        assert.ok(direction[2] > 0.8);
        // About the arrow's foot the wrench has no moment in the sole's plane.
        const r = pose.rotate(pose.inverse(at).q, pose.of(arrow.pose).p.map((p, k) => p - at.p[k]));
        assert.ok(Math.abs(moment[0] - (r[1] * force[2] - r[2] * force[1])) < 1e-6);
        assert.ok(Math.abs(moment[1] - (r[2] * force[0] - r[0] * force[2])) < 1e-6);
        ++arrows;
      });
    }
    const strength = Math.hypot(...push.get(message.logTime).force);
    assert.equal(entity('push').arrows.length, strength > 3 ? 1 : 0);
    pushes += entity('push').arrows.length;
  }
  assert.ok(arrows === 600 && pushes > 3, `${arrows} ${pushes}`);
});

test('support: capture point, centre of mass, soles; ground: floor and block', () => {
  const planner = byTime('PLANNER_STATUS'), truth = byTime('GROUND_TRUTH');
  for (const {message, value} of topics['/support']) {
    const entity = (id) => value.entities.find((e) => e.id === id);
    assert.deepEqual(xyz(entity('capture point').spheres[0].pose.position), planner.get(message.logTime).capture_point);
    assert.deepEqual(xyz(entity('centre of mass').spheres[0].pose.position), truth.get(message.logTime).com_position);
    assert.equal(entity('soles').lines.length, 2);
    assert.ok(entity('support polygon').lines[0].points.length >= 4);
    assert.ok(entity('region of the centre of pressure').lines[0].points.length >= 4);
  }
  assert.equal(topics['/ground'].length, 1);
  const [floor, block] = topics['/ground'][0].value.entities;
  assert.equal(floor.id, 'floor');
  const [{points, indices}] = block.triangles;
  // The top: a plane tilted by 0.1 rad about x, 0.09 m high in its middle.
  for (const p of points.slice(0, 17 * 17)) assert.ok(Math.abs(p.z - 0.09 - Math.tan(0.1) * p.y) < 1e-9, JSON.stringify(p));
  assert.ok(indices.every((i) => i < points.length) && indices.length % 3 === 0);
});

test('the robot: something in every link; joint states: the log\'s', () => {
  const links = topics['/robot'][0].value.entities;
  const frames = new Set([...topics['/tf'][0].value.transforms, ...topics['/tf_static'][0].value.transforms].map((t) => t.child_frame_id));
  assert.ok(links.length >= 13);
  for (const link of links) {
    assert.ok(frames.has(link.frame_id) && link.frame_locked, link.id);
    assert.ok(['cubes', 'spheres', 'cylinders', 'triangles'].some((k) => link[k].length > 0), link.id);
  }
  const state = byTime('ROBOT_STATE'), sensors = byTime('ROBOT_SENSORS');
  for (const {message, value} of topics['/joint_states']) {
    const {joint_position: q, joint_velocity: v} = state.get(message.logTime);
    assert.deepEqual(value.name, Object.keys(q));
    assert.deepEqual([...value.position], Object.values(q));
    assert.deepEqual([...value.velocity], Object.values(v));
    assert.deepEqual([...value.effort], Object.values(sensors.get(message.logTime).joint_torque));
    assert.equal(nanoseconds(value.header.stamp), message.logTime);
  }
  assert.equal(topics['/joint_states'].length, 150);
});

test('events: those of the summary', () => {
  const {events} = JSON.parse(readFileSync(join(folder, 'run', 'summary.json'), 'utf8'));
  const told = topics['/events'].map(({message, value}) => ({time: Number(message.logTime) / 1e9, name: value.name, detail: value.message}));
  assert.ok(told.length > 4);
  assert.deepEqual(told.map((e) => [e.name, e.detail]), events.map((e) => [e.name, e.detail || e.name]));
  told.forEach((e, i) => assert.ok(Math.abs(e.time - events[i].time) < 1e-9));
});

test('a log without its run has its messages, and says what is missing', () => {
  const bytes = readFileSync(join(folder, 'run', 'run.lcm'));
  const first = 28 + bytes.readInt32BE(20) + bytes.readInt32BE(24);  // RUN_INFO
  const bare = join(folder, 'bare.lcm');
  writeFileSync(bare, bytes.subarray(first, first + (1 << 20)));
  const {status, output} = poise('log', 'export', bare, '--mcap', join(folder, 'bare.mcap'));
  assert.equal(status, 0, output);
  assert.match(output, /warning: .*no robot to be seen/);
});

test('layouts: every curve and topic is in the file', () => {
  const layout = (name) => readFileSync(fileURLToPath(new URL(`../../deploy/layouts/${name}`, import.meta.url)), 'utf8');
  /** The number at "TOPIC<separator>a.b[2].c" of the topic's first message. */
  const resolve = (path, separator) => {
    const [topic, ...rest] = path.split(separator);
    return rest.join('.').split('.').flatMap((part) => part.split(/\[|\]/).filter(Boolean))
      .reduce((value, key) => value?.[key], topics[topic]?.[0].value);
  };
  const foxglove = JSON.parse(layout('foxglove.json'));
  const paths = Object.values(foxglove.configById).flatMap((c) => c.paths ?? []).map((p) => p.value);
  const curves = [...layout('plotjuggler.xml').matchAll(/<curve name="([^"]*)"/g)].map((m) => m[1]);
  assert.ok(paths.length > 10 && curves.length > 10);
  for (const path of paths) assert.equal(typeof resolve(path, '.'), 'number', path);
  for (const path of curves) assert.equal(typeof resolve(path, '/'), 'number', path);
  const shown = Object.keys(foxglove.configById['3D!poise'].topics);
  for (const topic of [...shown, foxglove.configById['RosOut!events'].topicToRender]) assert.ok(topics[topic], topic);
  const panels = (node) => (typeof node === 'string' ? [node] : [...panels(node.first), ...panels(node.second)]);
  assert.deepEqual(panels(foxglove.layout).sort(), Object.keys(foxglove.configById).sort());
});
