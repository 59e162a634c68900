// Every page is in short sentences with few numbers, and as short as its folder asks for; the pictures of the concepts are
// small and what draw.py draws.
// Usage: node style_test.mjs
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {readFileSync, statSync} from 'node:fs';
import {join} from 'node:path';
import {test} from 'node:test';
import {declaredTests, exists, linesOf, linksOf, repositoryFiles, root} from './markdown.mjs';
import {measureOf, sentencesOf, tooLong} from './prose.mjs';

const MOST = {average: 18, words: 40, line: 120, row: 200, lines: 120, numbers: 1};  // row: a line of a table
const MOST_PICTURE = 15_000;  // bytes: a picture is text of the repository
const MOST_MOVING = 40_000;   // bytes: of one that moves
const folder = repositoryFiles('docs/concepts');
const pages = folder.filter((f) => f.endsWith('.md'));
const moves = (picture) => readFileSync(join(root, picture), 'utf8').includes('<animate ');

/** Lines that a page may have, by folder: the longest name that fits counts. */
const LINES = {'': 125, 'CHANGELOG.md': 150, 'docs/concepts': MOST.lines, 'docs/how-to': 50, 'docs/reference': 280, 'docs/reference/equations': 150,
  'docs/results': 100, 'docs/start': 250, 'docs/lab': 150};
/** Numbers a sentence, likewise: many are a notebook's, and stand better in a table of the results. */
const NUMBERS = {'': 0.6, 'docs/reference': 0.8, 'docs/results': 1.4, 'docs/lab': Infinity};
const of = (limits, page) => limits[Object.keys(limits).filter((name) => page.startsWith(name)).sort().at(-1)];
const short = repositoryFiles().filter((f) => f.endsWith('.md'));
const isEntry = (page) => /^docs\/lab\/[\w-]+\/\d/.test(page);  // frozen: its tables are as wide as they were

for (const page of short) {
  test(`${page} is short`, (t) => {
    const problems = tooLong(page, linesOf(page),
        {...MOST, lines: of(LINES, page), numbers: of(NUMBERS, page), row: isEntry(page) ? Infinity : MOST.row});
    const {lines, sentences, average, longest, numbers} = measureOf(page);
    t.diagnostic(`${lines} lines, ${sentences} sentences, ${average.toFixed(1)} words a sentence, ${longest} at most, ` +
        `${numbers.toFixed(2)} numbers a sentence`);
    assert.deepEqual(problems, [], problems.join('\n'));
  });
}

test('the pages of a folder together', (t) => {
  const folders = new Map();
  for (const page of short) {
    const name = /^docs\/[\w-]+(?=\/)/.exec(page)?.[0] ?? 'elsewhere';
    folders.set(name, [...(folders.get(name) ?? []), measureOf(page)]);
  }
  for (const [name, measures] of [...folders].sort()) {
    const sum = (value) => measures.reduce((total, m) => total + value(m), 0);
    const sentences = sum((m) => m.sentences);
    const average = sum((m) => m.average * m.sentences) / sentences;
    t.diagnostic(`${name}: ${measures.length} pages, ${sum((m) => m.lines)} lines, ${average.toFixed(1)} words and ` +
        `${(sum((m) => m.numbers * m.sentences) / sentences).toFixed(2)} numbers a sentence`);
    assert.ok(average <= MOST.average, name);
  }
});

/** Words of a diary; what was tried stands in the lab. */
const DIARY = new RegExp(['[Ss]ince [0-9a-f]{7}\\b', '(older|earlier|old) (commit|state)\\b', 'mended', '[Ww]e (take|took|have|had)\\b', 'for now\\b',
  'until now', '(are|is) [^.|]{1,30} since[,.;|]', '\\d before[.;|)]', '[Tt]he house\\b', 'used to be'].map((w) => `\\b${w}`).join('|'));

test('pages say what holds, and not how it came about', () => {
  const told = short.filter((f) => !/^CHANGELOG|^docs\/lab\//.test(f)).flatMap((page) => linesOf(page).filter((l) => l.code === null)
      .flatMap(({number, text}) => (DIARY.test(text) ? [`${page}:${number}: ${DIARY.exec(text)[0]}`] : [])));
  assert.deepEqual(told, []);
  for (const text of ['Since c703980, walks', 'an older commit', 'are walked since, 19 before.', 'We take it', 'off for now.']) assert.match(text, DIARY);
});

test('an entry of the lab says on which day it was, and of which commit', () => {
  const entries = short.filter(isEntry);
  const DAY = /^\d{1,2} [A-Z][a-z]+ \d{4}\.$/;
  assert.deepEqual(entries.filter((page) => !DAY.test(linesOf(page)[2].text)), [], 'the third line');
  assert.deepEqual(entries.filter((page) => !linesOf(page).some(({text}) => /\b[0-9a-f]{7}\b/.test(text))), [], 'no commit');
});

test('the changelog has a release a heading, and a line or two a change', () => {
  const lines = linesOf('CHANGELOG.md').map((l) => l.text);
  const releases = lines.filter((line) => line.startsWith('## '));
  assert.equal(releases[0], '## Unreleased');
  assert.deepEqual(releases.slice(1).filter((line) => !/^## \[?\d+\.\d+\.\d+\]?, \d{4}-\d\d-\d\d$/.test(line)), [], 'VERSION, DATE');
  assert.deepEqual(lines.filter((line) => /^### (?!(Added|Changed|Removed|Fixed)$)/.test(line)), []);
  assert.deepEqual(lines.filter((line, i) => /^ {2}/.test(line) && /^ {2}/.test(lines[i + 1] ?? '')), [], 'three lines');
  const changes = lines.filter((line) => line.startsWith('- '));
  assert.equal(new Set(changes).size, changes.length, 'a change stands there twice');
});

test('every page but the index shows a picture, one that moves, and Python, and every picture is shown', () => {
  const shown = new Set();
  for (const page of pages) {
    const text = readFileSync(join(root, page), 'utf8');
    const pictures = [...text.matchAll(/^!\[[^\]]+\]\((pictures\/[\w.]+)\)$/gm)].map((m) => m[1]);
    for (const picture of pictures) shown.add(`docs/concepts/${picture}`);
    if (page.endsWith('/README.md')) continue;
    assert.ok(pictures.length > 0, `${page} shows no picture`);
    assert.ok(pictures.some((p) => moves(`docs/concepts/${p}`)), `${page} shows none that moves`);
    assert.match(text, /^```python$/m, `${page} has no Python`);
  }
  assert.deepEqual(folder.filter((f) => f.endsWith('.svg')).sort(), [...shown].sort());
});

test('words of the results and of the other concepts have a row in notation', () => {
  const known = linesOf('docs/concepts/notation.md').filter((l) => l.text.startsWith('|')).map((l) => l.text.split('|')[1]).join();
  const words = ['share of m ω r', 'share of m ω d', 'd_N', 'T, of a step', 'inner radius of a sole', 'cost of transport', 'course', 'lockstep', 'graph',
    'stage', 'capture point', 'violated tick', 'resultant', 'known ground', 'NEES'];
  assert.deepEqual(words.filter((word) => !known.includes(word)), []);
});

test('code and tests of every page but the index are one click away', () => {
  const declared = declaredTests();
  for (const page of pages.filter((f) => !f.endsWith('/README.md'))) {
    const prose = linesOf(page).filter((l) => l.code === null).map((l) => l.text).join('\n');
    const links = linksOf(prose, page);
    const problems = links.filter(({file}) => !exists(file)).map(({file}) => `there is no ${file}`);
    if (!links.some(({file}) => /^(components|sim\w*)\/.*\.(h|cc)$|^lcmtypes$/.test(file))) problems.push('has no link to code');
    if (!links.some(({text}) => declared.has(text.slice(1, -1)))) problems.push('has no link to a test');
    for (const {text, file} of links) {
      if (/\w\.[A-Z]/.test(text) && declared.get(text.slice(1, -1)) !== file) problems.push(`${text} is not in ${file}`);
    }
    for (const [, span] of prose.replace(/\[[^\]]*\]\([^)]*\)/g, '').matchAll(/`([^`\s]+)`/g)) {
      if (declared.has(span) || /^[\w./]+\/[\w./]*$/.test(span) && exists(span)) problems.push(`\`${span}\` is no link`);
    }
    assert.deepEqual(problems.map((p) => `${page}: ${p}`), []);
  }
});

test('the pictures are small, and what draw.py draws', () => {
  const large = folder.filter((f) => f.endsWith('.svg') && statSync(join(root, f)).size >= (moves(f) ? MOST_MOVING : MOST_PICTURE));
  assert.deepEqual(large, []);
  const {status, stderr} = spawnSync('python3', [join(root, 'docs/concepts/pictures/draw.py'), '--check'], {encoding: 'utf8'});
  assert.equal(status, 0, `${stderr}\nRun docs/concepts/pictures/draw.py, and commit what it has written.`);
});

// What the measures are worth: a page that breaks each is told so.
const asLines = (text) => text.split('\n').map((line, i) => ({number: i + 1, text: line, code: null}));
const words = (count) => `${Array(count).fill('word').join(' ')}.`;

test('a page that is too long in any way is told so', () => {
  const told = (text) => tooLong('page', asLines(text), MOST).map((problem) => problem.replace(/^page:? ?/, ''));
  assert.deepEqual(told(`${words(18)}\n${words(18)}\n`), []);
  assert.match(told(`${words(18)}\n${words(19)}\n`)[0], /18\.5 words a sentence/);
  assert.match(told(`${words(20)}\n${words(21)}\n\nOne. Two. Three.\n`).join(), /^$/);
  assert.match(told(`One. Two. Three.\n\n${words(20)}\n${words(21).toUpperCase()}\n`).join(), /^$/);
  const long = `One. Two. Three. Four.\n\n${words(41).replace('word word', 'word\nword').replace(/((?:word ){20})/, '$1\n')}\n`;
  assert.match(told(long)[0], /41 words, at most 40/);
  assert.match(told(`- ${'x'.repeat(120)}.\n`)[0], /123 characters/);
  assert.deepEqual(told(`| ${'x'.repeat(196)} |\n| [x](${'y'.repeat(200)}) |\n`), []);
  assert.match(told(`| ${'x'.repeat(197)} |\n`)[0], /201 characters, at most 200/);
  assert.match(told('Line.\n\n'.repeat(61))[0], /122 lines/);
  assert.deepEqual(told('By (24) G1 has 2 feet. One, `5 6`, of 7 cm.\n'), []);
  assert.match(told('It has 2.5 m, 3 and -1,000 N.\n')[0], /3\.00 numbers a sentence/);
});

test('code, tables, equations and headings are no sentences', () => {
  const text = `# A heading of many words that counts for nothing at all\n\nOne two \`a b c\` $x + y$ [three](four.md) et al. 2012.\n\n` +
      `| a | table of words |\n\n$$a + b\n= c \\text{in words}$$\n\nFive six: seven.\n- eight nine\n  ten.\n`;
  assert.deepEqual(sentencesOf(asLines(text)).map((s) => s.words), [8, 3, 3]);
});
