// What the pages of docs/concepts show in Python runs: the blocks of a page, one after the other, in one process. No robot of theirs
// falls or is stopped: then they would print figures of nothing, such as 0 steps. The moving pictures of the mathematics and
// of short runs are what animate.py draws today.
// Usage: node concepts_python_test.mjs --python PROGRAM --poise PROGRAM, with the module poise on PYTHONPATH
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {mkdtempSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {test} from 'node:test';
import {parseArgs} from 'node:util';
import {linesOf, repositoryFiles, root} from './markdown.mjs';

const {values: options} = parseArgs({options: {python: {type: 'string', default: '/usr/bin/python3'}, poise: {type: 'string'}, show: {type: 'boolean'}}});
const LIMIT = 120_000;  // ms for a page

/** Runs Python; each run and environment that it makes must not tell of a fall or a stop in its `detail`. */
function runPython(program) {
  const folder = mkdtempSync(join(tmpdir(), 'poise-concepts-'));
  const guarded = `import poise
made_by_the_page, begin_anew = [], poise.Environment.reset
def keep_and_begin(env, *arguments, **named):
    made_by_the_page.append(env)
    return begin_anew(env, *arguments, **named)
poise.Environment.reset = keep_and_begin
${program}
for made in made_by_the_page:
    assert not made.detail, made.detail
`;
  try {
    return spawnSync(options.python, ['-W', 'error', '-c', guarded], {
      cwd: folder, encoding: 'utf8', timeout: LIMIT,
      env: {...process.env, PYTHONDONTWRITEBYTECODE: '1', POISE_DEPLOY_DIR: join(root, 'deploy'), POISE_RUNS_DIR: folder}});
  } finally {
    rmSync(folder, {recursive: true, force: true});
  }
}

for (const page of repositoryFiles('docs/concepts').filter((f) => f.endsWith('.md'))) {
  const program = linesOf(page).filter((l) => l.code === 'python').map((l) => l.text).join('\n');
  if (program === '') continue;
  test(`${page}: its Python`, (t) => {
    const {status, stdout, stderr} = runPython(program);
    assert.equal(status, 0, stdout + stderr);
    assert.notEqual(stdout.trim(), '', 'it prints nothing');
    if (options.show) t.diagnostic(stdout);
  });
}

for (const [what, program] of [
  ['a run', `run = poise.run("walk", {"hw_bridge.velocity_trip": 1e-6}, duration=1)\nprint(run["PLANNER_STATUS"].num_steps[-1])`],
  ['an environment', 'env = poise.Environment("stand", {"hw_bridge.velocity_trip": 1e-6})\nenv.step(500)'],
]) {
  test(`${what} whose robot the bridge has stopped is told of`, () => {
    const {status, stderr} = runPython(program);
    assert.notEqual(status, 0);
    assert.match(stderr, /AssertionError: .*hw_bridge has stopped the robot/);
  });
}

const isWhatIsDrawn = (...pictures) => {
  const script = join(root, 'docs/concepts/pictures/animate.py');
  const {status, stderr} = spawnSync(options.python, [script, '--check', ...pictures], {
    encoding: 'utf8', timeout: LIMIT,
    env: {...process.env, PYTHONDONTWRITEBYTECODE: '1', POISE_DEPLOY_DIR: join(root, 'deploy')}});
  assert.equal(status, 0, `${stderr}\nRun docs/concepts/pictures/animate.py, and commit what it has written.`);
};

test('the moving pictures of the mathematics are what animate.py draws', () => {
  isWhatIsDrawn('frames', 'messages', 'oblique', 'answers', 'stick_slip', 'rounding');
});

test('the moving pictures of a push are what animate.py draws', (t) => {
  const OTHER_BUILD = 3;  // of `poise bits`: other bits, by a build of another compiler or library than the record's
  if (spawnSync(options.poise, ['bits', 'push_double_support'], {timeout: LIMIT}).status === OTHER_BUILD) {
    t.skip('this build computes other bits than those of the picture');
    return;
  }
  isWhatIsDrawn('push', 'belief');
});
