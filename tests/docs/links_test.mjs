// No link of a Markdown file leads nowhere, and what a code span or a command names exists: files, tests, commands,
// flags, fields. Usage: node links_test.mjs --poise PROGRAM
import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import {dirname, join, normalize} from 'node:path';
import {test} from 'node:test';
import {parseArgs} from 'node:util';
import {anchorsOf, declaredTests, exists, isFile, linesOf, programFacts, repositoryFiles, root} from './markdown.mjs';
import {longLines} from './wrap.mjs';

const {values: options} = parseArgs({options: {poise: {type: 'string'}}});
const files = repositoryFiles();
const pages = files.filter((f) => f.endsWith('.md'));
const facts = programFacts(options.poise);
const sources = files.filter((f) => /\.(h|cc|proto|cmake|mjs|js|sh|lcm|pbtxt|java)$|CMakeLists\.txt$/.test(f));
const names = new Set(files.map((f) => f.slice(f.lastIndexOf('/') + 1)));
const tops = new Set(['build', ...files.map((f) => f.split('/')[0])]);
const text = (f) => readFileSync(join(root, f), 'utf8');

const buildFiles = files.filter((f) => /CMakeLists\.txt$/.test(f)).map(text).join('\n');
/** A program is the first argument of what declares it. */
const isBuilt = (program) => new RegExp(`\\w\\(${program}\\b`).test(buildFiles);
const tests = declaredTests();
const scripts = files.filter((f) => /^(deploy\/(\w+|cluster\/\w+)|examples\/.*\.py)$/.test(f) || f.endsWith('.sh')).map(text).join('\n');

/** What a run's folder holds: `logging/` and `tools/` write it. */
const OF_A_RUN = new Set(['run_spec.pbtxt', 'scenario.pbtxt']);
/** Pages that deploy/docs writes. */
const GENERATED = new Set([...text('deploy/docs').matchAll(/^page (\w+\.md)/gm)].map((m) => m[1]));
/** Files of other projects that the text names. */
const FOREIGN = new Set(['ethercattype.h']);

/** What is written for a reader to fill in, such as NAME or RUN/run.lcm. */
const isPlaceholder = (path) => /[*<>{}$…]|\b(NAME|RUN2?|FILE|FOLDER|DIR|SWEEP|SCENARIO|DATE)\b/.test(path);

function problemOfPath(path, page) {
  const clean = path.replace(/\/$/, '').replace(/:\d+$/, '');
  if (isPlaceholder(clean)) return null;
  if (clean.startsWith('build/')) {
    const program = /^build\/[\w-]+\/(?:bin|tests|benchmarks)\/(\w+)$/.exec(clean);
    return program && !isBuilt(program[1]) ? `no target builds ${program[1]}` : null;
  }
  return exists(clean) || exists(join(dirname(page), clean)) ? null : `there is no ${clean}`;
}

/** A command's words: what is wrong with its name and flags. */
function problemOfCommand(words) {
  const known = [];
  for (const word of words) {
    if (!facts.commands.has([...known, word].join(' '))) break;
    known.push(word);
  }
  const command = known.join(' ');
  if (known.length === 0 && words.length > 0 && /^[a-z]/.test(words[0])) return `poise has no command ${words[0]}`;
  for (const word of words) {
    const flag = /^(--?[a-z][\w-]*)/.exec(word)?.[1];
    if (word === '--' || word === '|' || word === '&&') break;
    if (flag === undefined || facts.commands.get(command).has(flag)) continue;
    return `poise ${command} has no flag ${flag}`;
  }
  return null;
}

/** "poise run x --y" of "deploy/run x --y  # comment"; null: another program's. */
function commandWords(line) {
  const match = /^(?:\$ )?(?:deploy\/veth )?(deploy\/run|(?:build\/[\w-]+\/bin\/)?poise)(?=\s|$)(.*)$/.exec(line);
  if (!match) return null;
  const words = match[2].replace(/\s#.*$/, '').replace(/'[^']*'|"[^"]*"/g, 'x').replace(/\\$/, '')
      .split(/\s*(?:&&|\||;)\s*/)[0].trim().split(/\s+/).filter(Boolean);
  return match[1] === 'deploy/run' ? ['run', ...words] : words;
}

/** A scenario's field: the group of a component, then names. */
const groups = [...new Set([...facts.fields].filter((f) => f.includes('.')).map((f) => f.split('.')[0]))];
const FIELD = new RegExp(`^(${groups.filter((g) => !g.endsWith(']')).join('|')})(\\.[a-z_]\\w*(\\[\\w+\\])?)+$`);

function problemOfSpan(span, page) {
  const words = commandWords(span);
  if (words !== null) return isPlaceholder(span.split(' ')[0]) ? null : problemOfCommand(words);
  if (/^[A-Z]\w+\.[A-Z]\w+$/.test(span) && /[a-z]/.test(span.split('.')[0])) {
    return tests.has(span) ? null : `there is no test ${span}`;
  }
  if (names.has(span) || OF_A_RUN.has(span) || FOREIGN.has(span) || GENERATED.has(span)) return null;
  const field = span.replace(/=.*$/, '');
  if (FIELD.test(field)) {
    const path = field.replace(/\[\w+\]/g, '[i]');
    const known = facts.fields.has(path) || facts.fields.has(`${path}[i]`);
    return known ? null : `there is no field ${field}`;
  }
  const message = /^([A-Z][A-Z_]+)\.([a-z_]+)/.exec(span);
  if (message && !isPlaceholder(message[1])) {
    // The channels' names end at the point; a summary behind it may name others.
    const section = facts.messages.split('\n## ').find((s) => new RegExp(`^Channel [^.]*\\b${message[1]}\\b`, 'm').test(s));
    if (section === undefined) return `there is no channel ${message[1]}`;
    return new RegExp(`\\b${message[2]}\\b`).test(section) ? null : `${message[1]} has no field ${message[2]}`;
  }
  const flag = /^(--[a-z][\w-]*)\b/.exec(span)?.[1];
  if (flag) {
    const known = [...facts.commands.values()].some((flags) => flags.has(flag)) || scripts.includes(flag) ||
        buildFiles.includes(flag);
    return known ? null : `nothing has the flag ${flag}`;
  }
  if (/\s/.test(span)) return null;
  if (/^[.\w-]+\/[\w./-]*$/.test(span) && tops.has(span.split('/')[0])) return problemOfPath(span, page);
  if (/^[\w-]+\.(h|cc|mjs|js|pbtxt|proto|cmake|sh|md)$|^\w+_t\.lcm$/.test(span)) {
    return isPlaceholder(span) ? null : `there is no file ${span}`;
  }
  return null;
}

/** What was tried once: its commands, fields and files are those of its day. */
const isFrozen = (page) => /^docs\/lab\/[\w-]+\/\d/.test(page);

for (const page of pages) {
  test(`${page} names what there is`, () => {
    const problems = [];
    for (const {number, text, code, mark} of linesOf(page)) {
      if (mark) continue;
      const report = (problem) => problem && problems.push(`${page}:${number}: ${problem}`);
      if (code !== null) {
        if (isFrozen(page)) continue;
        const words = ['', 'sh', 'bash'].includes(code) ? commandWords(text) : null;
        if (words !== null) report(problemOfCommand(words));
        const path = /^(?:deploy|build|tests|web)\/\S+/.exec(text)?.[0];
        if (['', 'sh', 'bash'].includes(code) && path) report(problemOfPath(path, page));
        continue;
      }
      const spans = [...text.matchAll(/`([^`]+)`/g)].map((m) => m[1].replaceAll('\\|', '|'));
      if (!isFrozen(page)) for (const span of spans) report(problemOfSpan(span, page));
      for (const [, target] of text.replace(/`[^`]*`/g, '').matchAll(/\]\(([^)\s]+)\)/g)) {
        if (/^(https?|mailto):/.test(target)) continue;
        const [path, anchor] = target.split('#');
        const file = path === '' ? page : normalize(join(dirname(page), path));
        if (!exists(file)) {
          report(`the link to ${target} leads nowhere`);
        } else if (anchor !== undefined && !(isFile(file) && anchorsOf(file).has(anchor))) {
          report(`${file} has no heading #${anchor}`);
        }
      }
    }
    assert.deepEqual(problems, [], problems.join('\n'));
  });
}

test('lines of prose have at most 120 characters', () => {
  const long = pages.flatMap((page) => longLines(page).map((number) => `${page}:${number}`));
  assert.deepEqual(long, [], 'node tests/docs/wrap.mjs PAGE breaks them');
});

test('every page of docs/ is reached from the index', () => {
  const reached = new Set(['README.md']);
  const queue = ['README.md'];
  while (queue.length > 0) {
    const page = queue.shift();
    for (const [, target] of text(page).matchAll(/\]\(([^)\s#]+)[^)]*\)/g)) {
      const file = normalize(join(dirname(page), target));
      if (!file.endsWith('.md') || reached.has(file) || !isFile(file)) continue;
      reached.add(file);
      queue.push(file);
    }
  }
  assert.deepEqual(pages.filter((p) => !reached.has(p)), []);
});
