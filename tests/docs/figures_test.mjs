// Tables of measured figures say by which commit, when and how they were measured, in a line above them that begins with
// "Measured:". In docs/results/ the line stands below and names folders: docs/site/older.py asks git whether they have
// changed since. Tables whose line ends with "Compared by the tests." are measured again: every figure with a unit in the
// columns "ours" and "measured" must be among what the line's commands print; where there is no such column, deploy/results
// makes the table anew and must find each figure the same.
// Usage: node figures_test.mjs --poise PROGRAM
import assert from 'node:assert/strict';
import {execFileSync, spawnSync} from 'node:child_process';
import {cpSync, mkdirSync, mkdtempSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {dirname, join, resolve} from 'node:path';
import {test} from 'node:test';
import {parseArgs} from 'node:util';
import {exists, figuresOf, isPrinted, linesOf, otherBits, repositoryFiles, root, tablesOf} from './markdown.mjs';

const {values: options} = parseArgs({options: {poise: {type: 'string'}}});
const pages = ['README.md', ...repositoryFiles('docs').filter((f) => f.endsWith('.md'))];
const MEASURED = /^Measured: (by the commit of this line, \d{4}-\d\d-\d\d|[0-9a-f]{7}(?: to [0-9a-f]{7})?, \d{4}-\d\d-\d\d)[,;.]/;
/** Pages with a table a claim: its line has commit, date, seed, machine, folders that the figures depend on, command. */
const RESULTS = new Set(pages.filter((f) => /^docs\/results\/(?!README)/.test(f)));
const RESULT = /^Measured: [0-9a-f]{7}(?: to [0-9a-f]{7})?, \d{4}-\d\d-\d\d, (?:seeds? \d|no seed)[^:]*(?:machine|cores)[^:]*, of ((?:`[\w/]+\/`(?:, )?)+): /;
const COMPARED = /Compared by the tests\.$/;

/** Columns of what was chosen or is prescribed, not measured: a field's values, too, are an interface's. */
const GIVEN = new Set(['field', 'use', 'reason', 'points; `--quick`']);

/** Whether most cells of a table, its first column aside, begin with a figure. */
function isMeasured({rows}) {
  if (rows[0].some((cell) => GIVEN.has(cell))) return false;
  const cells = rows.slice(2).flatMap((row) => row.slice(1)).map((cell) => cell.replace(/`[^`]*`/g, '')).filter(Boolean);
  const figures = cells.filter((cell) => /^\D{0,14}(?<![\w.(])\d+(?:[.,]\d+)?(?!\w*\))/.test(cell));
  return cells.length >= 4 && figures.length >= 0.54 * cells.length;
}

/** A paragraph that begins with "Measured:": {number, text}. */
function paragraphAt(lines, number) {
  let end = number;
  while (lines[end]?.text.trim()) end += 1;
  return {number, text: lines.slice(number - 1, end).map((l) => l.text).join(' ')};
}

/** The "Measured:" line of a table: of a page of results the one right below it; undefined: there is none. */
function lineBelow(lines, {line, rows}) {
  const number = line + rows.length + 1;
  return lines[number - 1]?.text.startsWith('Measured:') ? paragraphAt(lines, number) : undefined;
}

/** The "Measured:" line of a table: the nearest one above it below a heading of its own; undefined: none. */
function measuredLine(lines, {line, headings}) {
  const begin = headings[0]?.line ?? 1;
  for (let number = line - 1; number >= begin; --number) {
    const {text} = lines[number - 1];
    if (text.startsWith('Measured:')) return paragraphAt(lines, number);
    if (/^#+ /.test(text) && !headings.some((h) => h.line === number)) return undefined;
  }
  return undefined;
}

const compared = [];
for (const page of pages) {
  const lines = linesOf(page);
  const isResult = RESULTS.has(page);
  const tables = tablesOf(page).filter((table) => isResult || isMeasured(table));
  for (const table of tables) table.measured = (isResult ? lineBelow : measuredLine)(lines, table);
  compared.push(...tables.filter((t) => t.measured && COMPARED.test(t.measured.text)).map((t) => ({page, ...t})));
  if (tables.length === 0) continue;
  test(`${page}: ${tables.length} tables say when and how they were measured`, () => {
    const form = isResult ? RESULT : MEASURED;
    const problems = tables.filter((t) => !t.measured || !form.test(t.measured.text)).map((t) => t.measured
      ? `${page}:${t.measured.number}: is not of the form ${form}: ${t.measured.text}`
      : `${page}:${t.line}: has no line ${isResult ? 'below' : 'above'} it that begins with "Measured:"`);
    for (const {measured} of isResult ? tables : []) {
      for (const [, folder] of RESULT.exec(measured?.text ?? '')?.[1].matchAll(/`([^`]+)`/g) ?? []) {
        if (!exists(folder)) problems.push(`${page}:${measured.number}: there is no ${folder}`);
      }
    }
    assert.deepEqual(problems, [], problems.join('\n'));
  });
}

test('what was measured stands in the results, in the lab and beside the paper\'s equations', () => {
  const others = pages.filter((page) => !/^docs\/(results|lab|reference\/equations)\//.test(page));
  assert.deepEqual(others.flatMap((page) => tablesOf(page).filter(isMeasured).map(({line}) => `${page}:${line}`)), []);
});

test('commits of "Measured:" lines are of this history', (t) => {
  if (spawnSync('git', ['-C', root, 'rev-parse', '--verify', 'HEAD~50'], {stdio: 'ignore'}).status !== 0) {
    t.skip('a copy without its history');
    return;
  }
  for (const page of pages) {
    for (const {number, text} of linesOf(page)) {
      for (const [hash] of (/^Measured: ([0-9a-f]{7})/.exec(text) ? text.matchAll(/\b[0-9a-f]{7}\b(?=,| to )/g) : [])) {
        assert.doesNotThrow(() => execFileSync('git', ['-C', root, 'cat-file', '-e', `${hash}^{commit}`], {stdio: 'ignore'}),
            `${page}:${number}: git knows no commit ${hash}`);
      }
    }
  }
});

test('a table is told to be older than the code once a folder of its line has changed', () => {
  const folder = mkdtempSync(join(tmpdir(), 'poise-older-'));
  const git = (...words) => execFileSync('git', ['-C', folder, '-c', 'user.name=a', '-c', 'user.email=b', ...words],
      {encoding: 'utf8', stdio: ['ignore', 'pipe', 'ignore']}).trim();
  const change = (file, text = `${Math.random()}`) => {
    writeFileSync(join(folder, file), text);
    git('add', '.');
    git('commit', '-qm', file);
    return git('rev-parse', '--short=7', 'HEAD');
  };
  const told = () => execFileSync('python3', [join(folder, 'docs/site/older.py')], {encoding: 'utf8'});
  try {
    for (const part of ['docs/site', 'docs/results', 'deploy/bits', 'gait', 'arms']) mkdirSync(join(folder, part), {recursive: true});
    cpSync(join(root, 'docs/site/older.py'), join(folder, 'docs/site/older.py'));
    const page = (commit, end = '') => writeFileSync(join(folder, 'docs/results/a.md'),
        `# A\n\n| a |\n|---|\n| 1 |\n\nMeasured: ${commit}, 2026-11-26, seed 1, any machine,\nof \`gait/\`, \`legs/\`: \`poise\`.${end}\n`);
    page('0123abc');
    assert.equal(told(), '', 'without a history');
    git('init', '-q');
    page(change('gait/a'));
    change('arms/a');
    change('gait/b', '// A comment.\n');
    assert.equal(told(), '', 'another folder, and a comment');
    const before = change('deploy/bits/push.bytes');
    page(before);
    const first = change('gait/a');
    const say = (count, commit, bits) => new RegExp(`^docs/results/a.md:7: older than the code: ${count} changed it since, ` +
        `the last ${commit}, \\d{4}-\\d\\d-\\d\\d; the bits of recorded runs have ${bits}\n$`);
    assert.match(told(), say('one commit has', first, 'not changed'));
    change('deploy/bits/push.bytes');
    const last = change('gait/a');
    assert.match(told(), say('2 commits have', last, 'changed once'));
    page(before, ' Compared by the\ntests.');
    assert.equal(told(), '', 'a test makes it anew');
    page('0123abc');
    assert.equal(told(), '', 'a commit that is not of this history');
    page(last);
    assert.equal(told(), '', 'measured again');
  } finally {
    rmSync(folder, {recursive: true, force: true});
  }
});

const OURS = ['ours', 'measured'];
const other = compared.length > 0 ? otherBits(options.poise) : undefined;
const [printing, made] = [true, false].map((has) => compared.filter(({rows}) => rows[0].some((cell) => OURS.includes(cell)) === has));

const results = (...words) => spawnSync(join(root, 'deploy/results'), words, {encoding: 'utf8', env: {...process.env, POISE: resolve(options.poise)}});

/** Names of deploy/results by page and place of the table, which stand in the pages' order. */
function claimsByTable() {
  const {stdout} = results('--list');
  const claims = [...stdout.matchAll(/^\S+/gm)].map(([name]) => name);
  const tables = pages.filter((page) => RESULTS.has(page)).flatMap((page) => tablesOf(page).map(({line}) => `${page}:${line}`));
  assert.equal(claims.length, tables.length);
  return new Map(tables.map((table, i) => [table, claims[i]]));
}

for (const {page, line} of made) {
  test(`${page}:${line} has the figures that deploy/results makes`, {skip: other}, (t) => {
    const claim = claimsByTable().get(`${page}:${line}`);
    assert.ok(claim, `${page}:${line}: no table of results`);
    const {status, stdout, stderr} = results(claim);
    assert.equal(status, 0, stdout + stderr);
    assert.doesNotMatch(stdout, /not made/);
    t.diagnostic(stdout.trim().split('\n').at(-1));
  });
}

for (const {page, line, rows, measured} of printing) {
  test(`${page}:${line} has the figures of its commands`, {skip: other}, (t) => {
    const folder = mkdtempSync(join(tmpdir(), 'poise-figures-'));
    try {
      const commands = [...measured.text.matchAll(/`((?:deploy\/run|poise) [^`]*)`/g)]
          .map((m) => m[1].replace(/^deploy\/run/, 'poise run'));
      assert.ok(commands.length > 0, `${page}:${measured.number}: names no command`);
      const env = {...process.env, PATH: `${dirname(resolve(options.poise))}:${process.env.PATH}`, COLUMNS: '400',
        POISE_RUNS_DIR: join(folder, 'runs'), POISE_DEPLOY_DIR: join(root, 'deploy')};
      const output = commands.map((command) =>
        spawnSync('bash', ['-c', command], {cwd: folder, env, encoding: 'utf8', maxBuffer: 1 << 28}).stdout).join('\n');
      const printed = figuresOf(output);
      const columns = rows[0].flatMap((cell, i) => (OURS.includes(cell) ? [i] : []));
      assert.ok(columns.length > 0, `${page}:${line}: has no column "ours" or "measured"`);
      const figures = rows.slice(2).flatMap((row) => columns.flatMap((i) => figuresOf(row[i] ?? '')
          .map((figure) => ({...figure, cell: row[i]}))));
      const untrue = figures.filter((figure) => !isPrinted(figure, printed));
      assert.deepEqual(untrue.map((f) => `${f.text}: ${f.cell}`), []);
      t.diagnostic(`${figures.length} figures are those of ${commands.join(', ')}`);
    } finally {
      rmSync(folder, {recursive: true, force: true});
    }
  });
}
