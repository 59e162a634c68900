// Chromium without a window, and a page of a run in it.
import {existsSync} from 'node:fs';
import {createRequire} from 'node:module';
import {resolve} from 'node:path';
import {pathToFileURL} from 'node:url';

const CHROMIUM = '/usr/bin/chromium';
const QUIET = ['--no-first-run', '--disable-background-networking', '--disable-component-update', '--disable-sync',
  '--disable-quic', '--enable-unsafe-swiftshader'];  // no look-ups at start; 3D without a graphics card

/** ms: a busy machine without a graphics card draws slowly, which is no failure. */
export const PATIENCE = 90000;

/** `web`: build/web, where deploy/setup installs playwright-core; `more`: of Chromium's switches. */
export async function launchBrowser(web, more = []) {
  if (!existsSync(CHROMIUM)) throw new Error(`${CHROMIUM} is missing: run deploy/setup, which installs it`);
  const {chromium} = createRequire(resolve(web, 'package.json'))('playwright-core');
  return chromium.launch({executablePath: CHROMIUM, args: [...QUIET, ...more]});
}

/** Of a browser without WebGL: a test that looks elsewhere does without the picture, which takes most of the time without a graphics card. */
function withoutPicture() {
  const {getContext} = HTMLCanvasElement.prototype;
  HTMLCanvasElement.prototype.getContext = function (kind, ...more) { return kind === 'webgl2' ? null : getContext.call(this, kind, ...more); };
}

/**
 * Opens a file from disk or an http address; `problems` gathers errors of its console and every request beyond the page itself. `picture`:
 * the robot is drawn in 3D. The other options are Playwright's.
 */
export async function openPage(browser, file, {picture = true, ...options} = {}) {
  const context = await browser.newContext({viewport: {width: 1100, height: 800}, deviceScaleFactor: 0.5,
    acceptDownloads: true, ...options});
  context.setDefaultTimeout(PATIENCE);
  if (!picture) await context.addInitScript(withoutPicture);
  const page = await context.newPage();
  const problems = [];
  page.on('console', (message) => { if (message.type() === 'error') problems.push(message.text()); });
  page.on('pageerror', (error) => problems.push(String(error)));
  const url = file.startsWith('http:') ? file : pathToFileURL(resolve(file)).href;
  page.on('request', (request) => {
    const own = request.url() === url || request.url().startsWith(new URL('ticks?', url).href);  // earlier ticks of a run in progress
    if (!own && !/^(blob|data):/.test(request.url())) problems.push(`request of ${request.url()}`);
  });
  await page.goto(url);
  await page.waitForFunction(() => document.documentElement.dataset.ready
    || document.querySelector('[role=alert]'), null, {timeout: PATIENCE});
  return {page, problems};
}

/** Where a body's frame is seen, CSS pixels. */
const seen = (page, body) => page.evaluate((b) => {
  const {scene} = window.poise;
  scene.renderNow();
  const at = scene.controls.target.clone();
  scene.robotView.groups[b].getWorldPosition(at);
  at.project(scene.camera);
  const box = scene.renderer.domElement.getBoundingClientRect();
  return {x: box.left + (at.x + 1) / 2 * box.width, y: box.top + (1 - at.y) / 2 * box.height};
}, body);

/** Presses on the first body that is hit where its frame is seen; gives the place. */
export async function grab(page) {
  const bodies = await page.evaluate(() => window.poise.run.robot.bodies.length);
  for (let body = 0; body < bodies; ++body) {
    const at = await seen(page, body);
    await page.mouse.move(at.x, at.y);
    await page.mouse.down();
    if (await page.locator('canvas.grabbing').count() > 0) return at;
    await page.mouse.up();
  }
  throw new Error('no body could be grabbed');
}
