// The site that deploy/docs makes: it asks for nothing beyond its own files, no link of it leads nowhere, every page of
// docs/ stands in its navigation, its equations are ones that KaTeX can set, and its search finds, from a file.
// Usage: node site_test.mjs --poise PROGRAM --web DIR [--pictures DIR], where DIR is build/web; --pictures: also takes
// pictures of some pages, as wide as a desk's screen and a phone's, light and dark
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {cpSync, existsSync, mkdtempSync, readdirSync, readFileSync, rmSync, statSync} from 'node:fs';
import {createRequire} from 'node:module';
import {tmpdir} from 'node:os';
import {basename, dirname, join, normalize, resolve} from 'node:path';
import {after, test} from 'node:test';
import {pathToFileURL} from 'node:url';
import {parseArgs} from 'node:util';
import {launchBrowser, PATIENCE} from '../web/browser.mjs';
import {linesOf, repositoryFiles, root} from './markdown.mjs';

const {values: options} = parseArgs({options: {poise: {type: 'string'}, web: {type: 'string'}, pictures: {type: 'string'}}});
const KATEX = '/usr/share/javascript/katex/katex.js';
const WIDTHS = [1400, 400];  // CSS pixels: a desk's screen and a phone's
const MOST = 32e6;  // bytes: every page holds the whole navigation, and grows with it

const modules = spawnSync('/usr/bin/python3', ['-c', 'import material, mkdocs_literate_nav, mkdocstrings_handlers, pymdownx'],
    {encoding: 'utf8', env: {...process.env, PYTHONPATH: '/usr/share/mkdocs/themes', PYTHONDONTWRITEBYTECODE: '1'}});
const skip = (modules.status !== 0 || !existsSync(KATEX)) &&
  'what makes the site is not installed: deploy/setup --docs poise does it';

const folder = mkdtempSync(join(tmpdir(), 'poise-site-'));
after(() => rmSync(folder, {recursive: true, force: true}));
const versions = join(folder, 'site');
let site = join(versions, 'newest');  // a release has its tag's name
const pages = new Map();  // "docs/reference/walking.html" -> its text

/** A page's file in the site. */
const html = (page) => page.replace(/README\.md$/, 'index.md').replace(/\.md$/, '.html');
const plain = (text) => text.replaceAll('&lt;', '<').replaceAll('&gt;', '>').replaceAll('&quot;', '"').replaceAll('&#39;', "'")
    .replaceAll('&amp;', '&');

test('deploy/docs makes the site', {skip}, (t) => {
  const begin = Date.now();
  const {status, stdout, stderr} = spawnSync(join(root, 'deploy/docs'), [folder],
      {encoding: 'utf8', env: {...process.env, POISE: resolve(options.poise)}});
  assert.equal(status, 0, stdout + stderr);
  assert.equal(stderr, '', 'mkdocs warns of something');
  [site] = readdirSync(versions, {withFileTypes: true}).filter((f) => f.isDirectory()).map((f) => join(versions, f.name));
  let size = 0;
  for (const file of readdirSync(site, {recursive: true})) {
    const path = join(site, file);
    if (!statSync(path).isFile()) continue;
    size += statSync(path).size;
    if (file.endsWith('.html')) pages.set(file, readFileSync(path, 'utf8'));
  }
  t.diagnostic(`${pages.size} pages, ${(size / 1e6).toFixed(1)} MB, in ${((Date.now() - begin) / 1000).toFixed(1)} s`);
  assert.ok(size < MOST, `${size} bytes`);
});

/** The page's links and sources: {target, path (within the site), anchor}; addresses of other sites aside. */
function linksOf(page) {
  return [...pages.get(page).matchAll(/\s(href|src)="([^"]*)"/g)].map(([, kind, target]) => ({kind, target}))
      .filter(({kind, target}) => kind === 'src' || !/^(https?|mailto|javascript):/.test(target)).map(({target}) => {
        const [path, anchor] = target.replaceAll('&amp;', '&').split('#').map(decodeURIComponent);
        return {target, anchor, path: path === '' ? page : normalize(join(dirname(page), path.replace(/\?.*/, '')))};
      });
}

test('no link leads nowhere, and nothing comes from a network', {skip}, () => {
  const ids = new Map([...pages].map(([page, text]) => [page, new Set([...text.matchAll(/\sid="([^"]*)"/g)].map((m) => m[1]))]));
  const problems = [];
  let count = 0;
  for (const page of pages.keys()) {
    for (const {target, path, anchor} of linksOf(page)) {
      count += 1;
      const file = join(site, path);
      if (!existsSync(file) || !statSync(file).isFile()) {
        problems.push(`${page}: the link to ${target} leads nowhere`);  // a folder, too: a file has no server to find index.html
      } else if (anchor && ids.has(path) && !ids.get(path).has(anchor)) {
        problems.push(`${page}: ${path} has no heading #${anchor}`);
      }
    }
  }
  assert.deepEqual(problems, [], problems.join('\n'));
  assert.ok(count > 1000, 'there are links to look at');
});

test('every page of docs/ stands in the navigation, in its section', {skip}, () => {
  const start = pages.get('index.html');
  const tabs = [...start.matchAll(/class="md-tabs__link[^"]*">\s*([^<]*?)\s*</g)].map((m) => m[1]);
  assert.deepEqual(tabs, ['Start', 'Concepts', 'How-to', 'Reference', 'Results', 'Lab']);
  const navigation = start.slice(start.indexOf('<nav class="md-nav md-nav--primary'), start.indexOf('<div class="md-content"'));
  const linked = new Set([...navigation.matchAll(/\shref="([^"#]+)/g)].map((m) => m[1]));
  const wanted = ['README.md', 'CONTRIBUTING.md', 'CHANGELOG.md', ...repositoryFiles('docs').filter((f) => f.endsWith('.md'))];
  assert.deepEqual(wanted.filter((page) => !pages.has(html(page))), [], 'the site lacks pages');
  assert.deepEqual(wanted.filter((page) => !linked.has(html(page))), [], 'give them a place in docs/site/mkdocs.yml, under nav');
});

test('every type of a header has a heading, and pages lead to it', {skip}, () => {
  const FOLDERS = ['components', 'sim', 'sim_ode', 'sim_mujoco', 'hw_bridge', 'logging', 'tools'];
  const lacking = [];
  for (const header of FOLDERS.flatMap(repositoryFiles).filter((f) => f.endsWith('.h'))) {
    const text = pages.get(`reference/cpp/${dirname(header).replace(/^components\//, '').replaceAll('/', '_')}.html`);
    const types = [...readFileSync(join(root, header), 'utf8').matchAll(/^(?:class|struct|enum class|enum) (\w+)[^;]*\{/gm)].map((m) => m[1]);
    const shown = new Set([...(text ?? '').matchAll(/<h3 id="[^"]+">(\w+)</g)].map((m) => m[1]));
    lacking.push(...types.filter((type) => !shown.has(type)).map((type) => `${header}: ${type}`));
  }
  assert.deepEqual(lacking, []);
  const targets = (page) => linksOf(page).map(({path, anchor}) => `${path}#${anchor}`);
  assert.ok(targets('docs/concepts/steps.html').includes('reference/cpp/step_planner_stepping.html#pendulumh'), 'a header');
  assert.ok(targets('docs/reference/equations/tasks.html').includes('reference/cpp/balance_tasks.html#pdacceleration'), 'a function');
  assert.match(pages.get('docs/concepts/tick.html'), /<code>deploy\/graphs\/balance\.pbtxt<\/code><\/td>/, 'what the site has not');
  assert.match(pages.get('docs/concepts/steps.html'), /<code>Step\.\w+<\/code> \(<code>tests\/graph\/step_test\.cc<\/code>\)/, 'a test');
});

// What a list holds is code by another indentation here than elsewhere: four columns, and a fence.
test('what is code in Markdown is code in the site', {skip}, () => {
  const problems = [];
  for (const page of repositoryFiles('docs').filter((f) => f.endsWith('.md'))) {
    const code = [...pages.get(html(page)).matchAll(/<pre>([^]*?)<\/pre>/g)].map((m) => m[1].replace(/<[^>]+>/g, '')).join('\n');
    const shown = new Set(plain(code).split('\n').map((line) => line.trim()));
    for (const {number, text, code, mark} of linesOf(page)) {
      if (code === null || mark || text.trim() === '' || shown.has(text.trim())) continue;
      problems.push(`${page}:${number}: is words in the site: ${text.trim()}`);
    }
  }
  assert.deepEqual(problems, [], problems.join('\n'));
});

test('every page says of which commit it is', {skip}, () => {
  for (const [page, text] of pages) assert.match(text, /poise \d+\.\d+\.\d+, (commit [0-9a-f]{7,} of \d{4}-\d\d-\d\d|commit unknown)/, page);
});

test('a table of results that is older than the code says so', {skip}, (t) => {
  const {stdout} = spawnSync('python3', [join(root, 'docs/site/older.py')], {encoding: 'utf8'});
  const told = stdout.split('\n').filter(Boolean).map((line) => line.split(':')[0]);
  for (const page of repositoryFiles('docs/results')) {
    const marks = pages.get(html(page)).match(/<strong>Older than the code<\/strong>/g) ?? [];
    assert.equal(marks.length, told.filter((name) => name === page).length, page);
  }
  t.diagnostic(`${told.length} tables are older than the code`);
});

test('KaTeX sets every equation', {skip}, (t) => {
  const katex = createRequire(import.meta.url)(KATEX);
  let count = 0;
  for (const [page, text] of pages) {
    for (const [, element, tex] of text.matchAll(/<(span|div) class="arithmatex">\\[([]([^]*?)\\[)\]]<\/\1>/g)) {
      assert.doesNotThrow(() => katex.renderToString(plain(tex), {displayMode: element === 'div'}), `${page}: ${tex}`);
      count += 1;
    }
    const prose = text.replace(/<(pre|code|script|nav)\b[^]*?<\/\1>/g, '');
    assert.doesNotMatch(prose, /\$\$|\$\\/, `${page}: an equation was taken for words`);
  }
  t.diagnostic(`${count} equations`);
  assert.ok(count > 100);
});

test('a page leads to itself in another version, and says that it is an older one', {skip}, async () => {
  const older = join(versions, 'v0.0.1');
  for (const part of ['assets', 'search', 'index.html', 'docs/index.html']) cpSync(join(site, part), join(older, part), {recursive: true});
  const {status, stderr} = spawnSync('/usr/bin/python3', ['-c', 'import hooks, sys; hooks.list_versions(sys.argv[1])', versions],
      {encoding: 'utf8', cwd: join(root, 'docs/site'), env: {...process.env, PYTHONDONTWRITEBYTECODE: '1'}});
  assert.equal(status, 0, stderr);
  const browser = await launchBrowser(options.web);
  try {
    const tab = await (await browser.newContext()).newPage();
    tab.setDefaultTimeout(PATIENCE);
    const address = (...parts) => pathToFileURL(join(versions, ...parts)).href;
    const own = basename(site);
    const choose = async (version, page) => {
      await tab.selectOption('select.version', version);
      await tab.waitForURL(address(version, page));
    };
    await tab.goto(address('index.html'));
    await tab.waitForURL(address(own, 'index.html'));
    await tab.goto(address(own, 'docs/concepts/tick.html'));
    assert.deepEqual(await tab.locator('select.version option').allTextContents(), [own, 'v0.0.1']);
    assert.equal(await tab.inputValue('select.version'), own);
    assert.equal(await tab.locator('.md-content .warning').count(), 0);
    await choose('v0.0.1', 'index.html');  // it lacks that page
    assert.match(await tab.textContent('.md-content .warning'), /^This page is of v0\.0\.1\./);
    await tab.goto(address('v0.0.1', 'docs/index.html'));
    await choose(own, 'docs/index.html');
  } finally {
    await browser.close();
  }
});

test('a browser shows, searches and scrolls it from files', {skip}, async (t) => {
  const browser = await launchBrowser(options.web);
  try {
    const context = await browser.newContext();
    context.setDefaultTimeout(PATIENCE);
    const tab = await context.newPage();
    const problems = [];
    tab.on('console', (message) => { if (message.type() === 'error') problems.push(message.text()); });
    tab.on('pageerror', (error) => problems.push(String(error)));
    tab.on('request', (request) => { if (!/^(file|blob|data):/.test(request.url())) problems.push(`request of ${request.url()}`); });
    await tab.setViewportSize({width: Math.min(...WIDTHS), height: 900});  // what fits here fits a wider one
    for (const page of pages.keys()) {
      await tab.goto(pathToFileURL(join(site, page)).href);
      const shown = await tab.evaluate(() => [...document.querySelectorAll('.arithmatex')].map((e) => e.querySelector('.katex') !== null));
      if (shown.includes(false)) problems.push(`${page}: shows ${shown.filter(Boolean).length} of ${shown.length} equations`);
      const beyond = await tab.evaluate(() => document.documentElement.scrollWidth - innerWidth);
      if (beyond > 0) problems.push(`${page}: ${beyond} pixels wider than a phone`);
    }
    for (const width of WIDTHS) {
      await tab.setViewportSize({width, height: 900});
      await tab.goto(pathToFileURL(join(site, 'docs/concepts/tick.html')).href);
      if (width < 1000) await tab.click('.md-header__button[for=__search]');
      await tab.fill('.md-search__input', 'sole_margin');
      await tab.locator('.md-search-result__link').first().click();
      await tab.waitForURL(/\?h=/);
      assert.match(await tab.textContent('.md-content'), /sole_margin/);
    }
    assert.deepEqual(problems, [], problems.join('\n'));
    for (const width of options.pictures ? WIDTHS : []) {
      for (const colorScheme of ['light', 'dark']) {
        const view = await (await browser.newContext({viewport: {width, height: 1000}, colorScheme})).newPage();
        for (const page of ['index', 'docs/concepts/contact_dynamics', 'docs/results/walking', 'reference/fields', 'docs/lab/index']) {
          await view.goto(pathToFileURL(join(site, `${page}.html`)).href);
          const name = `${page.replaceAll('/', '_')}_${width}_${colorScheme}.png`;
          await view.screenshot({path: join(options.pictures, name)});
          t.diagnostic(name);
        }
      }
    }
  } finally {
    await browser.close();
  }
});
