// docs/report.png shows what the page of its run shows now: the same words and figures on the first screen. With --retake
// it is taken anew. The date, the commit and the machine's times are left out, so that no commit makes it old by itself.
// Usage: node pictures_test.mjs --poise PROGRAM --web DIR [--retake], where DIR is build/web
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {mkdtempSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {test} from 'node:test';
import {parseArgs} from 'node:util';
import {launchBrowser, openPage} from '../web/browser.mjs';
import {comparable, otherBits, root} from './markdown.mjs';
import {readText, withText} from './png_text.mjs';

const {values: options} = parseArgs({options: {poise: {type: 'string'}, web: {type: 'string'}, retake: {type: 'boolean'}}});
const PICTURE = join(root, 'docs/report.png');
const SIZE = {width: 1320, height: 1280};
const TIME = 0.42;  // s: while the push acts and balancing holds the centre of pressure

/** The words that the viewport shows, from top to bottom. */
const wordsOf = (page) => page.evaluate(() => {
  const words = [];
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let node = walker.nextNode(); node; node = walker.nextNode()) {
    const text = node.textContent.trim();
    const parent = node.parentElement;
    if (text === '' || parent.closest('script, style, noscript') || !parent.checkVisibility()) continue;
    const range = document.createRange();
    range.selectNodeContents(node);
    const box = range.getBoundingClientRect();
    if (box.width > 0 && box.bottom > 0 && box.top < innerHeight) words.push(text);
  }
  return words;
});

test('the picture of the page shows what the page shows', {skip: otherBits(options.poise)}, async () => {
  const folder = mkdtempSync(join(tmpdir(), 'poise-pictures-'));
  let browser;
  try {
    const poise = (...parameters) => {
      const {status, stderr} = spawnSync(options.poise, parameters, {encoding: 'utf8'});
      assert.equal(status, 0, stderr);
    };
    poise('run', 'push_double_support', '--inline', '--quiet', '--out', join(folder, 'run'));
    poise('report', join(folder, 'run'));
    browser = await launchBrowser(options.web);
    const {page, problems} = await openPage(browser, join(folder, 'run/report.html'), {viewport: SIZE, deviceScaleFactor: 1});
    await page.evaluate(async (time) => {
      window.poise.player.seek(time);
      await new Promise((resolve) => { requestAnimationFrame(() => requestAnimationFrame(resolve)); });
      window.poise.scene?.renderNow();
    }, TIME);
    await page.waitForFunction(() => document.querySelectorAll('#figures canvas').length > 0);
    await page.waitForTimeout(1000);  // plots are drawn when they come into sight
    const text = (await wordsOf(page)).map((line) => comparable(line)).join('\n');
    assert.deepEqual(problems, []);
    if (options.retake) {
      writeFileSync(PICTURE, withText(await page.screenshot(), text));
      return;
    }
    assert.deepEqual(readText(readFileSync(PICTURE))?.split('\n'), text.split('\n'),
        'docs/report.png is old; take it again: deploy/pictures');
  } finally {
    await browser?.close();
    rmSync(folder, {recursive: true, force: true});
  }
});
