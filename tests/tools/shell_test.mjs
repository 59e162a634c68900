// What `poise shell` prints is what the commands take: completion is asked in the shells themselves, and compared with --help.
// Usage: node --test shell_test.mjs (POISE: the program)
import assert from 'node:assert/strict';
import {execFileSync, spawnSync} from 'node:child_process';
import {mkdtempSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {dirname, join} from 'node:path';
import {test} from 'node:test';
import {programFacts} from '../docs/markdown.mjs';

const poise = process.env.POISE;
const {commands} = programFacts(poise);
const folder = mkdtempSync(join(tmpdir(), 'poise-shell-'));
process.on('exit', () => rmSync(folder, {recursive: true}));
const printed = (kind) => {
  const file = join(folder, kind);
  writeFileSync(file, execFileSync(poise, ['shell', kind], {encoding: 'utf8'}));
  return file;
};
const has = (program) => spawnSync(program, ['--version']).status === 0;
const environment = {...process.env, PATH: `${dirname(poise)}:${process.env.PATH}`};
const below = (path) => [...commands.keys()].filter((c) => c !== path && c.split(' ').slice(0, -1).join(' ') === path)
    .map((c) => c.split(' ').at(-1));

/** Asks bash for what may follow the words; the last one is begun. */
function bash(file, questions) {
  const script = [`source ${file}`, 'ask() { COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); COMPREPLY=(); _poise; echo "${COMPREPLY[*]}"; }',
    ...questions.map((words) => `ask poise ${words.map((w) => `'${w}'`).join(' ')}`)].join('\n');
  const asked = spawnSync('bash', ['-c', script], {encoding: 'utf8', env: environment, cwd: folder});
  assert.equal(asked.stderr, '');
  return asked.stdout.trimEnd().split('\n').map((line) => line.split(' ').filter(Boolean));
}

test('bash offers each command\'s own commands and flags, and no others', () => {
  const file = printed('bash');
  const paths = [...commands.keys()];
  const answers = bash(file, paths.flatMap((path) => {
    const words = path === '' ? [] : path.split(' ');
    return [[...words, '-'], [...words, '']];
  }));
  assert.equal(answers.length, 2 * paths.length);
  let flags = 0;
  paths.forEach((path, i) => {
    const offered = new Set(answers[2 * i]);
    for (const flag of commands.get(path)) assert.ok(offered.has(flag), `poise ${path}: ${flag} is not offered`);
    assert.equal(offered.size, commands.get(path).size, `poise ${path} is offered ${[...offered]}`);
    flags += offered.size;
    for (const name of below(path)) assert.ok(answers[2 * i + 1].includes(name), `poise ${path} ${name} is not offered`);
  });
  assert.ok(paths.length > 25 && flags > 150, `${paths.length} commands, ${flags} flags`);
});

// CLI11 2.4 and later ends the program at its start where one command has `x` and `--x`; before, the two were told apart.
test('no argument of a command has the name of one of its flags', () => {
  for (const [path, flags] of commands) {
    const help = execFileSync(poise, [...path.split(' ').filter(Boolean), '--help'], {encoding: 'utf8'});
    const names = (help.split('\nPositionals:\n')[1] ?? '').split('\n\n')[0].matchAll(/^ {2}(\w+)/gm);
    for (const [, name] of names) assert.ok(!flags.has(`--${name}`), `poise ${path}: ${name} beside --${name}`);
  }
});

test('bash offers scenarios and robots by name', () => {
  const [scenarios, robots] = bash(printed('bash'), [['run', 'push_d'], ['run', 'stand', '--robot', 'he']]);
  assert.deepEqual(scenarios, ['push_double_support']);
  assert.ok(robots.includes('heron/heron'), `${robots}`);
});

test('fish has each command and flag', {skip: has('fish') ? false : 'fish is not installed'}, () => {
  const file = printed('fish');
  for (const [path, flags] of commands) {
    const asked = spawnSync('fish', ['--no-config', '-c', `source ${file}; complete -C 'poise ${path}${path && ' '}-'`],
        {encoding: 'utf8', env: environment, cwd: folder});
    assert.equal(asked.stderr, '');
    const offered = new Set(asked.stdout.split('\n').map((line) => line.split('\t')[0]));
    for (const flag of flags) assert.ok(offered.has(flag), `poise ${path}: ${flag} is not offered`);
  }
});

test('zsh reads its completion, which has each command and flag', {skip: has('zsh') ? false : 'zsh is not installed'}, () => {
  const file = printed('zsh');
  assert.equal(spawnSync('zsh', ['-n', file], {encoding: 'utf8'}).stderr, '');
  for (const [path, flags] of commands) {
    const table = spawnSync('zsh', ['-fc', `compdef() {}; source ${file} 2>/dev/null; f() { local -a commands flags kinds; _poise_table '${path}'; print -l -- $commands $flags; }; f`],
        {encoding: 'utf8', env: environment}).stdout;
    const offered = new Set(table.split('\n').map((line) => line.split(':')[0]));
    for (const name of [...flags, ...below(path)]) assert.ok(offered.has(name), `poise ${path}: ${name} is not offered`);
  }
});

test('the manual page has each command and flag', () => {
  const page = execFileSync(poise, ['shell', 'man'], {encoding: 'utf8'}).replaceAll('\\-', '-');
  for (const [path, flags] of commands) {
    const at = path === '' ? page.indexOf('.SH OPTIONS') : page.indexOf(`.SS poise ${path}\n`);
    assert.ok(at >= 0, `poise ${path} is missing`);
    const section = page.slice(at, page.indexOf('\n.S', at + 4));
    for (const flag of flags) assert.ok(section.includes(`\\fB${flag}\\fR`), `poise ${path}: ${flag} is missing`);
  }
  if (has('groff')) {
    const set = spawnSync('groff', ['-man', '-Tutf8', '-ww', '-K', 'utf8'], {input: execFileSync(poise, ['shell', 'man']), encoding: 'utf8'});
    assert.equal(set.stderr, '');
  }
});
