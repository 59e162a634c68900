// Builds the page that `poise report` fills: web/src and what it imports in one file without references.
// Usage: node web/build.mjs [OUTPUT_DIR], where node_modules is (default: build/web)
import {createRequire} from 'node:module';
import {mkdirSync, readFileSync, readdirSync, renameSync, writeFileSync} from 'node:fs';
import {dirname, join, resolve} from 'node:path';
import {fileURLToPath} from 'node:url';
import {parseMessage} from './src/messages.js';

const web = dirname(fileURLToPath(import.meta.url));
const output = resolve(process.argv[2] ?? join(web, '../build/web'));
const {build} = createRequire(join(output, 'package.json'))('esbuild');

const script = await build({
  entryPoints: [join(web, 'src/main.js')],
  bundle: true, minify: true, write: false, format: 'iife', target: 'es2022', charset: 'utf8',
  legalComments: 'inline', nodePaths: [join(output, 'node_modules')], logLevel: 'warning',
});
const style = await build({
  entryPoints: [join(web, 'src/style.css')], bundle: true, minify: true, write: false,
  nodePaths: [join(output, 'node_modules')], logLevel: 'warning',
});

const lcm = join(web, '../lcmtypes');
const messages = Object.fromEntries(readdirSync(lcm).filter((f) => f.endsWith('.lcm')).sort()
  .map((f) => parseMessage(readFileSync(join(lcm, f), 'utf8'))).map((m) => [m.name, m]));
const licences = ['three', 'uplot'].map((name) => {
  const dir = join(output, 'node_modules', name);
  const {version} = JSON.parse(readFileSync(join(dir, 'package.json'), 'utf8'));
  return `${name} ${version}\n\n${readFileSync(join(dir, 'LICENSE'), 'utf8').trim()}`;
}).join('\n\n');

// Replacements as functions: a '$' of the code means itself.
const page = readFileSync(join(web, 'src/index.html'), 'utf8')
  .replace('/*STYLE*/', () => style.outputFiles[0].text)
  .replace('/*MESSAGES*/', () => JSON.stringify(messages).replaceAll('<', '\\u003c'))
  .replace('/*LICENCES*/', () => licences.replaceAll('--', '- -'))
  .replace('/*SCRIPT*/', () => script.outputFiles[0].text);
mkdirSync(output, {recursive: true});
const target = join(output, 'report.html');
writeFileSync(`${target}.part`, page);
renameSync(`${target}.part`, target);
