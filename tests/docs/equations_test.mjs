// The pages of docs/reference/equations show every equation of the paper once, under its number. Their tables name a
// function that its header has, tests that there are, and the worst residual that the identities' test prints.
// Usage: node equations_test.mjs --identities PROGRAM
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {readFileSync} from 'node:fs';
import {dirname, join, normalize} from 'node:path';
import {test} from 'node:test';
import {parseArgs} from 'node:util';
import {declaredTests, isFile, linksOf, repositoryFiles, root, tablesOf} from './markdown.mjs';

const {values: options} = parseArgs({options: {identities: {type: 'string'}}});
const EQUATIONS = Array.from({length: 79}, (_, i) => i + 1);
const IDENTITIES = 'PaperIdentities.';
const pages = repositoryFiles('docs/reference/equations').filter((f) => f.endsWith('.md'));
const text = (f) => readFileSync(join(root, f), 'utf8');

/** Numbers of "9–11, 14" or "(9)-(11), (14)". */
function numbersOf(list) {
  return list.split(',').flatMap((part) => {
    const [first, last = first] = part.match(/\d+/g).map(Number);
    return EQUATIONS.filter((n) => n >= first && n <= last);
  });
}

const rows = pages.flatMap((page) => tablesOf(page).filter((table) => table.rows[0][1] === 'computed by').flatMap((table) =>
  table.rows.slice(2).map(([equations, by, tests, ...residuals]) => ({page, equations, by, tests, residuals}))));

const sorted = (numbers) => [...numbers].sort((a, b) => a - b);

test('every equation of the paper stands once on these pages, and on the page of its row', () => {
  const shown = new Map(pages.map((page) => [page, [...text(page).matchAll(/\\tag\{(\d+)\}/g)].map((m) => Number(m[1]))]));
  assert.deepEqual(sorted([...shown.values()].flat()), EQUATIONS);
  assert.deepEqual(sorted(rows.flatMap((row) => numbersOf(row.equations))), EQUATIONS);
  for (const {page, equations} of rows) {
    for (const number of numbersOf(equations)) assert.ok(shown.get(page).includes(number), `${page} has a row of ${number}, not (${number})`);
  }
});

test('the functions and the tests are in the files that they link to', () => {
  const declared = declaredTests();
  for (const {page, equations, by, tests: cell} of rows) {
    const functions = [...by.matchAll(/\[`([\w:]+)`\]\(([^)]+)\)/g)];
    assert.ok(functions.length > 0, `${page}: ${equations} names no function`);
    for (const [, name, target] of functions) {
      const file = normalize(join(dirname(page), target));
      assert.ok(isFile(file), `${page}: there is no ${file}`);
      for (const part of name.split('::')) assert.match(text(file), new RegExp(`\\b${part}\\b`), `${page}: ${file} has no ${part}`);
    }
    const named = [...cell.matchAll(/`([^`]+)`/g)].map((m) => m[1]);
    assert.ok(named.length > 0, `${page}: ${equations} names no test`);
    for (const name of named) assert.ok(declared.has(name), `${page}: there is no test ${name}`);
    assert.deepEqual(linksOf(cell, page), named.map((name) => ({text: `\`${name}\``, file: declared.get(name)})), `${page}: ${equations}`);
  }
});

test('the residuals are those that the test prints', {skip: process.env.POISE_TEST_SEED && 'states are drawn anew'}, (t) => {
  const {status, stdout} = spawnSync(options.identities, ['--gtest_filter=' + IDENTITIES + '*'], {encoding: 'utf8'});
  assert.equal(status, 0, stdout);
  // "(9)-(11) in words   1.2e-12   -": on two feet, on one.
  const printed = [...stdout.matchAll(/^((?:\(\d+\)(?:, |-)?)+) .*?\s(-|\d\S+)\s+(-|\d\S+)$/gm)]
      .map(([, label, ...cells]) => ({numbers: numbersOf(label), cells}));
  assert.deepEqual(EQUATIONS.filter((n) => !printed.some((p) => p.numbers.includes(n))), [25, 54], 'these have tests of their own');
  const problems = [];
  for (const {page, equations, tests, residuals} of rows) {
    const numbers = numbersOf(equations);
    const of = printed.filter((p) => p.numbers.some((n) => numbers.includes(n)));
    if (tests.includes(IDENTITIES) !== of.length > 0) problems.push(`${page}: (${equations}): only what prints a residual has one`);
    residuals.forEach((residual, support) => {
      const worst = Math.max(...of.map((p) => p.cells[support]).filter((cell) => cell !== '-').map(Number));
      const agree = residual === 'none' ? !Number.isFinite(worst) : Math.abs(Math.log10(Number(residual) / worst)) <= 1;
      if (!agree) problems.push(`${page}: (${equations}): ${residual}, printed ${worst}`);
    });
  }
  assert.deepEqual(problems, [], problems.join('\n'));
});
