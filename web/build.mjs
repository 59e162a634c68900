// Builds the pages that `poise report` and `poise sweep` fill: web/src and what it imports, each in one file without references.
// Usage: node web/build.mjs [OUTPUT_DIR], where node_modules is (default: build/web)
import {createRequire} from 'node:module';
import {mkdirSync, readFileSync, readdirSync, renameSync, writeFileSync} from 'node:fs';
import {dirname, join, resolve} from 'node:path';
import {fileURLToPath} from 'node:url';
import {parseMessage} from './src/messages.js';

const web = dirname(fileURLToPath(import.meta.url));
const output = resolve(process.argv[2] ?? join(web, '../build/web'));
const {build} = createRequire(join(output, 'package.json'))('esbuild');

const lcm = join(web, '../lcmtypes');
const messages = Object.fromEntries(readdirSync(lcm).filter((f) => f.endsWith('.lcm')).sort()
  .map((f) => parseMessage(readFileSync(join(lcm, f), 'utf8'))).map((m) => [m.name, m]));
const licence = (name) => {
  const dir = join(output, 'node_modules', name);
  const {version} = JSON.parse(readFileSync(join(dir, 'package.json'), 'utf8'));
  return `${name} ${version}\n\n${readFileSync(join(dir, 'LICENSE'), 'utf8').trim()}`;
};

/** The text of web/src/`file` with all that it imports. */
async function bundled(file) {
  const {outputFiles: [{text}]} = await build({
    entryPoints: [join(web, 'src', file)],
    bundle: true, minify: true, write: false, format: 'iife', target: file.endsWith('.js') ? 'es2022' : undefined, charset: 'utf8',
    legalComments: 'inline', nodePaths: [join(output, 'node_modules')], logLevel: 'warning',
  });
  return text;
}

/** Writes `target` of a page, its script and its style. */
async function write(target, page, script, style, modules) {
  const parts = {STYLE: await bundled(style), SCRIPT: await bundled(script), MESSAGES: JSON.stringify(messages).replaceAll('<', '\\u003c'),
    LICENCES: modules.map(licence).join('\n\n').replaceAll('--', '- -')};
  const text = readFileSync(join(web, 'src', page), 'utf8').replace(/\/\*(STYLE|SCRIPT|MESSAGES|LICENCES)\*\//g, (_, name) => parts[name]);
  writeFileSync(join(output, `${target}.part`), text);
  renameSync(join(output, `${target}.part`), join(output, target));
}

mkdirSync(output, {recursive: true});
await write('charts.html', 'charts/index.html', 'charts/main.js', 'charts/style.css', ['uplot']);
await write('report.html', 'index.html', 'main.js', 'style.css', ['three', 'uplot']);
