// `poise log export --mcap` read with MCAP's own library and the schemas in the file, against the log, decoded by
// what the .lcm files say. Usage: node mcap_test.mjs --poise PROGRAM --web DIR, where DIR is build/web
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {mkdtempSync, readFileSync, readdirSync, rmSync} from 'node:fs';
import {createRequire} from 'node:module';
import {tmpdir} from 'node:os';
import {join, resolve} from 'node:path';
import {after, before, test} from 'node:test';
import {fileURLToPath} from 'node:url';
import {parseArgs} from 'node:util';
import {readLog, writeLog} from '../web/lcm_log.mjs';

const {values: options} = parseArgs({options: {poise: {type: 'string'}, web: {type: 'string'}}});
const require = createRequire(join(resolve(options.web), 'package.json'));
const {McapIndexedReader, McapStreamReader} = require('@mcap/core');
const {loadDecompressHandlers} = require('@mcap/support');
const protobuf = require('protobufjs');
const {FileDescriptorSet} = require('protobufjs/ext/descriptor');

const here = (path) => fileURLToPath(new URL(path, import.meta.url));
const folder = mkdtempSync(join(tmpdir(), 'poise-mcap-'));
const log = join(folder, 'run', 'run.lcm');
const file = join(folder, 'run.mcap');

function poise(...parameters) {
  const {status, stdout, stderr} = spawnSync(options.poise, parameters, {encoding: 'utf8'});
  return {status, output: stdout + stderr};
}

before(() => {
  const run = poise('run', here('data/stand.pbtxt'), '--inline', '--quiet', '--out', join(folder, 'run'));
  assert.equal(run.status, 0, run.output);
  const exported = poise('log', 'export', log, '--mcap', file);
  assert.equal(exported.status, 0, exported.output);
});
after(() => rmSync(folder, {recursive: true, force: true}));

// LCM, from the .lcm files: big-endian, the fingerprint first.
const fieldsOf = {};
for (const name of readdirSync(here('../../lcmtypes')).filter((f) => f.endsWith('.lcm'))) {
  const source = readFileSync(here(`../../lcmtypes/${name}`), 'utf8');
  fieldsOf[name.slice(0, -4)] = [...source.matchAll(/^\s+(?!const)(\w+)\s+(\w+)(?:\[(\w+)\])?;/gm)]
    .map(([, type, field, size]) => ({type, field, size}));
}

function decodeLcm(type, bytes) {
  let at = 8;
  const scalar = {
    int8_t: () => bytes.readInt8(at++), int32_t: () => bytes.readInt32BE((at += 4) - 4),
    int64_t: () => bytes.readBigInt64BE((at += 8) - 8), double: () => bytes.readDoubleBE((at += 8) - 8),
    string: () => { const size = bytes.readInt32BE(at); at += 4 + size; return bytes.toString('utf8', at - size, at - 1); },
  };
  const read = (name) => scalar[name] ? scalar[name]() : struct(name);
  const struct = (name) => {
    const message = {};
    for (const {type: t, field, size} of fieldsOf[name]) {
      const count = size === undefined ? 0 : /^\d/.test(size) ? Number(size) : message[size];
      message[field] = size === undefined ? read(t) : Array.from({length: count}, () => read(t));
    }
    return message;
  };
  const message = struct(type);
  assert.equal(at, bytes.length, `${type}: not all of the message was read`);
  return message;
}

/** What is no message of the log: what tests/foxglove reads, and what follows from the messages. */
const isAdded = (topic) => topic.startsWith('/') || topic === 'DERIVED';

/** Messages of the MCAP file by topic, through its index, decoded by the schemas in it. */
async function readMcap() {
  const bytes = readFileSync(file);
  const reader = await McapIndexedReader.Initialize({readable: {
    size: async () => BigInt(bytes.length),
    read: async (offset, size) => new Uint8Array(bytes.subarray(Number(offset), Number(offset + size))),
  }, decompressHandlers: await loadDecompressHandlers()});
  const types = new Map();
  for (const channel of reader.channelsById.values()) {
    if (isAdded(channel.topic)) continue;
    const schema = reader.schemasById.get(channel.schemaId);
    assert.equal(channel.messageEncoding, 'protobuf');
    assert.equal(schema.encoding, 'protobuf');
    const root = protobuf.Root.fromDescriptor(FileDescriptorSet.decode(schema.data));
    types.set(channel.id, root.lookupType(schema.name));
  }
  const topics = {};
  for await (const message of reader.readMessages()) {
    const {topic} = reader.channelsById.get(message.channelId);
    if (isAdded(topic)) continue;
    const type = types.get(message.channelId);
    (topics[topic] ??= []).push({message, value: type.toObject(type.decode(message.data), {longs: String, arrays: true})});
  }
  return {reader, topics};
}

// Named elements, as the robot's file and its URDF have them: arrays that num_joints, num_motors and num_feet size.
const robotFile = (name) => readFileSync(here(`../../deploy/robots/dyros/${name}`), 'utf8');
const inOrder = (text, names) => [...names].sort((a, b) => text.indexOf(`<joint name="${a}"`) - text.indexOf(`<joint name="${b}"`));
const joints = inOrder(robotFile('dyros_legs.urdf'), [...robotFile('dyros_legs.pbtxt').matchAll(/^  joint: "(\w+)"/gm)].map((m) => m[1]));
const feet = [...robotFile('dyros_legs.pbtxt').matchAll(/foot \{\s+name: "(\w+)"/g)].map((m) => m[1]);
const elements = {num_joints: joints, num_motors: joints, num_feet: feet};

/** A decoded LCM message as the MCAP file has it: named elements in place of their arrays. */
function named(type, message) {
  const result = {...message};
  for (const {field, size} of fieldsOf[type]) {
    const names = elements[size];
    if (!names) continue;
    assert.equal(message[field].length, names.length);
    result[field] = Object.fromEntries(names.map((name, i) => [name, message[field][i]]));
  }
  return result;
}

/** Big integers as text on both sides; -0 and 0 differ. */
const comparable = (value) => JSON.parse(JSON.stringify(value, (_, v) =>
  typeof v === 'bigint' ? String(v) : Object.is(v, -0) ? 'negative zero' : v));

test('every message, bit for bit', async () => {
  const {reader, topics} = await readMcap();
  const expected = new Map();
  for (const event of readLog(log)) expected.set(event.channel, [...(expected.get(event.channel) ?? []), event]);
  assert.deepEqual(Object.keys(topics).sort(), [...expected.keys()].sort());
  const typeOf = Object.fromEntries([...reader.channelsById.values()].map((c) => [c.topic, c.metadata.get('lcm_type')]));
  let count = 0;
  for (const [channel, events] of expected) {
    assert.equal(topics[channel].length, events.length, channel);
    count += events.length;
    for (const [i, event] of events.entries()) {
      const {message, value} = topics[channel][i];
      const decoded = named(typeOf[channel], decodeLcm(typeOf[channel], event.data));
      assert.deepEqual(comparable(value), comparable(decoded), `${channel} ${i}`);
      assert.equal(message.logTime, event.head.readBigInt64BE(12) * 1000n);
    }
  }
  const counts = [...reader.channelsById.values()].filter((c) => !isAdded(c.topic)).map((c) => reader.statistics.channelMessageCounts.get(c.id));
  assert.equal(Number(counts.reduce((sum, n) => sum + n)), count);
  assert.ok(count > 2000);
});

test('read from the beginning, with all checksums', async () => {
  const reader = new McapStreamReader({validateCrcs: true, decompressHandlers: await loadDecompressHandlers()});
  reader.append(readFileSync(file));
  let messages = 0;
  const seen = new Set(), channels = new Set();
  const metadata = {};
  for (let record; (record = reader.nextRecord());) {
    seen.add(record.type);
    if (record.type === 'Channel' && !isAdded(record.topic)) channels.add(record.id);
    if (record.type === 'Message' && channels.has(record.channelId)) messages++;
    if (record.type === 'Metadata') metadata[record.name] = record.metadata;
  }
  assert.ok(reader.done());
  assert.equal(metadata.run.get('scenario'), 'stand');
  assert.equal(metadata.units.get('joint_command_t.torque'), 'N·m');
  assert.equal(metadata.units.get('wrench_t.force'), 'N');
  assert.equal(messages, readLog(log).length);
  for (const type of ['Header', 'Metadata', 'Schema', 'Channel', 'Statistics', 'ChunkIndex', 'SummaryOffset', 'Footer']) {
    assert.ok(seen.has(type), type);
  }
});

test('what cannot be read is left out, and said', () => {
  const events = readLog(log);
  events.find((e) => e.channel === 'ROBOT_STATE').data[3] ^= 0xFF;  // of its fingerprint
  const damaged = join(folder, 'damaged.lcm');
  writeLog(damaged, events);
  const result = poise('log', 'export', damaged, '--mcap', join(folder, 'damaged.mcap'));
  assert.equal(result.status, 1);
  assert.match(result.output, /ROBOT_STATE: 1 messages could not be read/);
  const ticks = events.filter((e) => e.channel === 'SUPPORT_PLAN').length;  // with a message of DERIVED each
  assert.match(result.output, new RegExp(`${events.length - 1 + ticks} messages`));
});
