// What a picture of the documentation shows, as text in the picture's own file (a PNG's iTXt chunk): a test compares it
// with what is shown now.
// Usage: node png_text.mjs check PICTURE TEXT_FILE     ends with 1 when the picture shows something else
//        node png_text.mjs write PICTURE TEXT_FILE NEW_PICTURE
import {readFileSync, writeFileSync} from 'node:fs';
import {fileURLToPath} from 'node:url';

const KEYWORD = 'poise-shows';
const HEAD = 8;  // bytes of a PNG's signature

const TABLE = Uint32Array.from({length: 256}, (_, n) => {
  let c = n;
  for (let k = 0; k < 8; ++k) c = c & 1 ? 0xedb88320 ^ (c >>> 1) : c >>> 1;
  return c >>> 0;
});
const crc32 = (bytes) => ~bytes.reduce((c, byte) => TABLE[(c ^ byte) & 0xff] ^ (c >>> 8), ~0) >>> 0;

/** Chunks of a PNG: {type, begin, end}, bytes of the whole chunk. */
function* chunksOf(png) {
  for (let begin = HEAD; begin < png.length;) {
    const end = begin + 12 + png.readUInt32BE(begin);
    yield {type: png.toString('latin1', begin + 4, begin + 8), begin, end};
    begin = end;
  }
}

const prefix = Buffer.from(`${KEYWORD}\0\0\0\0\0`, 'latin1');  // not compressed, no language, no translated keyword
const isOurs = (png, {type, begin}) =>
  type === 'iTXt' && png.subarray(begin + 8, begin + 8 + prefix.length).equals(prefix);

/** The text of a picture's bytes; undefined: it has none. */
export function readText(png) {
  for (const chunk of chunksOf(png)) {
    if (isOurs(png, chunk)) return png.toString('utf8', chunk.begin + 8 + prefix.length, chunk.end - 4);
  }
  return undefined;
}

/** The bytes with this text in place of any other. */
export function withText(png, text) {
  const body = Buffer.concat([Buffer.from('iTXt', 'latin1'), prefix, Buffer.from(text, 'utf8')]);
  const chunk = Buffer.alloc(body.length + 8);
  chunk.writeUInt32BE(body.length - 4, 0);
  body.copy(chunk, 4);
  chunk.writeUInt32BE(crc32(body), chunk.length - 4);
  const parts = [png.subarray(0, HEAD)];
  for (const each of chunksOf(png)) {
    if (each.type === 'IEND') parts.push(chunk);
    if (!isOurs(png, each)) parts.push(png.subarray(each.begin, each.end));
  }
  return Buffer.concat(parts);
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const [what, picture, textFile, target] = process.argv.slice(2);
  const text = readFileSync(textFile, 'utf8');
  if (what === 'write') {
    writeFileSync(target, withText(readFileSync(picture), text));
  } else {
    const shown = readText(readFileSync(picture)) ?? '';
    const now = new Set(text.split('\n'));
    const before = new Set(shown.split('\n'));
    const added = [...now].filter((line) => !before.has(line)).map((line) => `+ ${line}`);
    const gone = [...before].filter((line) => !now.has(line)).map((line) => `- ${line}`);
    if (added.length + gone.length > 0) {
      console.error([`${picture} is old; take it again: deploy/pictures`, ...gone, ...added].join('\n'));
      process.exit(1);
    }
  }
}
