// deploy/results on copies of pages with figures that are wrong: it says by how much, writes what a run of our own prints,
// tells why something is not made, runs nothing twice, and goes on after an interrupt. Every table of docs/results has a
// reader or a reason. Usage: node results_test.mjs --poise PROGRAM
import assert from 'node:assert/strict';
import {spawn, spawnSync} from 'node:child_process';
import {chmodSync, mkdirSync, mkdtempSync, readdirSync, readFileSync, rmSync, symlinkSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join, resolve} from 'node:path';
import {after, test} from 'node:test';
import {setTimeout as sleep} from 'node:timers/promises';
import {parseArgs} from 'node:util';
import {repositoryFiles, root, tablesOf} from './markdown.mjs';

const {values: options} = parseArgs({options: {poise: {type: 'string'}}});
const PATIENCE = 240_000;  // ms
const pages = repositoryFiles('docs/results').filter((f) => f.endsWith('.md') && !f.endsWith('README.md'));
const read = (page) => readFileSync(join(root, page), 'utf8');

/** A checkout with pages of its own, and a program that says that it was built from commit 0123abc. */
const folder = mkdtempSync(join(tmpdir(), 'poise-results-'));
after(() => rmSync(folder, {recursive: true, force: true}));
for (const part of ['docs/results', 'program/bin', 'build/results']) mkdirSync(join(folder, part), {recursive: true});
symlinkSync(join(root, 'deploy'), join(folder, 'deploy'));
symlinkSync(join(root, 'docs/site'), join(folder, 'docs/site'));
const program = join(folder, 'program/bin/poise');
writeFileSync(program, `#!/bin/sh
case "$*" in --version) echo "poise 0.1.0 (commit 0123abcdef01, any)" ;; *) exec '${resolve(options.poise)}' "$@" ;; esac
`);
chmodSync(program, 0o755);
const env = {...process.env, POISE: program, TZ: 'UTC'};
const write = (page, text) => writeFileSync(join(folder, page), text);
const results = (...words) => spawnSync(join(folder, 'deploy/results'), words, {env, encoding: 'utf8', timeout: PATIENCE});

/** A page's section whose heading begins so, with its title. */
const section = (page, heading) => `# Page\n\n${read(page).split(/^(?=## )/m).find((s) => s.startsWith(`## ${heading}`))}`;
const STEP = 'docs/results/steps_by_robot.md';
const FEEDBACK = 'docs/results/redistribution.md';
const PUSHES = 'docs/results/pushes.md';

test('every table has a command or a reason, and a reader or a reason', () => {
  const {status, stdout} = spawnSync(join(root, 'deploy/results'), ['--list'], {env, encoding: 'utf8'});
  assert.equal(status, 0);
  const claims = stdout.split(/^(?=\S)/m);
  assert.deepEqual(claims.map((c) => c.split('#')[0]), pages.flatMap((page) => tablesOf(page).map(() => /(\w+)\.md/.exec(page)[1])));
  assert.deepEqual(claims.filter((c) => c.includes('no reader') || c.trim().split('\n').length < 2), []);
});

test('every reader belongs to one table, and that table is none of those made by hand', () => {
  const names = [...read('docs/site/figures.py').matchAll(/^@reads(?:_row)?\("(\w+)", "([^"]+)"\)/gm)];
  assert.ok(names.length > 30, `${names.length} found`);
  for (const [, page, heading] of names) {
    const found = read(`docs/results/${page}.md`).split('\n').filter((line) => line.startsWith(`## ${heading}`));
    assert.equal(found.length, 1, `${page}: ${heading}: ${found.length} headings`);
    assert.doesNotMatch(section(`docs/results/${page}.md`, heading), /By hand:/, heading);
  }
});

test('wrong figures of fast claims are told, and replaced by what a run prints', () => {
  const step = section(STEP, 'A foot is down');
  write(STEP, step.replace(/(push's begin to the decision, s \| )[\d.]+/, '$19.999').replace(/(violated ticks \| )\d+/, '$1777'));
  // One scenario of four: 7.2, which is short.
  const feedback = section(FEEDBACK, 'Feedback takes').replace(/^\| 7\.[145] .*\n/gm, '');
  write(FEEDBACK, feedback.replace(/(push_double_support` \| )[\d.]+/, '$10.1'));
  const first = results('steps_by_robot', 'redistribution');
  assert.equal(first.status, 1, first.stderr);
  assert.match(first.stdout, /decision, s \| both feet, ODE: 9\.999 -> 0\.\d{3} \(-99 %\)/);
  assert.match(first.stdout, /violated ticks \| both feet, ODE: 777 -> \d+ \(-\d+ %\)/);
  assert.match(first.stdout, /off: 0\.1 -> \d\d\.\d \(\+\d+ %\)/);
  assert.match(first.stdout, /; \d+ s$/m);

  const again = results('--write', 'steps_by_robot', 'redistribution');
  assert.equal(again.status, 0, again.stdout + again.stderr);
  assert.doesNotMatch(again.stderr, /^ {2}poise /m, 'what is kept is not run again');
  const today = new Date().toISOString().slice(0, 10);
  for (const page of [STEP, FEEDBACK]) {
    assert.match(readFileSync(join(folder, page), 'utf8'), new RegExp(`^Measured: 0123abc, ${today}, seed 1, any machine, \\d+ CPU s,\\sof `, 'm'));
  }
  const printed = spawnSync(options.poise, ['run', 'push_double_support', '--variant', 'step', '--inline', '--no-reference', '--full',
    '--world', 'ode', '--out', join(folder, 'own')], {encoding: 'utf8', env: {...env, COLUMNS: '400', POISE_DEPLOY_DIR: join(root, 'deploy')}});
  const decision = Number(/push's begin to the decision[^\n]*? {2,}([\d.]+) s/.exec(printed.stdout)?.[1]);
  const rows = readFileSync(join(folder, STEP), 'utf8').split('\n');
  assert.equal(Number(rows.find((row) => row.includes('to the decision')).split('|')[2]), Number(decision.toFixed(3)), printed.stdout);

  assert.match(results('--list', 'redistribution').stdout, /^redistribution#\S+ {2}# \d+ CPU s, when it was written\n/);

  const last = results('steps_by_robot', 'redistribution');
  assert.equal(last.status, 0, last.stdout);
  assert.doesNotMatch(last.stdout, /differ|not made/);
});

test('what cannot be made is told with its reason, and is not written', () => {
  const text = section('docs/results/walking.md', 'Without compensated').replace(/^\| (heron|iCub|G1|Talos|TOCABI) .*\n/gm, '').replaceAll('NAME', 'nobody');
  write('docs/results/walking.md', text);
  const {status, stdout} = results('--write', 'walking');
  assert.equal(status, 0);
  assert.match(stdout, /not made \(\d+\): poise run walk .*nobody/);
  assert.match(stdout, /not written: not all figures were made/);
  assert.equal(readFileSync(join(folder, 'docs/results/walking.md'), 'utf8'), text);
  assert.equal(results('nothing_of_that_name').status, 2);
});

test('after an interrupt nothing goes on, and the next start goes on with the sweep', async () => {
  write(PUSHES, section(PUSHES, 'No push that stood'));
  const kept = () => readdirSync(join(folder, 'build/results')).map((f) => join(folder, 'build/results', f, 'out/results.jsonl'))
      .flatMap((f) => { try { return readFileSync(f, 'utf8').includes('push_duration') ? [readFileSync(f, 'utf8')] : []; } catch { return []; } });
  const runs = () => (kept()[0] ?? '').split('\n').length - 1;
  const start = async (until) => {
    const child = spawn(join(folder, 'deploy/results'), ['pushes'], {env, stdio: 'ignore'});
    const ended = new Promise((done) => child.on('exit', done));
    for (const begin = Date.now(); runs() < until && Date.now() - begin < PATIENCE;) await sleep(100);
    child.kill('SIGINT');
    assert.equal(await ended, 130);
    assert.equal(spawnSync('pgrep', ['-f', join(folder, 'build/results')]).status, 1, 'a process goes on');
  };
  await start(2);
  const before = kept()[0];
  await start(runs() + 2);
  assert.ok(kept()[0].startsWith(before) && kept()[0].length > before.length);
});
