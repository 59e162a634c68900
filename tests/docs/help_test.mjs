// Help pages as a person reads them: paragraphs that the terminal breaks and nobody before it, options whose meaning comes
// first, examples that the program takes. Usage: node help_test.mjs --poise PROGRAM
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
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
  let count = 0;
  for (const command of commands.keys()) {
    for (const [, example] of help(command, 4000).matchAll(/^Example: poise (.*)$/gm)) {
      const words = example.replace(/'[^']*'/g, 'x').split(' ');
      const known = [1, 2].map((n) => words.slice(0, n).join(' ')).filter((c) => commands.has(c)).at(-1);
      assert.equal(known, command, `poise ${command} --help: its example is of another command: ${example}`);
      for (const flag of words.filter((word) => /^--\w/.test(word))) {
        assert.ok(commands.get(known).has(flag), `poise ${command} has no ${flag}`);
      }
      count += 1;
    }
  }
  assert.ok(count >= 8, `only ${count} examples`);
});
