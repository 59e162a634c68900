// Breaks the prose of pages at 120 characters: paragraphs and list items; tables, code, headings and code spans stay.
// Usage: node wrap.mjs PAGE...
import {readFileSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';
import {linesOf, root} from './markdown.mjs';

export const WIDTH = 120;
const ITEM = /^(\s*)([-*+]|\d+[.)])\s+/;
/** What would begin a list, a quotation or a heading at the begin of a line. */
const BEGINS = /^([-*+>]|#+|\d+[.)])$/;

/** Lines of prose that belong together; `first` and `more`: what stands before the first one and the others. */
function* paragraphsOf(page) {
  let open = null;
  for (const {number, text, code, mark} of linesOf(page)) {
    const item = ITEM.exec(text);
    const prose = code === null && !mark && text.trim() !== '' && !/^\s*(\||#|<|!\[|>|---)/.test(text);
    if (open && (!prose || item)) {
      yield open;
      open = null;
    }
    if (!prose) continue;
    if (open === null) {
      const first = item ? item[0] : /^\s*/.exec(text)[0];
      open = {begin: number, end: number, first, more: ' '.repeat(first.length), lines: [text.slice(first.length)]};
    } else {
      open.end = number;
      open.lines.push(text.trim());
    }
  }
  if (open) yield open;
}

/** @returns the lines of a paragraph, broken anew. */
function wrapped({first, more, lines}) {
  // A span of code is one word: what reads it reads line by line.
  const words = lines.join(' ').match(/(?:`[^`]*`|[^\s`])+/g) ?? [''];
  if (words.join('') !== lines.join('').replace(/\s(?=(?:[^`]*`[^`]*`)*[^`]*$)/g, '')) return lines.map((line, i) => (i ? more : first) + line);
  const result = [];
  let line = first + words[0];
  for (const [i, word] of words.slice(1).entries()) {
    const fits = line.length + 1 + word.length <= WIDTH && !(BEGINS.test(words[i + 2] ?? '') &&
        line.length + 2 + word.length + words[i + 2].length > WIDTH);
    if (fits || BEGINS.test(word)) {
      line += ` ${word}`;
    } else {
      result.push(line);
      line = more + word;
    }
  }
  return [...result, line];
}

/** Numbers of a page's lines of prose that are too long and could be broken. */
export function longLines(page) {
  return [...paragraphsOf(page)].flatMap((paragraph) => {
    const lines = readFileSync(join(root, page), 'utf8').split('\n').slice(paragraph.begin - 1, paragraph.end);
    const long = lines.flatMap((line, i) => (line.length > WIDTH ? [paragraph.begin + i] : []));
    return long.length > 0 && wrapped(paragraph).join('\n') !== lines.join('\n') ? long : [];
  });
}

if (process.argv[1] === new URL(import.meta.url).pathname) {
  for (const page of process.argv.slice(2)) {
    const file = join(root, page);
    const lines = readFileSync(file, 'utf8').split('\n');
    for (const paragraph of [...paragraphsOf(page)].reverse()) {
      const before = lines.slice(paragraph.begin - 1, paragraph.end);
      if (!before.some((line) => line.length > WIDTH) || before.some((line) => /( {2}|\\)$/.test(line))) continue;
      lines.splice(paragraph.begin - 1, before.length, ...wrapped(paragraph));
    }
    writeFileSync(file, lines.join('\n'));
  }
}
