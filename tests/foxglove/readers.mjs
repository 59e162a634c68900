// Foxglove's own packages, of build/web.
import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import {join, resolve} from 'node:path';

export function packages(web) {
  const require = createRequire(join(resolve(web), 'package.json'));
  return {
    mcap: require('@mcap/core'), support: require('@mcap/support'), protobuf: require('protobufjs'),
    descriptor: require('protobufjs/ext/descriptor'), schemas: require('@foxglove/schemas/internal'),
    rosmsg: require('@foxglove/rosmsg'), ros2: require('@foxglove/rosmsg2-serialization'),
    ws: require('ws'), protocol: require('@foxglove/ws-protocol')};
}

/** What decodes a channel's messages, of its schema alone. */
export function decoder({protobuf, descriptor, rosmsg, ros2}, {encoding, schemaName, schemaEncoding, schemaData}) {
  if (encoding === 'protobuf') {
    assert.equal(schemaEncoding, 'protobuf');
    const root = protobuf.Root.fromDescriptor(descriptor.FileDescriptorSet.decode(schemaData));
    const type = root.lookupType(schemaName);
    const decode = (data) => type.toObject(type.decode(data), {longs: String, arrays: true, defaults: true});
    return Object.assign(decode, {type});
  }
  assert.equal(encoding, 'cdr');
  assert.equal(schemaEncoding, 'ros2msg');
  const reader = new ros2.MessageReader(rosmsg.parse(new TextDecoder().decode(schemaData), {ros2: true}));
  return (data) => reader.readMessage(data);
}

/** {reader, topics: {name: [{message, value}]}} of an MCAP file, through its index. */
export async function readMcap(libraries, file) {
  const bytes = readFileSync(file);
  const reader = await libraries.mcap.McapIndexedReader.Initialize({
    readable: {
      size: async () => BigInt(bytes.length),
      read: async (offset, size) => new Uint8Array(bytes.subarray(Number(offset), Number(offset + size))),
    },
    decompressHandlers: await libraries.support.loadDecompressHandlers()});
  const decoders = new Map();
  for (const channel of reader.channelsById.values()) {
    const schema = reader.schemasById.get(channel.schemaId);
    decoders.set(channel.id, decoder(libraries, {encoding: channel.messageEncoding, schemaName: schema.name,
      schemaEncoding: schema.encoding, schemaData: schema.data}));
  }
  const topics = {};
  for await (const message of reader.readMessages()) {
    const {topic} = reader.channelsById.get(message.channelId);
    (topics[topic] ??= []).push({message, value: decoders.get(message.channelId)(message.data)});
  }
  return {reader, topics, decoders};
}

/** ns of a protobuf or ROS time. */
export const nanoseconds = (t) => BigInt(t.seconds ?? t.sec ?? 0) * 1000000000n + BigInt(t.nanos ?? t.nsec ?? t.nanosec ?? 0);

/** Problems of a protobuf type beside what Foxglove publishes: names, numbers, types, all the way down. */
export function schemaProblems({protobuf, schemas}, type, seen = new Set()) {
  if (seen.has(type.name)) return [];
  seen.add(type.name);
  const published = Object.values(schemas.foxgloveMessageSchemas).find((s) => s.name === type.name);
  if (!published) return [`${type.name} is not published`];
  const enums = Object.values(schemas.foxgloveEnumSchemas).filter((e) => e.parentSchemaName === type.name);
  const text = schemas.generateProto(published, enums).replace(/^import .*$/gm, '');
  const theirs = protobuf.parse(text, {keepCase: true}).root.lookupType(`foxglove.${type.name}`);
  const shape = (t) => t.fieldsArray.map((f) => `${f.id} ${f.repeated ? 'repeated ' : ''}${f.type.split('.').pop()} ${f.name}`).sort();
  const values = (t) => t.nestedArray.filter((n) => n.values).map((n) => [n.name, Object.entries(n.values).sort()]);
  const problems = [];
  try {
    assert.deepEqual(shape(type), shape(theirs));
    assert.deepEqual(values(type), values(theirs));
  } catch (error) {
    problems.push(`${type.name}: ${error.message}`);
  }
  for (const field of type.fieldsArray) {
    const inner = field.resolve().resolvedType;
    if (inner?.fieldsArray && inner.parent?.name === 'foxglove') problems.push(...schemaProblems({protobuf, schemas}, inner, seen));
  }
  return problems;
}

/** Rigid motions as {p, q}, q = [x, y, z, w]. */
export const pose = {
  rotate([x, y, z, w], v) {
    const t = [2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])];
    return [v[0] + w * t[0] + y * t[2] - z * t[1], v[1] + w * t[1] + z * t[0] - x * t[2], v[2] + w * t[2] + x * t[1] - y * t[0]];
  },
  times([ax, ay, az, aw], [bx, by, bz, bw]) {
    return [aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
      aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz];
  },
  join(a, b) { return {p: pose.rotate(a.q, b.p).map((x, i) => x + a.p[i]), q: pose.times(a.q, b.q)}; },
  inverse({p, q: [x, y, z, w]}) {
    const q = [-x, -y, -z, w];
    return {p: pose.rotate(q, p).map((c) => -c), q};
  },
  of({position: p, orientation: q}) { return {p: [p.x, p.y, p.z], q: [q.x, q.y, q.z, q.w]}; },
  turn(axis, angle) {
    const n = Math.hypot(...axis), s = Math.sin(angle / 2) / n;
    return [axis[0] * s, axis[1] * s, axis[2] * s, Math.cos(angle / 2)];
  },
  /** [m, rad] between two. */
  difference(a, b) {
    const dot = Math.abs(a.q.reduce((sum, x, i) => sum + x * b.q[i], 0));
    return [Math.hypot(...a.p.map((x, i) => x - b.p[i])), 2 * Math.acos(Math.min(1, dot))];
  },
};

/** World poses of all links of a URDF, by the definition of its joints: origin (xyz, then roll, pitch, yaw about fixed axes), axis. */
export function forwardKinematics(urdf, base, positions) {
  const numbers = (text, otherwise) => (text ? text.trim().split(/\s+/).map(Number) : otherwise);
  const joints = [...urdf.replace(/<!--[\s\S]*?-->/g, '').matchAll(/<joint\s+([^>]*[^/])>([\s\S]*?)<\/joint>/g)].map(([, head, body]) => {
    const get = (tag, name) => new RegExp(`<${tag}\\b[^>]*\\b${name}="([^"]*)"`).exec(body)?.[1];
    const [roll, pitch, yaw] = numbers(get('origin', 'rpy'), [0, 0, 0]);
    const q = [[[0, 0, 1], yaw], [[0, 1, 0], pitch], [[1, 0, 0], roll]].map(([a, t]) => pose.turn(a, t)).reduce(pose.times);
    return {name: /name="([^"]*)"/.exec(head)[1], type: /type="([^"]*)"/.exec(head)[1], parent: get('parent', 'link'),
      child: get('child', 'link'), origin: {p: numbers(get('origin', 'xyz'), [0, 0, 0]), q}, axis: numbers(get('axis', 'xyz'), [1, 0, 0])};
  });
  const children = new Set(joints.map((j) => j.child));
  const root = joints.find((j) => !children.has(j.parent)).parent;
  const world = {[root]: base};
  for (let found = true; found;) {
    found = false;
    for (const j of joints) {
      if (!world[j.parent] || world[j.child]) continue;
      const moved = {p: [0, 0, 0], q: j.type === 'fixed' ? [0, 0, 0, 1] : pose.turn(j.axis, positions[j.name])};
      world[j.child] = pose.join(pose.join(world[j.parent], j.origin), moved);
      found = true;
    }
  }
  return world;
}
