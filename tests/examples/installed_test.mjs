// The tutorial of one's own component, followed literally: examples/foot_load is built against an installed tree that was moved, and runs
// with the installed programs alone.
// Usage: POISE_BUILD=build/release node --test installed_test.mjs
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {cpSync, existsSync, mkdirSync, mkdtempSync, readFileSync, renameSync, rmSync, symlinkSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {dirname, join} from 'node:path';
import {after, before, test} from 'node:test';
import {fileURLToPath} from 'node:url';
import {commandsOf, untrueLines} from '../docs/markdown.mjs';

const root = join(dirname(fileURLToPath(import.meta.url)), '../..');
const build = process.env.POISE_BUILD ?? join(root, 'build/release');
const folder = mkdtempSync(join(tmpdir(), 'poise-installed-'));
const home = join(folder, 'home'), checkout = join(folder, 'checkout');
const prefix = join(home, 'poise'), project = join(home, 'foot_load'), own = join(project, 'build');  // as the tutorial has them
const page = 'docs/start/own_component.md';

/** What a command prints; only the environment given, so that nothing of this checkout is found by it. */
function run(command, args, {env = {}, exit = 0} = {}) {
  const result = spawnSync(command, args, {
    encoding: 'utf8', cwd: folder, timeout: 280_000, maxBuffer: 1 << 27,
    env: {PATH: '/usr/local/bin:/usr/bin:/bin', HOME: folder, LANG: 'C.UTF-8', POISE_RUNS_DIR: join(folder, 'runs'), ...env},
  });
  assert.equal(result.status, exit, `${command} ${args.join(' ')}: ${result.stdout}${result.stderr}${result.error ?? ''}`);
  return result.stdout + result.stderr;
}
const poise = (args, options = {}) =>
  run(join(prefix, 'bin/poise'), args, {env: {POISE_PATH: own}, ...options});

/** The tutorial's commands, in a folder like a built checkout; what they print. */
function follow(commands, HOME) {
  const script = commands.map(({line, text}) => `${text} || { echo "${page}:${line} ended with $?"; exit 1; }\n`).join('');
  const result = spawnSync('bash', ['-c', `exec 2>&1\n${script}`], {
    encoding: 'utf8', cwd: checkout, timeout: 280_000, maxBuffer: 1 << 27,
    env: {PATH: '/usr/local/bin:/usr/bin:/bin', HOME, LANG: 'C.UTF-8'},
  });
  assert.equal(result.status, 0, `${result.stdout}${result.error ?? ''}`);
  return result.stdout;
}

before(() => {
  for (const made of [home, join(checkout, 'build'), join(folder, 'elsewhere')]) mkdirSync(made, {recursive: true});
  symlinkSync(build, join(checkout, 'build/release'));
  const [install, ...others] = commandsOf(page);
  assert.match(install.text, /^cmake --install/);
  follow([install], join(folder, 'elsewhere'));
  renameSync(join(folder, 'elsewhere/poise'), prefix);  // the tree may be moved
  assert.deepEqual(untrueLines(page, follow(others, home)), []);
});
after(() => rmSync(folder, {recursive: true, force: true}));

test('the installed tree names no folder of this machine', () => {
  for (const file of ['lib/cmake/poise/poise-config.cmake', 'lib/cmake/poise/PoiseModule.cmake']) {
    assert.ok(!readFileSync(join(prefix, file), 'utf8').includes(root), file);
  }
});

test('runs without any module', () => {
  const out = poise(['run', 'stand', '--duration', '0.5', '--inline'], {env: {}});
  assert.match(out, /stands: ticks fallen/);
  assert.match(poise(['list', 'scenarios'], {env: {}}), /push_double_support/);
});

test('lists what the module brings', () => {
  assert.match(poise(['list', 'scenarios']), /watch_load +Stands, and watches/);
  assert.match(poise(['list', 'graphs']), /balance_load/);
  assert.match(poise(['list', 'metrics']), /foot_load_peak +N +largest filtered load/);
  assert.match(poise(['list', 'messages', 'gait_lab.foot_load_t']), /N, of all feet/);
  assert.match(poise(['list', 'components', 'foot_load']), /output +foot_load +gait_lab\.foot_load_t/);
  const fields = poise(['list', 'fields', 'foot_load']);
  assert.match(fields, /foot_load\.time_constant.*\n.*first-order low-pass/);
  assert.match(fields, /0\.05/);
  poise(['graph', 'check', 'balance_load']);
});

test('its program describes itself', () => {
  const about = JSON.parse(run(join(own, 'lib/poise/bin/foot_load'), ['--describe']));
  assert.deepEqual(about.inputs, [{name: 'robot_state', type: 'robot_state_t', kind: 'same tick'}]);
  assert.deepEqual(about.outputs, [{name: 'foot_load', type: 'gait_lab.foot_load_t'}]);
  assert.deepEqual(about.settings, [{path: 'foot_load.time_constant', type: 'number', default: '0.05', unit: 's',
                                     meaning: 's, of the first-order low-pass'}]);
});

let bits;
for (const [how, flags] of [['processes', []], ['one process', ['--inline']]]) {
  test(`runs as ${how}, replays, reports`, () => {
    const out = join(folder, how.replace(' ', '_'));
    const printed = poise(['run', 'watch_load', ...flags, '--out', out]);
    assert.match(printed, /largest load of a foot/);
    const replay = poise(['replay', out, '--component', 'foot_load']);
    assert.match(replay, /FOOT_LOAD: 1000 messages, the same bits/);
    const csv = poise(['echo', 'FOOT_LOAD', 'load', 'total', 'sum', '--csv', '--log', out]);
    assert.ok(csv.split('\n').length > 1000, csv.slice(0, 500));
    bits ??= csv;
    assert.equal(csv, bits);  // as processes and in one process: the same numbers
    poise(['report', out, '--html', join(folder, 'page.html'), '--force']);
    const page = readFileSync(join(folder, 'page.html'), 'utf8');
    assert.match(page, /"name":"FOOT_LOAD"/);
    assert.match(page, /N, filtered, positive when the foot presses/);
    poise(['log', 'export', out, '--mcap', join(folder, 'log.mcap'), '--force']);
    assert.match(readFileSync(join(folder, 'log.mcap'), 'latin1'), /poise\.gait_lab_foot_load_t/);
  });
}

// The robot stands: the filtered loads of both feet are its weight, whatever the filter does.
test('the numbers are right', () => {
  const rows = bits.trim().split('\n').map((line) => line.split(','));
  const total = rows[0].findIndex((name) => name.endsWith('total'));
  assert.ok(total > 0, rows[0].join());
  const last = Number(rows.at(-1)[total]);
  const urdf = readFileSync(join(prefix, 'share/poise/robots/dyros/dyros_legs.urdf'), 'utf8');
  const mass = [...urdf.matchAll(/<mass\s+value="([\d.e+-]+)"/g)].reduce((sum, m) => sum + Number(m[1]), 0);
  assert.ok(mass > 10, `${mass} kg`);
  assert.ok(Math.abs(last - mass * 9.81) < 0.02 * mass * 9.81, `${last} N of ${mass} kg`);
});

test('a setting of hers is set, and refused, like any', () => {
  const slow = poise(['run', 'watch_load', '--inline', '--set', 'foot_load.time_constant=0.5', '--out', join(folder, 'slow')]);
  assert.match(slow, /--set: foot_load\.time_constant=0\.5/);
  assert.match(poise(['run', 'watch_load', '--set', 'foot_load.time_constant=-1'], {exit: 2}), /foot_load\.time_constant: is -1; must be 0 or more/);
  assert.match(poise(['run', 'watch_load', '--set', 'foot_load.time_konstant=1'], {exit: 2}), /did you mean.*time_constant/);
});

test('what is not there is said with the places that were searched', () => {
  const without = {env: {}, exit: 2};
  const scenario = join(project, 'share/scenarios/watch_load.pbtxt');
  assert.match(poise(['run', scenario], without), /balance_load.*searched:.*share\/poise\/graphs|foot_load/s);
  assert.match(poise(['run', 'watch_load'], without), /no scenario named 'watch_load'/);
  assert.match(poise(['list', 'graphs'], {env: {POISE_PATH: join(folder, 'nowhere')}, exit: 2}), /POISE_PATH: .*nowhere: there is no such folder/);
});

test('a module of another Poise is refused by name', () => {
  const other = join(folder, 'other');
  cpSync(join(own, 'lib'), join(other, 'lib'), {recursive: true});
  const module = join(other, 'lib/poise/modules/gait_lab.so');
  const bytes = readFileSync(module);
  const at = bytes.indexOf('poise-module-build:') + 'poise-module-build:'.length;
  bytes.write('x', at);
  writeFileSync(module, bytes);
  assert.match(poise(['list', 'graphs'], {env: {POISE_PATH: other}, exit: 2}), /gait_lab\.so: was built against Poise x.*build it anew/);
  writeFileSync(module, 'no module');
  assert.match(poise(['list', 'graphs'], {env: {POISE_PATH: other}, exit: 2}), /gait_lab\.so: is no module of Poise/);
});

const fused = readFileSync('/proc/cpuinfo', 'utf8').match(/\bfma\b/) ? false : 'this processor has no fused multiply-add';
test('libraries of other compiler flags give the same bits however the run is made', {skip: fused}, () => {
  const source = join(root, 'tests/examples/other_flags'), made = join(folder, 'other_flags');
  run('cmake', ['-S', source, '-B', made, '-G', 'Ninja', `-DCMAKE_PREFIX_PATH=${prefix}`]);
  run('cmake', ['--build', made]);
  const ways = {inline: ['--inline'], processes: [], host: ['--host', 'shared=sums,step_planner']};
  const sums = Object.entries(ways).map(([name, flags]) => {
    const out = join(folder, `flags_${name}`), env = {POISE_PATH: made};
    poise(['run', 'stand', '--set', 'graph=other_flags', '--duration', '0.4', ...flags, '--out', out], {env});
    return poise(['echo', 'SUMS', 'plain', 'of_static', 'of_shared', '--csv', '--log', out], {env});
  });
  const counted = poise(['run', 'stand', '--set', 'graph=other_flags', '--duration', '0.4', '--inline', '--count-allocations',
                         '--out', join(folder, 'counted')], {env: {POISE_PATH: made}});
  assert.match(counted, /sums\.sum +\d+\.\d a tick, \d+ at most, in 200 ticks/);  // Eigen's matrices of no fixed size
  assert.match(counted, /task_controller\.\w+ +none/);
  assert.equal(sums[1], sums[0]);
  assert.equal(sums[2], sums[0]);
  // The shared library's rounding is its own, not replaced by that of the same functions elsewhere.
  const [head, ...rows] = sums[0].trim().split('\n').map((line) => line.split(','));
  const [plain, shared] = ['plain', 'of_shared'].map((name) => head.findIndex((each) => each.endsWith(name)));
  assert.ok(rows.length > 150 && rows.some((row) => row[plain] !== row[shared]), sums[0].slice(0, 400));
});

test('a planner of footsteps of her own steps at its rhythm', () => {
  const made = join(folder, 'rhythm'), env = {POISE_PATH: made};
  run('cmake', ['-S', join(root, 'examples/rhythm'), '-B', made, '-G', 'Ninja', `-DCMAKE_PREFIX_PATH=${prefix}`]);
  run('cmake', ['--build', made]);
  for (const period of [0.3, 0.4, 0.5]) {
    const out = join(folder, `rhythm_${period}`);
    poise(['run', 'step_in_rhythm', '--inline', '--out', out, '--set', `rhythm.period=${period}`, '--set', 'check='], {env});
    // From touch-down to touch-down, in the middle of its eight seconds.
    const csv = poise(['echo', 'PLANNER_STATUS', 'stepping', '--csv', '--log', out], {env}).trim().split('\n').slice(1);
    const landed = csv.map((line) => line.split(',').at(-1)).flatMap((now, i, all) => now === '3' && all[i - 1] !== '3' ? [0.002 * i] : []);
    const middle = landed.filter((time) => time > 3.5 && time < 8.5);
    const mean = (middle.at(-1) - middle[0]) / (middle.length - 1);
    assert.ok(Math.abs(mean - period) < 0.045, `${period} s: ${mean} s, ${middle.length} landings`);
  }
});

test('what was installed of the project is found there', () => {
  const installed = join(folder, 'installed');
  run('cmake', ['--install', own, '--prefix', installed]);
  assert.ok(existsSync(join(installed, 'lib/poise/bin/foot_load')));
  const out = poise(['run', 'watch_load', '--duration', '0.2', '--out', join(folder, 'third')],
                    {env: {POISE_PATH: installed}});
  assert.match(out, /largest load of a foot/);
});
