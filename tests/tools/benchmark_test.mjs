// `poise benchmark`: a quick subset gives the recorded table, the figures are the pendulum's, and what is the set's stays so.
// Usage: node --test benchmark_test.mjs (POISE: the program)
import assert from 'node:assert/strict';
import {spawn, spawnSync} from 'node:child_process';
import {createHash} from 'node:crypto';
import {existsSync, mkdtempSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {test} from 'node:test';

// Of this build's bits, as deploy/bits/record.json is: recorded anew where a change moves those, and then the commit says why.
const record = JSON.parse(readFileSync(new URL('benchmark_record.json', import.meta.url), 'utf8'));

const folder = mkdtempSync(join(tmpdir(), 'poise-benchmark-'));
process.on('exit', () => rmSync(folder, {recursive: true, force: true}));
const sha1 = (text) => createHash('sha1').update(text).digest('hex');
const read = (...path) => readFileSync(join(folder, ...path), 'utf8');
function poise(args, exit = 0) {
  const {status, stdout, stderr} = spawnSync(process.env.POISE, args, {encoding: 'utf8', cwd: folder, timeout: 200_000});
  assert.equal(status, exit, stdout + stderr);
  return stdout + stderr;
}
/** benchmark.csv as objects. */
function rows(name) {
  const [head, ...lines] = read(name, 'benchmark.csv').trim().split('\n').map((line) => line.split(','));
  return lines.map((line) => Object.fromEntries(head.map((key, i) => [key, Number.isNaN(Number(line[i])) ? line[i] : Number(line[i])])));
}

test('a quick subset gives the recorded table', () => {
  const printed = poise(['benchmark', '--quick', '--part', 'push_double', '--part', 'late', '--out', 'quick']);
  const about = JSON.parse(read('quick', 'benchmark.json'));
  assert.equal(sha1(read('quick', 'benchmark.csv')), about.table_sha1);
  assert.match(printed, new RegExp(about.table_sha1));
  assert.equal(about.benchmark.sha1, record.set_sha1, 'balance_1 is fixed: a change makes another set');
  const build = {instruction_set: about.poise.instruction_set, libraries: about.libraries, glibc: about.glibc};
  if (JSON.stringify(build) !== JSON.stringify(record.build)) {
    console.log(`not compared: the record is of ${JSON.stringify(record.build)}, this build of ${JSON.stringify(build)}`);
  } else {
    assert.equal(about.table_sha1, record.table_sha1, read('quick', 'benchmark.csv'));
  }
  for (const file of ['benchmark.html', 'set/graph.pbtxt', 'set/push_double_scenario.pbtxt', 'parts/late/table.csv', 'maps/push_double_1.svg']) {
    assert.ok(existsSync(join(folder, 'quick', file)), file);
  }
  // Nothing of this machine, so that it can be handed on.
  for (const file of ['benchmark.csv', 'benchmark.json', 'benchmark.html']) assert.ok(!read('quick', file).includes(folder), file);
});

// In closed form: the impulse is a share s of m sqrt(g h), the pendulum's bound m w d with w = sqrt(g / h), so that their ratio is
// s h / d. From the middle of the stance d is half a sole's length ahead and behind.
test('impulses and shares are the pendulum\'s', () => {
  const {robot} = JSON.parse(read('quick', 'benchmark.json'));
  const pushes = rows('quick').filter((row) => row.part === 'push_double' && row.point.startsWith('direction'));
  assert.deepEqual(pushes.map((row) => row.point), ['direction 0°', 'direction 90°', 'direction 180°', 'direction 270°']);
  for (const row of pushes) {
    assert.ok(row.value > 0.05 && row.value < 0.4, row.value);
    const impulse = row.value * robot.mass * Math.sqrt(9.81 * robot.com_height);
    assert.ok(Math.abs(row.impulse / impulse - 1) < 1e-3, `${row.impulse}, ${impulse}`);
    assert.ok(Math.abs(row.impulse_per_mass * robot.mass / row.impulse - 1) < 1e-12);
    const wT = Math.sqrt(9.81 / robot.com_height) * 0.1;
    const duration = Math.PI ** 2 * (1 + Math.exp(-wT)) / (2 * (wT ** 2 + Math.PI ** 2));
    assert.ok(Math.abs(row.share_of_lip_of_duration / row.share_of_lip / duration - 1) < 1e-3);
  }
  for (const i of [0, 2]) {
    const share = pushes[i].value * robot.com_height / 0.15;
    assert.ok(Math.abs(pushes[i].share_of_lip / share - 1) < 0.1, `${pushes[i].share_of_lip}, ${share}`);
  }
  const mean = rows('quick').find((row) => row.part === 'push_double' && row.point === 'mean');
  assert.ok(Math.abs(mean.impulse - pushes.reduce((sum, row) => sum + row.impulse / 4, 0)) < 1e-9);
});

test('an interrupted benchmark goes on and comes to the same', async () => {
  const args = ['benchmark', '--quick', '--part', 'late', '--jobs', '1', '--out', 'stopped'];
  const first = spawn(process.env.POISE, args, {cwd: folder, stdio: 'ignore'});
  const results = join(folder, 'stopped/parts/late/results.jsonl');
  const lines = () => (existsSync(results) ? readFileSync(results, 'utf8').split('\n').length : 0);
  while (lines() < 4 && first.exitCode === null) await new Promise((done) => setTimeout(done, 20));
  first.kill('SIGINT');
  const code = await new Promise((done) => (first.exitCode === null ? first.on('exit', done) : done(first.exitCode)));
  assert.equal(code, 1);
  assert.ok(!existsSync(join(folder, 'stopped/benchmark.csv')));
  poise(args, 2);  // without --resume nothing is replaced
  poise([...args, '--resume']);
  const late = (name) => rows(name).filter((row) => row.part === 'late');
  assert.deepEqual(late('stopped'), late('quick'));
});

test('what is the set\'s cannot be changed', () => {
  const refused = (args) => poise(['benchmark', '--quick', '--out', 'refused', ...args], 2);
  assert.match(refused(['--set', 'sim.push[0].duration=0.01']), /sim is the benchmark's.*task_controller/s);
  assert.match(refused(['--set', 'seed=2']), /seed is the benchmark's/);
  writeFileSync(join(folder, 'mine.pbtxt'), 'name: "mine" task_controller { com { kp: 100 kd: 14 } } sim { step: 0.002 }');
  assert.match(refused(['--controller', 'mine.pbtxt']), /mine\.pbtxt: sim is the benchmark's/);
  assert.match(refused(['--part', 'push_doubel']), /no such part.*did you mean.*push_double/s);
  assert.match(refused(['balance_0']), /no benchmark named 'balance_0'/);
  assert.ok(!existsSync(join(folder, 'refused')));
});

test('a controller of one\'s own is what is measured', () => {
  writeFileSync(join(folder, 'weak.pbtxt'), 'contact_wrench_monitor { balancing: false } graph: "balance"');
  poise(['benchmark', '--quick', '--part', 'push_double', '--controller', 'weak.pbtxt', '--out', 'weak']);
  poise(['benchmark', '--quick', '--part', 'push_double', '--without', 'balancing', '--out', 'without']);
  // The same, said in two ways; and less than with balancing, which the paper is about.
  assert.deepEqual(rows('weak'), rows('without'));
  const mean = (name) => rows(name).find((row) => row.point === 'mean').value;
  assert.ok(mean('weak') < 0.8 * mean('quick'), `${mean('weak')}, ${mean('quick')}`);
  assert.match(read('weak', 'set/push_double_scenario.pbtxt'), /balancing: false/);
});
