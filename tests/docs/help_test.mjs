// Help pages as a person reads them: paragraphs that the terminal breaks and nobody before it, options whose meaning comes
// first, an example in each that the program takes, no line wider than the terminal. Usage: node help_test.mjs --poise PROGRAM
import assert from 'node:assert/strict';
import {execFileSync, spawnSync} from 'node:child_process';
import {mkdtempSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {dirname, join, resolve} from 'node:path';
import {test} from 'node:test';
import {parseArgs} from 'node:util';
import {programFacts} from './markdown.mjs';

const {values: options} = parseArgs({options: {poise: {type: 'string'}}});
const {commands} = programFacts(options.poise);
const help = (command, columns) => execFileSync(options.poise, [...command.split(' ').filter(Boolean), '--help'],
    {encoding: 'utf8', env: {...process.env, COLUMNS: String(columns), LC_ALL: 'C.UTF-8'}});

test('a paragraph of a help page is one line where the terminal is wide', () => {
  for (const command of commands.keys()) {
    const lines = help(command, 4000).split('\n').filter((line) => line !== '' && !line.startsWith('  '));
    for (const line of lines.slice(1)) {
      assert.match(line, /^(Usage|Example|Start with): |[.:]$|[;,] also$/, `poise ${command} --help: broken off: ${line}`);
    }
  }
});

test('an option says what it means before what it goes with', () => {
  for (const command of commands.keys()) {
    assert.doesNotMatch(help(command, 4000), /^ {2}-.*\b(Excludes|Needs):/m, `poise ${command} --help`);
  }
  assert.match(help('run', 4000), /^ {2}--inline +the same graph inside one process.*\(not with .*--hosted/m);
});

test('examples name commands and flags that there are', () => {
  for (const command of commands.keys()) {
    for (const [, example] of help(command, 4000).matchAll(/^Example: poise (.*)$/gm)) {
      const words = example.replace(/'[^']*'/g, 'x').split(' ');
      const known = [1, 2].map((n) => words.slice(0, n).join(' ')).filter((c) => commands.has(c)).at(-1);
      assert.equal(known, command, `poise ${command} --help: its example is of another command: ${example}`);
      for (const flag of words.filter((word) => /^--\w/.test(word))) {
        assert.ok(commands.get(known).has(flag), `poise ${command} has no ${flag}`);
      }
    }
  }
});

/** Those that do something themselves. */
const leaves = [...commands.keys()].filter((command) => command !== '' && !/^Subcommands:$/m.test(help(command, 4000)) ||
    command === 'sweep' || command === 'benchmark');
const exampleOf = (command) => /^Example: (poise .*)$/m.exec(help(command, 4000))?.[1];

test('every command has an example', () => {
  assert.ok(leaves.length > 35, `${leaves.length} commands`);
  assert.deepEqual(leaves.filter((command) => !exampleOf(command)), []);
});

test('no line is wider than 80 columns', () => {
  for (const command of commands.keys()) {
    for (const line of help(command, 80).split('\n')) assert.ok([...line].length <= 80, `poise ${command} --help: ${line}`);
  }
});

test('the options of run stand in groups', () => {
  const groups = help('run', 80).split(/^(?=\S.*:$)/m).map((part) => part.split('\n'));
  for (const [name, flag] of [['Options', '--out'], ['What is run', '--set'], ['In which processes', '--inline'],
    ['In real time', '--kill'], ['Drives and ROS 2', '--drives']]) {
    const lines = groups.find(([head]) => head === `${name}:`);
    assert.ok(lines?.some((line) => line.startsWith(`  ${flag} `)), `${flag} is not below ${name}`);
    assert.ok(lines.filter((line) => /^ {2}-/.test(line)).length <= 10, name);
  }
});

test('examples that need no run in progress, no drives and little time work', () => {
  const folder = mkdtempSync(join(tmpdir(), 'poise-help-'));
  const sh = (line) => spawnSync('bash', ['-c', line], {cwd: folder, encoding: 'utf8',
    env: {...process.env, PATH: `${dirname(resolve(options.poise))}:${process.env.PATH}`, POISE_RUNS_DIR: join(folder, 'runs')}});
  try {
    for (const out of ['', '--out runs/before', '--out runs/after']) {
      const made = sh(`poise run stand --inline --quiet --duration 1.3 ${out}`);
      assert.equal(made.status, 0, made.stdout + made.stderr);
    }
    for (const command of ['report', 'compare', 'log info', 'log check', 'log cut', 'log export', 'log pack', 'log unpack',
      'new scenario', 'graph check', 'robot list', 'list', 'echo', 'shell bash', 'shell zsh', 'shell names']) {
      const {status, stdout, stderr} = sh(exampleOf(command));
      assert.equal(status, 0, `${exampleOf(command)}: ${stdout}${stderr}`);
    }
  } finally {
    rmSync(folder, {recursive: true, force: true});
  }
});
