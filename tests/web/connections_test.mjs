// `poise view` of a run in progress before hostile and slow connections, and called wrongly. Its times of patience pass side by side.
// Usage: node connections_test.mjs --poise PROGRAM
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {mkdtempSync, readFileSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {after, describe, test} from 'node:test';
import {parseArgs} from 'node:util';
import {startRun, startView} from './live_run.mjs';
import {ask, open, openStream, upgrade} from './raw_socket.mjs';

const {values: options} = parseArgs({options: {poise: {type: 'string'}}});
const folder = mkdtempSync(join(tmpdir(), 'poise-connections-'));
const path = (name) => join(folder, name);
after(() => rmSync(folder, {recursive: true, force: true}));

async function start(name) {
  const run = startRun(options.poise, path(name), '--duration', '3');
  return {run, view: await startView(options.poise, run, path(name))};
}

describe('connections', {concurrency: true}, () => {
  test('hostile connections end, the server and the run go on', async () => {
    const {run, view} = await start('hostile');
    const {port} = view;
    const get = (target, host = `127.0.0.1:${port}`, lines = '') => `GET ${target} HTTP/1.1\r\nHost: ${host}\r\n${lines}\r\n`;
    const idle = open(port);  // says nothing
    const half = open(port);
    half.socket.write('GET / HT');
    const attacks = [
      ['\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03 hello\r\n\r\n', /400/],
      [get('/', 'evil.example'), /403/], [get('/', `evil.example:${port}`), /403/], ['GET / HTTP/1.0\r\n\r\n', /403/],
      [get('/', undefined, 'Origin: http://evil.example\r\n'), /403/],
      [upgrade(port, {origin: 'http://evil.example'}), /403/], [upgrade(port, {host: `evil.example:${port}`}), /403/],
      [upgrade(port, {origin: 'null'}), /403/], [upgrade(port, {target: '/stream?from=-1'}), /404/],
      [upgrade(port, {target: '/stream?from=99999999999999999999'}), /404/], [upgrade(port, {target: '/other'}), /404/],
      [get('/', undefined, `Host: 127.0.0.1:${port}\r\n`), /400/],
      [get('/', undefined, `Origin: http://127.0.0.1:${port}\r\nOrigin: http://evil.example\r\n`), /400/],
      [upgrade(port).replace(/Sec-WebSocket-Key: .*/, 'Sec-WebSocket-Key: abc'), /400/],
      [get('/../../etc/passwd'), /404/], [get('/ticks?before=-1'), /404/], [get('/ticks?before=x'), /404/],
      [get('/ticks?before=10', 'evil.example'), /403/], [get('/ticks?before=9007199254740993'), /200/], [get('/ticks'), /200/],
      [`POST / HTTP/1.1\r\nHost: 127.0.0.1:${port}\r\nContent-Length: 0\r\n\r\n`, /405/],
      [get('/', undefined, `X: ${'x'.repeat(1 << 17)}\r\n`), /^(HTTP\/1\.1 4\d\d.*)?$/],
      [`POST / HTTP/1.1\r\nHost: 127.0.0.1:${port}\r\nContent-Length: 99999999999\r\n\r\n`, /^HTTP\/1\.1 4/],
      [Buffer.alloc(1 << 16, 0), /^(HTTP\/1\.1 400.*)?$/],
    ];
    for (const [bytes, answer] of attacks) assert.match(await ask(port, bytes), answer, String(bytes).slice(0, 120));

    // Frames: a message, one of 2^63 bytes, one without a mask, reserved bits, a long ping, a cut frame.
    const masked = (head, ...rest) => Buffer.from([...head, 1, 2, 3, 4, ...rest]);
    const frames = [masked([0x81, 0x83], 5, 6, 7), masked([0x82, 0xff, 0x7f, 255, 255, 255, 255, 255, 255, 255]),
      masked([0x82, 0xfe, 0xff, 0xff], ...new Array(0xffff).fill(0)), Buffer.from([0x81, 3, 65, 66, 67]),
      masked([0xf1, 0x80]), masked([0x89, 0xfe, 0x10, 0x00]), masked([0x80, 0x81], 1)];
    for (const frame of frames) {
      const stream = await openStream(port);
      assert.match(stream.answer, /101/);
      stream.socket.write(frame);
      await stream.closed;
    }
    const cut = await openStream(port, {target: '/stream?from=9007199254740993'});
    cut.socket.write(Buffer.from([0x82, 0xff]));
    cut.socket.end();
    await cut.closed;
    await Promise.all([idle.closed, half.closed]);

    // More connections than it takes at a time.
    const many = Array.from({length: 64}, () => open(port));
    await Promise.all(many.map((connection) => connection.closed));

    const page = await ask(port, get('/'));
    assert.match(page, /200/);
    await run.ended;
    const summary = JSON.parse(readFileSync(path('hostile/summary.json'), 'utf8'));
    assert.equal(summary.ticks, summary.planned_ticks);
    assert.equal(summary.checks.find((c) => c.name === 'log_defects').measured, 0);
    assert.equal(JSON.parse(readFileSync(path('hostile/recorder.json'), 'utf8')).complete, true);
    assert.match(await ask(port, get('/')), /200/);
    assert.equal(await view.stop(), 0);
  });

  test('a client that does not read is dropped, one that reads is not', async () => {
    const {run, view} = await start('slow');
    const slow = await openStream(view.port);
    slow.socket.pause();
    const quick = await openStream(view.port);
    await view.prints(/was dropped/);
    slow.socket.resume();
    await slow.closed;
    await run.ended;
    assert.equal(quick.socket.closed, false);
    quick.socket.destroy();
    assert.equal(await view.stop(), 0);
  });
});

test('wrong usage is told', async () => {
  const poise = (...parameters) => spawnSync(options.poise, ['view', ...parameters], {encoding: 'utf8'});
  for (const [parameters, text] of [[[path('none')], /no such run folder/], [[path('slow')], /has ended.*poise report/],
    [[path('slow/run.lcm')], /file/], [['--port', '70000'], /port/], [['--keep', '0'], /keep/]]) {
    const {status, stderr} = poise(...parameters);
    assert.equal(status, 2);
    assert.match(stderr, text);
  }
  assert.match(poise('--help').stdout, /--port/);
});
