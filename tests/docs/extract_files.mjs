// Writes the files that a page makes with "cat > FILE <<'END'" below a folder, for a build that compiles them.
// Usage: node extract_files.mjs PAGE FOLDER
import {mkdirSync, readFileSync, writeFileSync} from 'node:fs';
import {dirname, join} from 'node:path';

const [page, folder] = process.argv.slice(2);
for (const [, path, text] of readFileSync(page, 'utf8').matchAll(/^cat > (\S+) <<'END'\n(.*?\n)END$/gms)) {
  mkdirSync(dirname(join(folder, path)), {recursive: true});
  writeFileSync(join(folder, path), text);
}
