// `poise view --control` under attack: requests and frames that no page of ours sends, wrong tokens, foreign origins, too many and too
// slow clients. Usage: node hostile_test.mjs --poise PROGRAM
//   POISE_HOSTILE_REQUESTS: how many in all (default 30000); with POISE_HOSTILE_ROUNDS=N the run's ticks are timed with and without
//   the attack in turn, N times each, and the p99 of each is printed.
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {mkdtempSync, readFileSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {after, test} from 'node:test';
import {parseArgs} from 'node:util';
import {replaysInPart, startRun, startView} from './live_run.mjs';
import {open, openStream, upgrade} from './raw_socket.mjs';

const {values: options} = parseArgs({options: {poise: {type: 'string'}}});
const requests = Number(process.env.POISE_HOSTILE_REQUESTS ?? 30000);
const rounds = Number(process.env.POISE_HOSTILE_ROUNDS ?? 0);
const AT_ONCE = 24;
const FRAMES = 40;  // of a connection that has the token
const folder = mkdtempSync(join(tmpdir(), 'poise-hostile-'));
const programs = [];
after(async () => {
  for (const program of programs) await program.stop();
  rmSync(folder, {recursive: true, force: true});
});

/** The same numbers every time: mulberry32. */
function generator(seed) {
  let a = seed;
  return (n) => {
    a = (a + 0x6d2b79f5) | 0;
    let t = Math.imul(a ^ (a >>> 15), 1 | a);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return Math.floor(((t ^ (t >>> 14)) >>> 0) / 4294967296 * n);
  };
}
const random = generator(1806 + Number(process.env.POISE_TEST_SEED ?? 0));

/** Bytes of it changed, cut, doubled or inserted. */
function mutate(bytes) {
  const parts = [...bytes];
  for (let k = 1 + random(4); k > 0; --k) {
    const at = random(parts.length + 1);
    [() => { if (at < parts.length) parts[at] = random(256); }, () => parts.splice(at, random(20)),
      () => parts.splice(at, 0, ...parts.slice(at, at + random(60))), () => parts.splice(at, 0, random(256), random(256))][random(4)]();
  }
  return Buffer.from(parts);
}

/** A masked frame of a text. */
function frame(text, opcode = 1) {
  const data = Buffer.from(text);
  const mask = Buffer.from([1, 2, 3, 4]);
  const length = data.length < 126 ? [0x80 | data.length] : [0x80 | 126, data.length >> 8, data.length & 255];
  return Buffer.concat([Buffer.from([0x80 | opcode, ...length]), mask, data.map((b, i) => b ^ mask[i % 4])]);
}

const PUSH = '{"client":1,"id":1,"do":"push","body":"trunk","force":[1e9,0,0],"point":[0,0,0],"duration":0.1}';
const SET = '{"client":1,"id":2,"do":"set","field":"task_controller.com.kp","value":1e9}';
const BAD_TEXTS = [PUSH.replace('1e9', '1e999'), PUSH.replace('"trunk"', '"nobody"'), PUSH, SET, SET.replace('com.kp', 'com.kq'),
  '{"client":1,"id":3,"do":"fly"}', '[[[[[[[[', 'x'.repeat(900), '{"client":1,"id":4,"do":"back","ticks":0}'];
// Each has two defects: what is left of them after a few bytes have changed is none that a run may take.
const WORSE_TEXTS = [PUSH.replace('1e9', '1e999').replace('trunk', 'nobody'), SET.replace('com.kp', 'none'), ...BAD_TEXTS.slice(5)];

/** One connection without the right token, or from elsewhere: a request that must get no 200 and no 101. */
async function outsider(port, token) {
  const good = `GET /?token=${token} HTTP/1.1\r\nHost: 127.0.0.1:${port}\r\n\r\n`;
  const wrong = [...token].map((c) => c === '0' ? '1' : '0').join('');
  const kinds = [
    () => mutate(Buffer.from(good.replace(token, wrong))),
    () => Buffer.from(good.replace(`127.0.0.1:${port}`, 'evil.example')),
    () => Buffer.from(good.replace('\r\n\r\n', '\r\nOrigin: http://evil.example\r\n\r\n')),
    () => Buffer.from(upgrade(port, {target: `/stream?token=${token}`, origin: 'http://evil.example'})),
    () => mutate(Buffer.from(upgrade(port, {target: '/stream'}))),
    () => Buffer.from(upgrade(port, {target: `/stream?token=${wrong}`})),
    () => Buffer.from(`POST /?token=${token} HTTP/1.1\r\nHost: 127.0.0.1:${port}\r\nContent-Length: 5\r\n\r\nhello`),
    () => Buffer.alloc(1 + random(20000), random(256)),
    () => Buffer.from(good.slice(0, random(good.length))),  // cut
  ];
  const {socket, closed} = open(port);
  socket.end(kinds[random(kinds.length)]());
  const line = (await closed).toString('latin1').split('\r\n')[0];
  assert.doesNotMatch(line, /^HTTP\/1\.[01] (101|200)/, line);
  return 1;
}

/** One connection that has the token and sends what no page of ours does; what is accepted must have no effect. */
async function insider(port, token) {
  const stream = await openStream(port, {target: `/stream?from=9007199254740991&token=${token}`});
  if (!/101/.test(stream.answer)) return 1;  // too many
  stream.socket.resume();
  let sent = 1;
  for (let k = 0; k < FRAMES && !stream.socket.closed; ++k, ++sent) {
    const text = BAD_TEXTS[random(BAD_TEXTS.length)];
    const worse = WORSE_TEXTS[random(WORSE_TEXTS.length)];
    stream.socket.write(random(3) > 0 ? frame(text, random(8) > 0 ? 1 : random(16)) : mutate(frame(worse)));
  }
  stream.socket.end();
  stream.socket.setTimeout(2000, () => stream.socket.destroy());
  await stream.closed;
  return sent;
}

/** What pages are told, first of all that an honest one hears. */
async function control(port, token) {
  const {socket, closed} = open(port);
  let heard = '';
  socket.write(upgrade(port, {target: `/stream?from=9007199254740991&token=${token}`}));
  const told = new Promise((done) => {
    socket.on('data', (data) => {
      heard += data.toString('latin1');
      if (/"control":.*"acts":\[.*?\]\}/s.test(heard)) done();
    });
  });
  await Promise.race([told, closed]);
  socket.destroy();
  return heard;
}

/** `share`: of connections that have the token. */
async function attack(port, token, count, share, going = () => true) {
  let done = 0;
  const worker = async () => {
    while (done < count && going()) {
      const sent = await (random(100) >= 100 * share ? outsider(port, token) : insider(port, token));
      done += sent;  // not `done += await ...`, which reads `done` before it waits
    }
  };
  // Beside these, clients that say nothing and one that never reads.
  const idle = Array.from({length: 8}, () => open(port));
  const slow = await openStream(port, {target: `/stream?token=${token}`});
  slow.socket.pause();
  await Promise.all(Array.from({length: AT_ONCE}, worker));
  for (const {socket} of [...idle, slow]) socket.destroy();
  return done;
}

async function start(name, duration) {
  const run = startRun(options.poise, join(folder, name), '--realtime', '--duration', String(duration));
  programs.push(run);
  const view = await startView(options.poise, run, join(folder, name), '--control', '--keep', '1');
  programs.push(view);
  return {run, view, token: /token=(\w+)/.exec(view.url)[1]};
}

/** µs, of the component whose ticks take longest: of the run's own summary. */
function p99(name) {
  const summary = JSON.parse(readFileSync(join(folder, name, 'summary.json'), 'utf8'));
  return Math.max(...summary.components.map((c) => c.latency_us.p99));
}

test('an attack has no effect on the run', async () => {
  const {run, view, token} = await start('attacked', 3600);
  const began = performance.now();
  // Who has no token is not even read: no act has been told of.
  let done = await attack(view.port, token, Math.ceil(requests / 2), 0);
  assert.match(await control(view.port, token), /"acts":\[\]/);
  done += await attack(view.port, token, Math.floor(requests / 2), 0.25);
  const took = (performance.now() - began) / 1000;
  assert.ok(done >= requests);
  assert.equal(run.child.exitCode, null, run.output);  // it goes on
  // Acts were read, and each refused.
  const told = await control(view.port, token);
  assert.match(told, /"state":"refused"/);
  assert.doesNotMatch(told, /"state":"accepted"/);
  // The server lives, and serves who has the token.
  const page = await fetch(view.url);
  assert.equal(page.status, 200);
  assert.equal(page.headers.get('referrer-policy'), 'no-referrer');
  await run.stop();
  assert.equal(await view.stop(), 0);
  // Components took nothing but the view's own questions for settings.
  const log = join(folder, 'attacked');
  const csv = spawnSync(options.poise, ['log', 'export', log, '--csv', join(folder, 'csv')], {encoding: 'utf8'});
  assert.equal(csv.status, 0, csv.stdout + csv.stderr);
  const [head, ...answers] = readFileSync(join(folder, 'csv/OPERATOR_ANSWER.csv'), 'utf8').trim().split('\n').map((l) => l.split(','));
  const [kind, verdict] = ['kind', 'verdict'].map((name) => head.indexOf(name));
  const [ASK, DONE] = ['3', '1'];
  assert.ok(answers.some((a) => a[verdict] === DONE));
  assert.deepEqual(answers.filter((a) => a[verdict] === DONE && a[kind] !== ASK), []);
  // It gives the same bits again.
  replaysInPart(options.poise, log);
  console.log(`${done} requests and frames in ${took.toFixed(1)} s`);
});

if (rounds > 0) {
  test('p99 of the tick with and without the attack', async () => {
    const found = {alone: [], attacked: []};
    for (let k = 0; k < 2 * rounds; ++k) {
      const kind = k % 2 === 0 ? 'alone' : 'attacked';
      const {run, view, token} = await start(`${kind}${k}`, 20);
      let going = true;
      const attacking = kind === 'attacked' ? attack(view.port, token, Infinity, 0.25, () => going) : Promise.resolve();
      await run.ended;
      going = false;
      await attacking;
      await view.stop();
      found[kind].push(p99(`${kind}${k}`));
      console.log(`${kind}: p99 ${found[kind].at(-1)} µs`);
    }
    const median = (list) => [...list].sort((a, b) => a - b)[list.length >> 1];
    console.log(`p99 of the tick, median of ${rounds}: ${median(found.alone)} µs alone, ${median(found.attacked)} µs attacked`);
  });
}
