// A run in progress and `poise view` of it.
import assert from 'node:assert/strict';
import {spawn, spawnSync} from 'node:child_process';
import {once} from 'node:events';
import {after} from 'node:test';

const ENDS = 20000;  // ms that a program may take to end

const programs = [];

// A test that fails leaves its programs behind, which would keep node.
after(() => Promise.all(programs.map((program) => program.stop())));

/** Ends what a test began, also where it failed: what it leaves takes the machine from those after it. */
export async function endTest(browser) {
  for (const context of browser.contexts()) await context.close();
  await Promise.all(programs.splice(0).map((program) => program.stop()));
}

class Program {
  constructor(poise, parameters) {
    programs.push(this);
    this.output = '';
    this.child = spawn(poise, parameters, {stdio: ['ignore', 'pipe', 'pipe']});
    this.ended = once(this.child, 'exit').then(([code]) => code);
    for (const stream of [this.child.stdout, this.child.stderr]) {
      stream.on('data', (data) => {
        this.output += data;
        this.child.emit('output');
      });
    }
  }

  /** The match of `pattern` in what it prints, as soon as it does. */
  async prints(pattern) {
    while (!pattern.test(this.output)) {
      const ended = await Promise.race([once(this.child, 'output').then(() => false), this.ended.then(() => true)]);
      if (ended && !pattern.test(this.output)) throw new Error(`it ended without ${pattern}: ${this.output}`);
    }
    return pattern.exec(this.output);
  }

  /** Ctrl-C; gives the exit code. */
  async stop() {
    this.child.kill('SIGINT');
    const late = setTimeout(() => this.child.kill('SIGKILL'), ENDS);
    const code = await this.ended;
    clearTimeout(late);
    return code;
  }
}

export const startRun = (poise, folder, ...more) => new Program(poise, ['run', 'push_double_support', '--out', folder, ...more]);

/** Of a robot that only stands: whenever a test pushes it, nothing else does. */
export const startStanding = (poise, folder, ...more) => new Program(poise, ['run', 'stand', '--out', folder, ...more]);

/** `poise view` of a run in `folder` that is starting; has `port` and `url`. */
export async function startView(poise, run, folder, ...more) {
  await run.prints(/run \d+/);
  const view = new Program(poise, ['view', folder, ...more]);
  const [, url, port] = await view.prints(/(http:\/\/127\.0\.0\.1:(\d+)\/\S*)/);
  return Object.assign(view, {url, port: Number(port)});
}

/** `poise run stand --interactive`; has `port` and `url`. */
export const startInteractive = (poise, folder, ...more) => interactive(poise, 'stand', folder, ...more);

/** The same of any scenario. Its page gets every tick; a page beside a run on the bus lacks what a busy machine loses. */
export async function interactive(poise, scenario, folder, ...more) {
  const run = new Program(poise, ['run', scenario, '--interactive', '--out', folder, ...more]);
  const [, url, port] = await run.prints(/(http:\/\/127\.0\.0\.1:(\d+)\/\S*)/);
  return Object.assign(run, {url, port: Number(port)});
}

/**
 * The log of a run in real time replays to the same bits, as far as it can be compared: a busy machine skips ticks, whose messages the log
 * then lacks, and hw_bridge goes by the clock, which a replay has not.
 */
export function replaysInPart(poise, log) {
  const {status, stdout, stderr} = spawnSync(poise, ['replay', log], {encoding: 'utf8'});
  const verdicts = new Map([...stdout.matchAll(/^(\w+): \d+ ticks in .*: (\w+)$/gm)].map(([, name, verdict]) => [name, verdict]));
  assert.equal(verdicts.get('sim'), 'equal', stdout + stderr);
  const clock = verdicts.get('hw_bridge');
  verdicts.delete('hw_bridge');
  assert.deepEqual([...new Set(verdicts.values())], ['equal'], stdout);
  if (status !== 0 && clock !== 'DIFFERENT') assert.match(stderr, /cannot be replayed: the log lacks/);
}

/** Every component of the log, fed with what stands in it, gives the same bits. */
export function replays(poise, log) {
  const replay = spawnSync(poise, ['replay', log], {encoding: 'utf8'});
  assert.equal(replay.status, 0, replay.stdout + replay.stderr);
  assert.doesNotMatch(replay.stdout, /DIFFERENT|differ/);
  assert.ok(replay.stdout.match(/the same bits/g).length >= 6, replay.stdout);
}
