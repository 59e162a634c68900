// Runs what README, docs/reference/README.md, the tutorials and docs/how-to show: every command of their ```sh blocks, page by page,
// in a copy of deploy/ of the test's own. What their ```text blocks quote must have been printed, digit for digit, and so
// must every figure with a unit in their prose, or a command holds it. Of other bits than the recorded ones (another
// instruction set, compiler or library) only the words are compared.
// examples.txt lists the commands that are not run, and those that end with another exit code than 0, with the reason.
// Usage: node examples_test.mjs --poise PROGRAM [--page PAGE]
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {chmodSync, cpSync, existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync, symlinkSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {dirname, join, resolve} from 'node:path';
import {test} from 'node:test';
import {parseArgs} from 'node:util';
import {commandsOf, figuresOf, isPrinted, linesOf, otherBits, programFacts, proseFigures, repositoryFiles, root,
  untrueLines} from './markdown.mjs';

const {values: options} = parseArgs({options: {poise: {type: 'string'}, page: {type: 'string'}}});
const LIMIT = 400_000;  // ms for a page

/** {kind, begin, reason}, from the lines "KIND | BEGINNING OR PAGE | REASON"; kind: "page", "skip", "figure" or "exit N". */
const rules = readFileSync(new URL('examples.txt', import.meta.url), 'utf8').split('\n')
    .filter((line) => line.trim() !== '' && !line.startsWith('#')).map((line) => {
      const [kind, begin, reason] = line.split(' | ').map((part) => part.trim());
      assert.ok(/^(page|skip|figure|exit \d+)$/.test(kind) && begin && reason, `examples.txt: not a rule: ${line}`);
      return {kind, begin, reason, used: false};
    });

/** The exit code that a command shall end with; null: it is not run. */
function expectedExit(page, {text}) {
  const rule = rules.find((r) => (r.kind === 'page' ? page === r.begin : r.kind !== 'figure' && text.startsWith(r.begin)));
  if (rule === undefined) return 0;
  rule.used = true;
  return rule.kind.startsWith('exit') ? Number(rule.kind.slice(5)) : null;
}

/** A folder like a built checkout, but for the sources: deploy/run does without deploy/setup. */
function sandbox() {
  const folder = mkdtempSync(join(tmpdir(), 'poise-examples-'));
  cpSync(join(root, 'deploy'), join(folder, 'deploy'), {recursive: true});
  writeFileSync(join(folder, 'deploy/run'), '#!/bin/sh\nexec "$(dirname "$0")/../build/release/bin/poise" run "$@"\n');
  chmodSync(join(folder, 'deploy/run'), 0o755);
  mkdirSync(join(folder, 'build/release'), {recursive: true});
  symlinkSync(dirname(resolve(options.poise)), join(folder, 'build/release/bin'));
  const python = join(dirname(dirname(resolve(options.poise))), 'python');  // of a build with Python
  if (existsSync(python)) symlinkSync(python, join(folder, 'build/release/python'));
  return folder;
}

/** Why figures cannot be compared here; undefined: they are. */
const other = otherBits(options.poise);

/** Figures of a page that none of its commands holds or prints. */
function untrueFigures(page, output) {
  const code = linesOf(page).filter((l) => l.code !== null).map((l) => l.text).join('\n');
  const bare = new Set([...code.matchAll(/\d+(?:\.\d+)?/g)].map((m) => Number(m[0])));
  const printed = figuresOf(output);
  return proseFigures(page).filter((figure) => {
    const excused = rules.some((r) => r.kind === 'figure' && r.begin === `${page} ${figure.text}`);
    return !excused && !bare.has(figure.value) && !isPrinted(figure, printed);
  });
}

const pages = ['README.md', 'docs/reference/README.md',
               ...['docs/start', 'docs/how-to'].flatMap(repositoryFiles).filter((f) => f.endsWith('.md'))];
for (const page of pages) {
  const commands = commandsOf(page).map((command) => ({...command, exit: expectedExit(page, command)}));
  const runnable = commands.filter((c) => c.exit !== null);
  if (runnable.length === 0 || (options.page && options.page !== page)) continue;
  test(`${page}: ${runnable.length} of ${commands.length} commands`, (t) => {
    const folder = sandbox();
    try {
      // One shell for the page, so that a folder entered or a variable set stays. A mark follows each command.
      const script = runnable.map(({line, text}) => `${text}\nprintf '\\n@@@ ${line} %s\\n' "$?"\n`).join('');
      const PATH = `${folder}/build/release/bin:${process.env.PATH}`;
      const {stdout} = spawnSync('bash', ['-c', `exec 2>&1\n${script}`], {
        cwd: folder, encoding: 'utf8', timeout: LIMIT, maxBuffer: 1 << 28, stdio: ['ignore', 'pipe', 'pipe'],
        env: {...process.env, PATH, POISE_DEPLOY_DIR: join(folder, 'deploy')},
      });
      const parts = stdout.split(/\n@@@ (\d+) (\d+)\n/);
      const problems = [];
      runnable.forEach(({line, text, exit}, i) => {
        const output = parts[3 * i] ?? '';
        const ended = parts[3 * i + 2];
        if (Number(ended) === exit && Number(parts[3 * i + 1]) === line) return;
        problems.push(`${page}:${line}: ${text.split('\n')[0]}\n  ended with ${ended ?? 'nothing'}, not ${exit}:\n` +
                      output.split('\n').slice(-15).join('\n'));
      });
      if (other) t.diagnostic(`figures are not compared: ${other}`);
      const untrue = [...untrueLines(page, stdout, !other), ...(other ? [] : untrueFigures(page, stdout))];
      for (const {number, text} of untrue) problems.push(`${page}:${number}: nothing printed: ${text}`);
      assert.deepEqual(problems, [], problems.join('\n'));
    } finally {
      rmSync(folder, {recursive: true, force: true});
    }
  });
}

test('deploy/docs writes every command, field, message and metric', () => {
  const folder = mkdtempSync(join(tmpdir(), 'poise-docs-'));
  try {
    const {status, stdout, stderr} = spawnSync(join(root, 'deploy/docs'), ['--reference', folder],
        {encoding: 'utf8', env: {...process.env, POISE: resolve(options.poise)}});
    assert.equal(status, 0, stdout + stderr);
    const page = (name) => readFileSync(join(folder, 'reference', name), 'utf8');
    const facts = programFacts(options.poise);
    for (const command of facts.commands.keys()) {
      assert.ok(page('commands.md').includes(`\n## \`${`poise ${command}`.trim()}\`\n`), command);
    }
    for (const field of facts.fields) assert.ok(page('fields.md').includes(`\`${field}\``), field);
    assert.ok(page('messages.md').includes(facts.messages));
    for (const name of ['robot_fields.md', 'sweep_fields.md', 'graph_fields.md', 'metrics.md']) {
      assert.ok(page(name).split('\n').length > 10, name);
    }
  } finally {
    rmSync(folder, {recursive: true, force: true});
  }
});

// Each page runs in a folder of its own here; a reader does them one after another in one checkout.
test('tutorials and recipes write into folders of their own, beside what git knows', () => {
  const owner = new Map();
  for (const page of pages) {
    if (rules.some((rule) => rule.kind === 'page' && rule.begin === page)) continue;
    for (const {line, text} of commandsOf(page)) {
      const command = text.split('<<')[0];
      for (const [, flag, place] of command.matchAll(/(?<=\s)(--out|--to|-o|>)\s+([\w./]+)/g)) {
        const where = `${page}:${line}: ${flag} ${place}`;
        assert.match(place, /^(runs|my)\//, `${where}: git would show it`);
        assert.ok(!owner.has(place), `${where}: ${owner.get(place)} has written it`);
        owner.set(place, where);
      }
    }
  }
  assert.ok(owner.size > 10);
});

test('examples.txt has no rule that no command needs', () => {
  const figures = new Set(pages.flatMap((page) => proseFigures(page).map((figure) => `${page} ${figure.text}`)));
  for (const rule of rules) rule.used ||= rule.kind === 'figure' && figures.has(rule.begin);
  assert.deepEqual(rules.filter((r) => !r.used).map((r) => r.begin), []);
});
