// `poise view --foxglove` of a run in progress, through Foxglove's own client, and before hostile connections.
// Usage: node live_test.mjs --poise PROGRAM --web DIR, where DIR is build/web
import assert from 'node:assert/strict';
import {randomBytes} from 'node:crypto';
import {once} from 'node:events';
import {mkdtempSync, readFileSync, rmSync} from 'node:fs';
import {connect, createServer} from 'node:net';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {after, before, test} from 'node:test';
import {setTimeout as sleep} from 'node:timers/promises';
import {parseArgs} from 'node:util';
import {startRun, startView} from '../web/live_run.mjs';
import {decoder, forwardKinematics, packages, pose, schemaProblems} from './readers.mjs';

const {values: options} = parseArgs({options: {poise: {type: 'string'}, web: {type: 'string'}}});
const libraries = packages(options.web);
const {FoxgloveClient} = libraries.protocol;
const PROTOCOL = 'foxglove.websocket.v1';
const folder = mkdtempSync(join(tmpdir(), 'poise-foxglove-'));
const PATIENCE = 60000;  // ms
const PERSON = ['EMERGENCY_STOP', 'OPERATOR_ACT', 'OPERATOR_ANSWER'];  // channels on which nobody speaks here
let port, run, view;

async function freePort() {
  const server = createServer().listen(0, '127.0.0.1');
  await once(server, 'listening');
  const {port: free} = server.address();
  server.close();
  return free;
}

before(async () => {
  port = await freePort();
  run = startRun(options.poise, join(folder, 'run'), '--realtime', '--duration', '600');
  view = await startView(options.poise, run, join(folder, 'run'), '--foxglove', String(port));
  await view.prints(new RegExp(`ws://127\\.0\\.0\\.1:${port}\\b`));
});
after(async () => {
  await run?.stop();
  await view?.stop();
  rmSync(folder, {recursive: true, force: true});
});

/** A client of Foxglove's package that subscribes to what `wanted` says, and keeps what comes. */
async function connectClient(wanted = () => true, headers = {}) {
  const socket = new libraries.ws.WebSocket(`ws://127.0.0.1:${port}`, [PROTOCOL], {headers});
  const client = new FoxgloveClient({ws: socket});
  const seen = {info: undefined, channels: [], messages: {}, times: [], statuses: [], errors: [], socket, client};
  const topicOf = new Map();
  client.on('error', (error) => seen.errors.push(error));
  client.on('serverInfo', (info) => { seen.info = info; });
  client.on('status', (status) => seen.statuses.push(status));
  client.on('time', ({timestamp}) => seen.times.push(timestamp));
  client.on('advertise', (channels) => {
    for (const channel of channels) {
      seen.channels.push(channel);
      const schemaData = channel.schemaEncoding === 'protobuf' ? Buffer.from(channel.schema, 'base64') : Buffer.from(channel.schema);
      channel.decode = decoder(libraries, {...channel, schemaData});
      if (wanted(channel.topic)) topicOf.set(client.subscribe(channel.id), channel);
    }
  });
  client.on('message', ({subscriptionId, timestamp, data}) => {
    const channel = topicOf.get(subscriptionId);
    if (!channel) return;  // a test's own
    const {topic, decode} = channel;
    (seen.messages[topic] ??= []).push({time: timestamp, value: decode(new Uint8Array(data.buffer, data.byteOffset, data.byteLength))});
  });
  const closed = once(socket, 'close').then(() => { throw new Error(`closed: ${seen.errors}`); });
  closed.catch(() => {});
  seen.until = async (condition) => {
    const end = Date.now() + PATIENCE;
    while (!condition(seen)) {
      assert.ok(Date.now() < end, `${Object.entries(seen.messages).map(([k, v]) => `${k} ${v.length}`)} ${JSON.stringify(seen.statuses)}`);
      await Promise.race([sleep(20), closed]);
    }
    return seen;
  };
  await Promise.race([once(socket, 'open'), closed]);
  return seen;
}
const count = (seen, topic) => seen.messages[topic]?.length ?? 0;

test('every topic, decoded by its schema: the robot moves as the bus says', async () => {
  const everything = await connectClient();
  const silent = (s) => s.channels.map((c) => c.topic).filter((topic) => !count(s, topic) && !PERSON.includes(topic));
  await everything.until((s) => s.channels.length > 0 && silent(s).length === 0);
  assert.deepEqual(everything.errors, []);
  everything.client.close();
  const seen = await connectClient((topic) => topic.startsWith('/') || topic === 'GROUND_TRUTH');
  // Pictures of ticks whose truth came as well: a busy machine loses some of either.
  const truths = new Map();
  const pictures = (s) => {
    for (const {time, value} of (s.messages.GROUND_TRUTH ?? []).slice(truths.size)) truths.set(time, value);
    return (s.messages['/tf'] ?? []).filter(({time}) => truths.has(time));
  };
  await seen.until((s) => pictures(s).length >= 150);
  assert.match(seen.info.name, /push_double_support/);
  assert.deepEqual(seen.info.capabilities, ['time']);
  assert.deepEqual(seen.errors, []);
  for (const channel of seen.channels) {
    if (channel.schemaName.startsWith('foxglove.')) assert.deepEqual(schemaProblems(libraries, channel.decode.type), []);
  }
  for (const [topic, messages] of Object.entries(seen.messages)) {
    assert.ok(messages.slice(1).every(({time}, i) => time >= messages[i].time), topic);
  }
  assert.ok(seen.times.length > 50 && seen.times.slice(1).every((t, i) => t >= seen.times[i]));

  const urdf = seen.messages['/robot_description'][0].value.data;
  for (const {time, value} of pictures(seen)) {
    const state = truths.get(time);
    const [w, x, y, z] = state.base_orientation;
    const expected = forwardKinematics(urdf, {p: state.base_position, q: [x, y, z, w]}, state.joint_position);
    const world = {world: {p: [0, 0, 0], q: [0, 0, 0, 1]}};
    for (const t of value.transforms) {
      const {x: px, y: py, z: pz} = t.translation, {x: qx, y: qy, z: qz, w: qw} = t.rotation;
      world[t.child_frame_id] = pose.join(world[t.parent_frame_id], {p: [px, py, pz], q: [qx, qy, qz, qw]});
      assert.ok(pose.difference(world[t.child_frame_id], expected[t.child_frame_id])[0] < 1e-12);
    }
  }

  // Who comes later sees the robot too; an unsubscribed topic falls silent.
  const late = await connectClient((topic) => topic.startsWith('/'));
  await late.until((s) => ['/tf_static', '/robot', '/ground', '/robot_description', '/tf'].every((topic) => count(s, topic) > 0));
  assert.deepEqual(late.messages['/robot'][0].value, seen.messages['/robot'][0].value);
  assert.equal(count(late, 'ROBOT_STATE'), 0);
  late.client.unsubscribe(0);  // /tf, the first
  // What was on its way still comes, on a busy machine for a while.
  const pictured = async () => {
    const before = count(late, '/tf'), others = count(late, '/forces');
    await late.until((s) => count(s, '/forces') > others + 5);
    return count(late, '/tf') - before;
  };
  let came = await pictured();
  for (let tries = 0; came > 0 && tries < 20; ++tries) came = await pictured();
  assert.equal(came, 0);
  seen.client.close();
  late.client.close();
});

const get = (more) => `GET / HTTP/1.1\r\nHost: 127.0.0.1:${port}\r\n${more}\r\n`;
const upgrade = (more = '', host = `127.0.0.1:${port}`, protocol = `Sec-WebSocket-Protocol: ${PROTOCOL}\r\n`) =>
  `GET / HTTP/1.1\r\nHost: ${host}\r\n${more}Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n`
  + `${protocol}Sec-WebSocket-Key: ${randomBytes(16).toString('base64')}\r\n\r\n`;

async function firstLine(text) {
  const socket = connect(port, '127.0.0.1');
  socket.on('error', () => {});
  socket.write(text);
  const [data] = await Promise.race([once(socket, 'data'), once(socket, 'close').then(() => [''])]);
  socket.destroy();
  return data.toString('latin1').split('\r\n')[0];
}

test('pages of other sites, other names and other protocols are refused', async () => {
  assert.match(await firstLine(upgrade()), /101/);
  for (const origin of ['https://app.foxglove.dev', 'http://localhost:8080', 'http://127.0.0.1', 'file://']) {
    assert.match(await firstLine(upgrade(`Origin: ${origin}\r\n`)), /101/, origin);
  }
  for (const origin of ['https://evil.example', 'http://localhost.evil.example', 'http://127.0.0.1.evil.example', 'null',
    'https://app.foxglove.dev.evil.example']) {
    assert.match(await firstLine(upgrade(`Origin: ${origin}\r\n`)), /403/, origin);
  }
  for (const host of ['evil.example', `evil.example:${port}`, '127.0.0.1', `127.0.0.1:${port + 1}`]) {
    assert.match(await firstLine(upgrade('', host)), /403/, host);
  }
  assert.match(await firstLine(upgrade('', undefined, '')), /400/);
  assert.match(await firstLine(upgrade('', undefined, 'Sec-WebSocket-Protocol: other\r\n')), /400/);
  assert.match(await firstLine(upgrade(`Host: 127.0.0.1:${port}\r\n`)), /400/);
  assert.match(await firstLine(upgrade().replace(/Sec-WebSocket-Key: .*/, 'Sec-WebSocket-Key: abc')), /400/);
  assert.match(await firstLine(get('')), /426/);
  // As fast as they come: who has been refused takes nobody's place.
  for (let i = 0; i < 200; ++i) assert.match(await firstLine(get('')), /426/, `${i}`);
});

/** A masked frame, as clients send them. */
function frame(payload, opcode) {
  const bytes = Buffer.from(payload), mask = randomBytes(4);
  const head = bytes.length < 126 ? Buffer.from([0x80 | opcode, 0x80 | bytes.length])
    : Buffer.concat([Buffer.from([0x80 | opcode, 0x80 | 127]), Buffer.alloc(4), Buffer.from([bytes.length >>> 24, bytes.length >>> 16, bytes.length >>> 8, bytes.length])]);
  return Buffer.concat([head, mask, Buffer.from(bytes.map((b, i) => b ^ mask[i % 4]))]);
}

async function openRaw() {
  const socket = connect(port, '127.0.0.1');
  socket.on('error', () => {});
  socket.write(upgrade());
  await once(socket, 'data');
  return socket;
}

test('nonsense, floods and slow clients cost nobody else anything', async () => {
  const witness = await connectClient((topic) => topic === '/tf');
  const healthy = async () => {
    const n = count(witness, '/tf');
    await witness.until((s) => count(s, '/tf') > n + 5);
  };
  const texts = ['', '{', '[]', '{"op":5}', '{"op":"advertise","channels":[]}', '{"op":"subscribe"}', '{"op":"subscribe","subscriptions":[1]}',
    '{"op":"subscribe","subscriptions":[{"id":-1,"channelId":1}]}', '{"op":"subscribe","subscriptions":[{"id":1,"channelId":9999}]}',
    '{"op":"subscribe","subscriptions":[{"id":1e300,"channelId":1}]}', '{"op":"unsubscribe","subscriptionIds":[null,7,-3]}',
    '['.repeat(60000), '{"op":"'.padEnd(60000, 'x'), '\xff\xfe'];
  const answered = await connectClient(() => false);
  for (const text of texts) answered.socket.send(text);
  answered.socket.send(Buffer.alloc(64, 1));
  await answered.until((s) => s.statuses.length >= texts.length);
  assert.ok(answered.statuses.every((s) => s.level === 2));
  const [first] = answered.channels;
  answered.client.subscribe(first.id);
  answered.client.subscribe(first.id);  // twice
  await answered.until((s) => s.statuses.some((x) => /has a subscription/.test(x.message)));
  answered.client.close();

  // Random bytes, random frames, a frame that is too long, a flood of requests without reading the answers.
  const sockets = await Promise.all(Array.from({length: 8}, openRaw));
  for (const socket of sockets.slice(0, 3)) for (let i = 0; i < 300; ++i) socket.write(randomBytes(64));
  for (const socket of sockets.slice(3, 5)) for (let i = 0; i < 300; ++i) socket.write(frame(randomBytes(40), 1 + (i & 1)));
  sockets[5].write(frame('x'.repeat(1 << 20), 1));
  sockets[6].pause();
  for (let i = 0; i < 3000; ++i) sockets[6].write(frame('{"op":"nonsense"}', 1));
  await healthy();

  // One that subscribes to everything and takes nothing: dropped within its time, the others go on.
  sockets[7].pause();
  const all = witness.channels.map((c, i) => ({id: i, channelId: c.id}));
  sockets[7].write(frame(JSON.stringify({op: 'subscribe', subscriptions: all}), 1));
  await healthy();
  for (const socket of sockets) socket.destroy();

  // More connections than there may be.
  const many = Array.from({length: 40}, () => connect(port, '127.0.0.1').on('error', () => {}));
  await healthy();
  for (const socket of many) socket.destroy();
  await sleep(100);
  assert.match(await firstLine(upgrade()), /101/);
  witness.client.close();
});

test('the run knew nothing of it; its end ends nothing here', async () => {
  const seen = await connectClient((topic) => topic === 'ROBOT_STATE' || topic === '/robot');
  await seen.until((s) => count(s, 'ROBOT_STATE') > 50);
  await run.stop();
  await view.prints(/the run has ended/);
  const late = await connectClient((topic) => topic === '/robot');
  await late.until((s) => count(s, '/robot') === 1);
  const summary = JSON.parse(readFileSync(join(folder, 'run', 'summary.json'), 'utf8'));
  const defects = summary.checks.find((c) => c.name === 'log_defects');
  assert.ok(defects?.measured === 0, JSON.stringify(defects));
  seen.client.close();
  late.client.close();
});
