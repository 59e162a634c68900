// What the documentation's tests read of the repository and of its Markdown files.
import {execFileSync, spawnSync} from 'node:child_process';
import {existsSync, readdirSync, readFileSync, statSync} from 'node:fs';
import {dirname, join, normalize} from 'node:path';
import {fileURLToPath} from 'node:url';

export const root = fileURLToPath(new URL('../..', import.meta.url));

const SKIPPED = new Set(['.git', 'build', 'node_modules', 'runs']);

/** All files of the checkout, relative, but for what is built, installed or recorded. */
export function repositoryFiles(folder = '') {
  return readdirSync(join(root, folder), {withFileTypes: true}).flatMap((entry) => {
    if (SKIPPED.has(entry.name)) return [];
    const path = folder === '' ? entry.name : `${folder}/${entry.name}`;
    return entry.isDirectory() ? repositoryFiles(path) : [path];
  });
}

/** @returns lines of a file, each {number, text, code}: in a fenced (its language) or indented ('') block, else null. */
export function linesOf(file) {
  let fence = null;
  let paragraph = false;  // an indented line below it goes on with it
  return readFileSync(join(root, file), 'utf8').split('\n').map((text, index) => {
    const number = index + 1;
    const mark = /^\s*```(\w*)/.exec(text);
    if (mark) {
      fence = fence === null ? mark[1] : null;
      return {number, text, code: null, mark: true};
    }
    if (fence !== null) return {number, text, code: fence};
    if (/^ {4}/.test(text) && !paragraph) return {number, text: text.slice(4), code: ''};
    paragraph = text.trim() !== '' && !/^#/.test(text);
    return {number, text, code: null};
  });
}

/** Commands of a page's ```sh blocks: {line, text}; a here document and lines that end with \ belong to theirs. */
export function commandsOf(page) {
  const commands = [];
  let open = null;  // the command that goes on
  let until = null;  // its here document's last line
  for (const {number, text, code, mark} of linesOf(page)) {
    if (mark || code !== 'sh') continue;
    if (open) {
      open.text += `\n${text}`;
    } else {
      if (text.trim() === '' || text.startsWith('#')) continue;
      open = {line: number, text};
      commands.push(open);
    }
    until ??= /<<\s*'?(\w+)'?/.exec(text)?.[1] ?? null;
    if (until !== null ? text === until : !text.endsWith('\\')) open = until = null;
  }
  return commands;
}

/** What differs between two runs of the same bits; every other digit is compared. */
const VARYING = [
  [/\b\d{4}-\d\d-\d\d[T_ ]?\d\d:?\d\d:?\d\d(\.\d+)?Z?/g, 'DATE'],
  [/(file:\/\/)?(?<![\w.])(\/[\w.+~-]+){2,}\/?/g, 'PATH'],
  [/\b[\d.]+ s simulated in [\d.]+ s, [\d.]+ x real time/g, 'WALL TIME'],
  [/\bruns? in [\d.]+ s\b/g, 'WALL TIME'],
  [/\b(?=[0-9a-f]*[a-f])(?=[0-9a-f]*\d)[0-9a-f]{7,40}\b(\+changes)?/g, 'COMMIT'],
];

/** A line as it is compared; widths of columns depend on a path's length. Without `figures` of no number at all. */
export function comparable(line, figures = true) {
  let text = line;
  for (const [pattern, name] of VARYING) text = text.replace(pattern, name);
  if (!figures) text = text.replace(/[\d.]*\d/g, '#');
  return text.replace(/─+/g, '─').replace(/\s+/g, ' ').trim();
}

/** Lines of a page's ```text blocks that its commands did not print: {number, text}. */
export function untrueLines(page, output, figures = true) {
  const said = new Set(output.split('\n').map((line) => comparable(line, figures)));
  return linesOf(page).filter(({text, code, mark}) =>
    code === 'text' && !mark && !said.has(comparable(text, figures)));
}

const UNITS = 'mm/s|m/s|mrad|rad/s|rad|mm|cm|m|N·m/s|N·m|N·s|N|kg|Hz|ms|µs|s|%';
/** "34.71 mm", but for a bound ("below 1 mm"); a number of several with one unit behind them ("0.386 to 1.406 s") has that unit. */
const FIGURE = new RegExp(`(?<![\\w.,-]|below |above )(\\d[\\d,]*(?:\\.\\d+)?)(?:(?: to |; |, | and )(?=\\d)|\\s(${UNITS})(?![\\w·/]))`, 'g');

/** Figures with a unit of a text: {value, digits behind the point, unit, text}. */
export function figuresOf(text) {
  const plain = text.replace(/`[^`]*`/g, '').replace(/\]\([^)]*\)/g, ']');
  const figures = [...plain.matchAll(FIGURE)].map(([all, number, unit]) => ({
    value: Number(number.replaceAll(',', '')), digits: number.split('.')[1]?.length ?? 0, unit, text: all.trim()}));
  for (let i = figures.length - 2; i >= 0; --i) figures[i].unit ??= figures[i + 1].unit;
  return figures.filter((f) => f.unit !== undefined);
}

/** Whether one of `printed` (figuresOf), rounded as the page has it, is the page's figure. */
export function isPrinted(figure, printed) {
  const half = 0.5 * 10 ** -figure.digits * (1 + 1e-9);
  return printed.some((p) => p.unit === figure.unit && Math.abs(p.value - figure.value) <= half);
}

/** Figures in a page's prose, beside its code: {number, text}. */
export function proseFigures(page) {
  return linesOf(page).filter((l) => l.code === null && !l.mark).flatMap(({number, text}) =>
    figuresOf(text).map((figure) => ({number, ...figure})));
}

/** Tables of a page: {line, rows (cells), headings (the section's and those that enclose it)}. */
export function tablesOf(page) {
  const tables = [];
  let open = null;
  let headings = [];
  for (const {number, text, code, mark} of linesOf(page)) {
    const heading = code === null && /^(#+) /.exec(text);
    if (heading) {
      headings = [...headings.filter((h) => h.level < heading[1].length), {level: heading[1].length, line: number}];
    }
    if (code === null && !mark && text.startsWith('|')) {
      if (open === null) tables.push(open = {line: number, rows: [], headings});
      open.rows.push(text.replaceAll('\\|', '/').split('|').slice(1, -1).map((cell) => cell.trim()));
    } else {
      open = null;
    }
  }
  return tables;
}

/** GitHub's anchors of a file's headings. */
export function anchorsOf(file) {
  const seen = new Map();
  return new Set(linesOf(file).filter((l) => l.code === null && /^#+ /.test(l.text)).map(({text}) => {
    const slug = text.replace(/^#+ /, '').trim().toLowerCase().replace(/[^\p{L}\p{N}\p{M}_\- ]/gu, '').replace(/ /g, '-');
    const count = seen.get(slug) ?? 0;
    seen.set(slug, count + 1);
    return count === 0 ? slug : `${slug}-${count}`;
  }));
}

export const isFile = (path) => existsSync(join(root, path)) && statSync(join(root, path)).isFile();
export const exists = (path) => existsSync(join(root, path));

/** Tests of tests/, "Suite.Name", each with the file that declares it. */
export const declaredTests = () => new Map(repositoryFiles('tests').filter((f) => f.endsWith('.cc')).flatMap((f) =>
    [...readFileSync(join(root, f), 'utf8').matchAll(/\bTEST(?:_F|_P)?\(\s*(\w+),\s*(\w+)\s*\)/g)].map((m) => [`${m[1]}.${m[2]}`, f])));

/** Links of a text of a page to files of the repository: {text, file}. */
export const linksOf = (text, page) => [...text.matchAll(/(?<!!)\[([^\]]+)\]\((?!https?:|mailto:|#)([^)#\s]+)[^)]*\)/g)]
    .map(([, shown, target]) => ({text: shown, file: normalize(join(dirname(page), target)).replace(/\/$/, '')}));

/** Why this build's figures are others than those of the pages; undefined: they are the same bits. */
export function otherBits(poise) {
  const {status, stdout} = spawnSync(poise, ['bits', 'push_double_support', 'mujoco_push_double_support'], {encoding: 'utf8'});
  // 3: this build has another instruction set, compiler or library than the record's.
  return status === 3 ? stdout.trim().split('\n').at(-1) : undefined;
}

/** What the program tells of itself: commands with their flags, fields, messages' fields, metrics. */
export function programFacts(poise) {
  const ask = (...parameters) => execFileSync(poise, parameters, {encoding: 'utf8'});
  const commands = new Map();  // "log export" -> Set of flags
  const visit = (words) => {
    const help = ask(...words, '--help');
    // Options stand first in their lines; "-o,--output TEXT".
    const flags = new Set([...help.matchAll(/^ {2}((?:-\w,)?--?[\w-]+)/gm)].flatMap((m) => m[1].split(',')));
    commands.set(words.join(' '), flags);
    const section = /^Subcommands:\n((?: {2}.*\n?)+)/m.exec(help);
    for (const [, name] of section?.[1].matchAll(/^ {2}([a-z][\w-]*)/gm) ?? []) visit([...words, name]);
  };
  visit([]);
  const fields = new Set();  // with the groups that they are in
  for (const [, path] of ask('list', 'fields', '--markdown').matchAll(/^\| `([a-z][\w.[\]]*)` \|/gm)) {
    for (let end = path.length; end > 0; end = path.lastIndexOf('.', end - 1)) fields.add(path.slice(0, end));
  }
  return {commands, fields, messages: ask('list', 'messages', '--markdown')};
}
