// What the documentation's tests read of the repository and of its Markdown files.
import {execFileSync} from 'node:child_process';
import {existsSync, readdirSync, readFileSync, statSync} from 'node:fs';
import {join} from 'node:path';
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

/** A line without its numbers and its columns' widths, which depend on the machine. */
const masked = (line) => line.replace(/[\d.]*\d/g, '#').replace(/─+/g, '─').replace(/\s+/g, ' ').trim();

/** Lines of a page's ```text blocks that no line of its commands' output is like: {number, text}. */
export function untrueLines(page, output) {
  const said = new Set(output.split('\n').map(masked));
  return linesOf(page).filter(({text, code, mark}) => code === 'text' && !mark && !said.has(masked(text)));
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
  const fields = new Set([...ask('list', 'fields').matchAll(/^([a-z][\w.[\]]*):/gm)].map((m) => m[1]));
  return {commands, fields, messages: ask('list', 'messages', '--markdown')};
}
