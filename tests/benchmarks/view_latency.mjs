// What `poise view` and `poise run --ros2` cost a run: 99th percentiles of the components' latencies in real time, without either, with a
// viewer whose stream is read, with a page in a browser (which takes processor time of its own), and with ROS 2's topics. Interleaved: load
// is the same for all.
// Usage: node tests/benchmarks/view_latency.mjs [--poise PROGRAM] [--web DIR] [--duration S] [--repeat N] [--browser] [--ros2]
import {mkdtempSync, readFileSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {fileURLToPath} from 'node:url';
import {parseArgs} from 'node:util';
import {launchBrowser, openPage} from '../web/browser.mjs';
import {startRun, startView} from '../web/live_run.mjs';
import {openStream} from '../web/raw_socket.mjs';

const root = fileURLToPath(new URL('../../', import.meta.url));
const USAGE = 'node tests/benchmarks/view_latency.mjs [--poise PROGRAM] [--web DIR] [--duration S] [--repeat N] [--browser] [--ros2]';

let options;
try {
  ({values: options} = parseArgs({options: {
    poise: {type: 'string', default: join(root, 'build/release/bin/poise')}, web: {type: 'string', default: join(root, 'build/web')},
    duration: {type: 'string', default: '5'}, repeat: {type: 'string', default: '5'}, browser: {type: 'boolean'}, ros2: {type: 'boolean'},
    help: {type: 'boolean', short: 'h'}}}));
} catch (error) {
  console.error(`${error.message}\nUsage: ${USAGE}`);
  process.exit(2);
}
const repeat = Number(options.repeat);
if (options.help || !(repeat >= 1) || !(Number(options.duration) > 0)) {
  console.error(`Usage: ${USAGE}`);
  process.exit(options.help ? 0 : 2);
}

const folder = mkdtempSync(join(tmpdir(), 'poise-view-latency-'));
const median = (values) => values.toSorted((a, b) => a - b)[Math.floor(values.length / 2)];
const WITH = ['without', 'stream', ...(options.browser ? ['browser'] : []), ...(options.ros2 ? ['ros2'] : [])];
let browser, run, view;

/** p99 in us by component. */
async function measure(what, out) {
  run = startRun(options.poise, out, '--realtime', '--duration', options.duration, ...(what === 'ros2' ? ['--ros2'] : []));
  let stream, page;
  if (what === 'stream' || what === 'browser') {
    view = await startView(options.poise, run, out);
    if (what === 'stream') stream = await openStream(view.port);
    else ({page} = await openPage(browser, view.url));
  }
  await run.ended;
  const summary = JSON.parse(readFileSync(join(out, 'summary.json'), 'utf8'));
  if (summary.ticks !== summary.planned_ticks) console.error(`a run ${what} ended early: ${summary.end}`);
  const bytes = stream?.socket.bytesRead;
  stream?.socket.destroy();
  await page?.context().close();
  await view?.stop();
  view = undefined;
  if (what === 'ros2') {
    const log = readFileSync(join(out, 'ros2.log'), 'utf8');
    if (!(Number(/(\d+) messages published, 0 not/.exec(log)?.[1]) > 1000)) throw new Error(`poise ros2: ${log}`);
  }
  if (stream && !(bytes > 1e5)) throw new Error(`the stream gave ${bytes} bytes`);
  // The recorder takes no part in a tick.
  return Object.fromEntries(summary.components.filter((c) => c.name !== 'recorder').map((c) => [c.name, c.latency_us.p99]));
}

try {
  if (options.browser) browser = await launchBrowser(options.web);
  const results = Object.fromEntries(WITH.map((what) => [what, []]));
  for (let i = 0; i < repeat; ++i) {
    for (const what of i % 2 ? WITH.toReversed() : WITH) results[what].push(await measure(what, join(folder, `${what}-${i}`)));
  }
  console.log(`latency p99 (us), median of ${repeat} runs of ${options.duration} s in real time`);
  console.log(`${'component'.padEnd(24)}${WITH.map((what) => what.padStart(10)).join('')}   ratio`);
  const ratios = WITH.slice(1).map(() => []);
  for (const name of Object.keys(results.without[0])) {
    const values = WITH.map((what) => median(results[what].map((r) => r[name])));
    values.slice(1).forEach((v, k) => ratios[k].push(v / values[0]));
    console.log(`${name.padEnd(24)}${values.map((v) => v.toFixed(0).padStart(10)).join('')}   ${
      values.slice(1).map((v) => (v / values[0]).toFixed(2)).join('  ')}`);
  }
  console.log(`median ratio: ${WITH.slice(1).map((what, k) => `${what} ${median(ratios[k]).toFixed(2)}`).join(', ')}`);
} finally {
  await browser?.close();
  await run?.stop();
  await view?.stop();
  rmSync(folder, {recursive: true, force: true});
}
