// `poise benchmark`: a quick subset gives the recorded table, the figures are the pendulum's, and what is the set's stays so.
// Usage: node --test benchmark_test.mjs (POISE: the program)
import assert from 'node:assert/strict';
import {spawn, spawnSync} from 'node:child_process';
import {createHash} from 'node:crypto';
import {existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {test} from 'node:test';
import {fileURLToPath} from 'node:url';

const deploy = (...path) => readFileSync(new URL(`../../deploy/${path.join('/')}`, import.meta.url), 'utf8');
// The record is of this build's bits, as deploy/bits/record.json is: recorded anew where a change moves those, and then the commit says why.
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
  assert.equal(about.benchmark.name, 'balance_4');
  assert.equal(about.benchmark.sha1, record.set_sha1, 'balance_4 is fixed: a change makes another set');
  const build = {instruction_set: about.poise.instruction_set, libraries: about.libraries, glibc: about.glibc};
  if (JSON.stringify(build) !== JSON.stringify(record.build)) {
    console.log(`not compared: the record is of ${JSON.stringify(record.build)}, this build of ${JSON.stringify(build)}`);
  } else {
    assert.equal(about.table_sha1, record.table_sha1, read('quick', 'benchmark.csv'));
  }
  for (const file of ['charts.html', 'charts.json', 'set/graph.pbtxt', 'set/push_double_scenario.pbtxt', 'parts/late/table.csv']) {
    assert.ok(existsSync(join(folder, 'quick', file)), file);
  }
  // Nothing of this machine, so that it can be handed on.
  for (const file of ['benchmark.csv', 'benchmark.json', 'charts.json', 'charts.html']) assert.ok(!read('quick', file).includes(folder), file);
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

/** The part `blocks` of a set, its first run alone. */
function firstBlock(set, robot, out) {
  writeFileSync(join(folder, `${set}_first.pbtxt`), `base: "${set}"\nset: "part[blocks].quick=1"\n`);
  poise(['benchmark', `${set}_first.pbtxt`, '--quick', '--part', 'blocks', '--robot', robot, '--world', 'mujoco', '--out', out]);
  return JSON.parse(read(out, 'parts/blocks/results.jsonl').trim().split('\n')[1]);
}

// balance_1's block reaches 16 mm under the other sole of a heron whose feet stand 3 cm apart.
test('no block rises under the sole that carries', () => {
  mkdirSync(join(folder, 'narrow'));
  writeFileSync(join(folder, 'narrow/heron.urdf'), deploy('robots/heron/heron.urdf'));
  writeFileSync(join(folder, 'narrow/narrow.pbtxt'), deploy('robots/heron/heron.pbtxt').replace('\nstance {', '\nstance {\n  foot_spacing: 0.122'));
  const before = firstBlock('balance_1', 'narrow', 'narrow_1');
  assert.equal(before.outcome, 'fell');
  assert.match(before.phase, /lift|lower/);
  const now = firstBlock('balance_2', 'narrow', 'narrow_2');
  assert.equal(now.outcome, 'stands', now.reason);
  assert.equal(now.phase, 'load');
});

// The makers' robots with the narrowest stances that are known.
const makers = process.env.POISE_ROBOTS ?? fileURLToPath(new URL('../../../shared/robots', import.meta.url));
for (const [robot, file] of [['talos', 'talos_reduced_box.urdf'], ['tocabi', 'dyros_tocabi.urdf']]) {
  const skip = existsSync(join(makers, file)) ? false : `${file} is not in $POISE_ROBOTS`;
  test(`${robot} lifts its foot and lands`, {skip}, () => {
    poise(['robot', 'import', join(makers, file), '--name', robot, '--to', robot]);
    const row = firstBlock('balance_2', robot, `${robot}_block`);
    assert.equal(row.outcome, 'stands', row.reason);
    assert.equal(row.metrics.violated_ticks, 0);
  });
}

// A block on which half of heron sinks to the ground. With the gains of hard ground the load swings to and fro until the sole tips.
test('on soft ground the COM is controlled slower', () => {
  const block = {stiffness: 1700, damping: 128, height: 0.088, length: 0.32, width: 0.192, tilt_roll: 0.122, tilt_pitch: 0.076};
  const run = (out, ...set) => {
    const changes = [...Object.entries(block).map(([field, value]) => `sim.block.${field}=${value}`), 'sim.block.x=0', 'sim.block.y=0.1',
      'step_planner.phase[1].foot.height_above_support=0.117', 'step_planner.phase[2].foot.height_above_support=0.083',
      'step_planner.contact.search_depth=0.068', 'seed=417108', ...set];
    return poise(['run', 'narrow_2/set/blocks_scenario.pbtxt', '--robot', 'heron/heron', '--world', 'mujoco', '--inline', '--out', out,
      ...changes.flatMap((change) => ['--set', change])], set.length > 0 ? 1 : 0);
  };
  run('soft');
  assert.match(run('soft_as_hard', 'task_controller.com.kp=101', 'task_controller.com.kd=14.1', 'task_controller.base_velocity_cutoff=12.9'), /fell/);
});

test('the table is the same whatever else the machine does', () => {
  const busy = Array.from({length: 4}, () => spawn('timeout', ['600', 'sh', '-c', 'while :; do :; done']));
  try {
    for (const jobs of ['1', '8']) {
      poise(['benchmark', '--quick', '--part', 'late', '--jobs', jobs, '--out', `busy_${jobs}`]);
      assert.deepEqual(rows(`busy_${jobs}`), rows('quick').filter((row) => row.part === 'late'));
    }
    assert.equal(read('busy_8', 'benchmark.csv'), read('busy_1', 'benchmark.csv'));
  } finally {
    busy.forEach((each) => each.kill());
  }
});

test('a row of the charts has the command that makes its run again', () => {
  const part = JSON.parse(read('quick', 'charts.json')).parts.find(({name}) => name === 'push_double');
  const command = (part.command + part.rows[0].set).replace('poise run ', '').replaceAll("'", '');
  const {status, stdout} = spawnSync(process.env.POISE, ['run', ...command.split(' '), '--inline', '--out', join(folder, 'again')],
    {encoding: 'utf8', cwd: join(folder, 'quick')});
  // The push at the limit, which is stood.
  assert.equal(status, 0, stdout);
  const limit = rows('quick').find((row) => row.part === 'push_double').value;
  assert.match(command, new RegExp(`scaled_impulse=${limit}`));
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
  assert.match(refused(['--set', 'task_controller.com.kpp=3']), /kpp/);
  assert.match(refused(['--set', 'task_controller.com.kp=-3']), /kp/);
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
