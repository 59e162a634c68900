// The prose of a page: sentences beside code, tables, equations, headings and pictures, and how long they are.
import {linesOf} from './markdown.mjs';

/** What a sentence may end with, and is none of its end: "Koolen et al. 2012". */
const ABBREVIATION = /\b(al|e\.g|i\.e|cf|Fig|Eq)\.$/;

/** Lines of a page without its code, tables, equations, headings and pictures; '' where a paragraph ends. */
function* proseLines(lines) {
  let equation = false;  // within $$ ... $$, which may go over several lines
  for (const {number, text, code, mark} of lines) {
    const line = text.trim();
    const marks = code === null && !mark ? line.split('$$').length - 1 : 0;
    const within = equation || marks > 0;
    if (marks % 2 === 1) equation = !equation;
    const prose = code === null && !mark && !within && line !== '' && !/^(#|\||!\[|<)/.test(line);
    const item = /^([-*+]|\d+[.)])\s+/.exec(line);
    if (!prose || item) yield {number, text: ''};
    if (prose) yield {number, text: item ? line.slice(item[0].length) : line};
  }
  yield {number: lines.length, text: ''};
}

/** A span of code, a formula or a link's target is one word, or none. */
const plain = (text) => text.replace(/`[^`]*`/g, 'code').replace(/\$[^$]+\$/g, 'formula')
    .replace(/\[([^\]]*)\]\([^)]*\)/g, '$1').replace(/\*/g, '');

/** Sentences of lines as linesOf gives them: {number (where the paragraph begins), text, words}. */
export function sentencesOf(lines) {
  const sentences = [];
  let paragraph = [];
  let begin = 0;
  for (const {number, text} of proseLines(lines)) {
    if (text !== '') {
      if (paragraph.length === 0) begin = number;
      paragraph.push(text);
      continue;
    }
    let sentence = '';
    for (const piece of plain(paragraph.join(' ')).split(/(?<=[.!?][)"'”]?)\s+/)) {
      sentence = sentence === '' ? piece : `${sentence} ${piece}`;
      if (ABBREVIATION.test(piece)) continue;
      const words = sentence.split(/\s+/).filter((word) => /[\p{L}\p{N}]/u.test(word)).length;
      if (words > 0) sentences.push({number: begin, text: sentence, words});
      sentence = '';
    }
    paragraph = [];
  }
  return sentences;
}

/** A line as it is read: a link's target is no part of it. */
const asRead = (text) => text.replace(/\]\([^)]*\)/g, ']');

/** Numbers a sentence; those of equations, "(24)", and of names, "G1", are none, nor is what a table's "Measured:" says. */
const numbersOf = (all) => numbersIn(all.filter(({text}) => !text.startsWith('Measured: ')));
const numbersIn = (sentences) => sentences.flatMap(({text}) => text.match(/(?<![\p{L}\p{N}_.,(])\d[\d.,]*(?![\p{L}\p{N})])/gu) ?? [])
    .length / Math.max(sentences.length, 1);

/** What of a page is longer than it may be: lines (a table's are longer), sentences, their average, the page; and numbers a sentence. */
export function tooLong(page, lines, most) {
  const problems = [];
  const sentences = sentencesOf(lines);
  const average = sentences.reduce((sum, s) => sum + s.words, 0) / Math.max(sentences.length, 1);
  const count = lines.at(-1)?.text === '' ? lines.length - 1 : lines.length;
  if (count > most.lines) problems.push(`${page}: has ${count} lines, at most ${most.lines}`);
  if (average > most.average) problems.push(`${page}: has ${average.toFixed(1)} words a sentence, at most ${most.average}`);
  const numbers = numbersOf(sentences);
  if (numbers > most.numbers) problems.push(`${page}: has ${numbers.toFixed(2)} numbers a sentence, at most ${most.numbers}: put them into a table`);
  for (const {number, text, words} of sentences) {
    if (words > most.words) problems.push(`${page}:${number}: ${words} words, at most ${most.words}: ${text}`);
  }
  for (const {number, text} of lines) {
    const length = [...asRead(text)].length;
    const line = text.startsWith('|') ? most.row : text.startsWith('![') ? Infinity : most.line;
    if (length > line) problems.push(`${page}:${number}: ${length} characters, at most ${line}`);
  }
  return problems;
}

/** Of a page: {lines, sentences, average (words a sentence), longest, numbers (a sentence)}. */
export function measureOf(page) {
  const lines = linesOf(page);
  const sentences = sentencesOf(lines);
  const words = sentences.map((s) => s.words);
  return {lines: lines.at(-1)?.text === '' ? lines.length - 1 : lines.length, sentences: words.length,
    average: words.reduce((a, b) => a + b, 0) / Math.max(words.length, 1), longest: Math.max(0, ...words),
    numbers: numbersOf(sentences)};
}
