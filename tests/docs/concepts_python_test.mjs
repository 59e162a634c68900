// What the pages of docs/concepts show in Python runs: the blocks of a page, one after the other, in one process. The moving
// picture of a short run is what animate.py draws of the run of today.
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

for (const page of repositoryFiles('docs/concepts').filter((f) => f.endsWith('.md'))) {
  const program = linesOf(page).filter((l) => l.code === 'python').map((l) => l.text).join('\n');
  if (program === '') continue;
  test(`${page}: its Python`, (t) => {
    const folder = mkdtempSync(join(tmpdir(), 'poise-concepts-'));
    try {
      const {status, stdout, stderr} = spawnSync(options.python, ['-W', 'error', '-c', program], {
        cwd: folder, encoding: 'utf8', timeout: LIMIT,
        env: {...process.env, PYTHONDONTWRITEBYTECODE: '1', POISE_DEPLOY_DIR: join(root, 'deploy'), POISE_RUNS_DIR: folder}});
      assert.equal(status, 0, stdout + stderr);
      assert.notEqual(stdout.trim(), '', 'it prints nothing');
      if (options.show) t.diagnostic(stdout);
    } finally {
      rmSync(folder, {recursive: true, force: true});
    }
  });
}

test('the moving picture of a push is what animate.py draws', (t) => {
  const OTHER_BUILD = 3;  // of `poise bits`: other bits, by a build of another compiler or library than the record's
  if (spawnSync(options.poise, ['bits', 'push_double_support'], {timeout: LIMIT}).status === OTHER_BUILD) {
    t.skip('this build computes other bits than those of the picture');
    return;
  }
  const script = join(root, 'docs/concepts/pictures/animate.py');
  const {status, stderr} = spawnSync(options.python, [script, '--check', 'push'], {
    encoding: 'utf8', timeout: LIMIT,
    env: {...process.env, PYTHONDONTWRITEBYTECODE: '1', POISE_DEPLOY_DIR: join(root, 'deploy')}});
  assert.equal(status, 0, `${stderr}\nRun docs/concepts/pictures/animate.py, and commit what it has written.`);
});
