// A run in progress: its ticks from the stream of `poise view`, and the page that grows with them.
import {element} from '../dom.js';
const RETRY = 1000;          // ms
const SPAN = 10;             // s that the plots show at first
const GROWTH_PERIOD = 33;    // ms, at least
const GROWTH_SHARE = 2;      // times what drawing took: the picture goes first
const FORMAT = 2;
const HEADER = 32;           // bytes
const LIVE = 0.3;            // s behind the run that still count as live: a person's own reaction takes as long
const FILL_LEAST = 500;      // ticks of the past that are taken over at once, or as many as the page has: each time all is drawn anew
const FILL_PAUSE = 3;        // times what a request of the past took: the pause after it, while the page is behind

/** {first, count, end (tick of the server), time (s, of its clock), values by name} of a batch of docs/reference/report_format.md. Throws when it is none of `run`. */
export function decodeBatch(buffer, run) {
  const head = new DataView(buffer);
  if (buffer.byteLength < HEADER || head.getUint32(0, true) !== FORMAT) throw new Error('the stream is of another version');
  const count = head.getUint32(4, true);
  const [first, end, time] = [8, 16, 24].map((place) => head.getFloat64(place, true));
  const values = {};
  let at = HEADER;
  const take = (type, wanted) => {
    for (const [name, signal] of run.signals) {
      if (signal.integer !== wanted) continue;
      if (at + count * type.BYTES_PER_ELEMENT > buffer.byteLength) throw new Error('a batch of the stream is too short');
      values[name] = new type(buffer, at, count);
      at += count * type.BYTES_PER_ELEMENT;
    }
  };
  take(Float64Array, true);
  take(Float32Array, false);
  if (at !== buffer.byteLength) throw new Error('a batch of the stream is too long');
  return {first, count, end, time, values};
}

/** Adds a batch to the run: ticks that it has are passed over, those that it never got are rows of NaN. */
export function addBatch(run, {first, count, values}) {
  if (run.numRows === 0) run.firstTick = first;
  const missed = first - run.firstTick - run.numRows;
  if (missed > 0) {
    const rows = Math.min(missed, run.keep);
    run.firstTick += missed - rows;
    run.appendTicks(rows, {});
  }
  const known = Math.max(0, -missed);
  if (known >= count) return;
  run.appendTicks(count - known, known === 0 ? values
    : Object.fromEntries(Object.entries(values).map(([name, column]) => [name, column.subarray(known)])));
}

const nothingKnown = () => ({ended: false, checks: [], events: [], components: [], checked_ticks: 0, problem: '', story: ''});

/**
 * Fires 'state': it or the messages lost by the server have changed; 'status': checks, events and components' health have
 * come; 'restart': the run went back, its ticks come anew. A lost connection is made again.
 */
export class LiveFeed extends EventTarget {
  control;     // what may be done and is in force, of a page that may act; with the event 'control'
  #socket;
  #branch = 0;  // of an interactive run: how often it went back
  state = 'connecting';  // then 'live', 'ended', or 'waiting' for a lost connection
  lost = 0;
  status = nothingKnown();
  #ticks = Infinity;  // of the run, once it has ended
  #missing = [];      // [from, to): ticks that were passed over, the earliest first
  #filling = false;
  #newest;            // of the last batch: {tick: the server's end, time: s of this page's clock at which it was made}
  #ahead = Infinity;  // s that this page's clock is ahead of the server's, at most

  constructor(run) {
    super();
    this.run = run;
    this.#connect();
  }

  #connect() {
    const {run} = this;
    const url = new URL('stream', location.href);
    url.search = this.#access();
    url.protocol = 'ws:';
    const socket = this.#socket = new WebSocket(url);
    socket.binaryType = 'arraybuffer';
    socket.addEventListener('message', ({data}) => {
      if (typeof data === 'string') this.#tell(JSON.parse(data));
      else this.#add(decodeBatch(data, run));
      this.#fill();
    });
    socket.addEventListener('close', () => {
      if (this.status.ended && this.#allHasCome()) return;
      this.#setState('waiting');
      setTimeout(() => this.#connect(), RETRY);
    });
  }

  /** "token=..." of this page's address, or nothing. */
  #access(more = {}) {
    const token = new URL(location.href).searchParams.get('token');
    return new URLSearchParams({...more, ...(token && {token})});
  }

  /** s that the page is behind the run; of a run that waits, of what it has done. */
  get behind() {
    const {run} = this, held = run.firstTick + run.numRows;
    const {paused, tick} = this.control?.run ?? {};
    if (paused) return Math.max(0, tick - held) * run.period;
    if (!this.#newest) return Infinity;
    return Math.max(0, this.#newest.tick - held) * run.period + Math.max(0, performance.now() / 1000 - this.#newest.time);
  }

  /** Whether what it shows is what is. */
  get live() { return this.behind <= LIVE; }

  /** Ticks that the server may have and the page lacks. */
  get missing() { return this.#missing.reduce((sum, [from, to]) => sum + to - from, 0); }

  /** Asks for what was passed over, the latest first; what is new goes before it. */
  async #fill() {
    if (this.#filling) return;
    this.#filling = true;
    const branch = this.#branch;
    try {
      while (this.#missing.length > 0 && branch === this.#branch) await this.#fillGap(this.#missing.at(-1), branch);
    } catch (error) {
      if (!(error instanceof TypeError)) throw error;  // no connection: with the next batch there is one
    } finally {
      this.#filling = false;
    }
  }

  async #fillGap(gap, branch) {
    const {run} = this, batches = [];
    let rows = 0;
    gap[0] = Math.max(gap[0], run.firstTick + run.numRows - run.keep);
    while (gap[0] < gap[1] && rows < Math.max(FILL_LEAST, run.numRows)) {
      const start = performance.now();
      const answer = await fetch(`ticks?${this.#access({before: gap[1]})}`);
      const buffer = await answer.arrayBuffer();
      if (branch !== this.#branch) return;
      const {first, count, values} = decodeBatch(buffer, run);
      if (count === 0 || first + count <= gap[0]) gap[1] = gap[0];  // the server has them no more
      else {
        batches.push({first, count, values});
        gap[1] = Math.max(gap[0], first);
        rows += count;
      }
      if (gap[0] < gap[1] && this.state === 'live' && !this.live) await new Promise((done) => { setTimeout(done, FILL_PAUSE * (performance.now() - start)); });
    }
    if (gap[0] >= gap[1]) this.#missing.splice(this.#missing.indexOf(gap), 1);
    if (batches.length > 0) run.fillTicks(batches);
  }

  /** A text to the server. False: there is no connection. */
  send(text) {
    if (this.#socket?.readyState !== WebSocket.OPEN) return false;
    this.#socket.send(text);
    return true;
  }

  #tell({run_id: id, state, lost, end_tick: ticks, status, control, branch}) {
    if (id !== this.run.meta.run.run_id) return location.reload();  // another run is served here
    if (status) {
      Object.assign(this.status, {problem: '', story: ''}, status);
      if (status.run) Object.assign(this.run.meta.run, status.run);
      this.dispatchEvent(new Event('status'));
      return;
    }
    if (control) {
      this.control = control;
      this.dispatchEvent(new Event('control'));
      return;
    }
    if (branch !== undefined && branch !== this.#branch) {
      if (this.run.numRows > 0) this.run.restart();
      this.#branch = branch;
      this.#missing = [];
      this.status = nothingKnown();
      this.run.meta.run.ended = false;
      this.dispatchEvent(new Event('restart'));
    }
    this.lost = lost;
    this.#ticks = state === 'ended' ? ticks : Infinity;
    this.#setState(state === 'ended' && !this.#allHasCome() ? 'live' : state);  // the text overtakes the last ticks
  }

  #add(batch) {
    const {run} = this, held = run.numRows > 0 ? run.firstTick + run.numRows : 0;
    const from = Math.max(held, batch.first + batch.count - run.keep);
    if (batch.first > from) this.#missing.push([from, batch.first]);
    const now = performance.now() / 1000;
    this.#ahead = Math.min(this.#ahead, now - batch.time);
    this.#newest = {tick: batch.end, time: batch.time + this.#ahead};
    addBatch(this.run, batch);
    if (this.state === 'live' && this.#allHasCome()) this.#setState('ended');
  }

  #allHasCome() { return this.run.firstTick + this.run.numRows >= this.#ticks; }

  #setState(state) {
    this.state = state;
    this.dispatchEvent(new Event('state'));
  }
}

/** Waits until there is something to show. */
export async function firstTicks(feed) {
  if (feed.run.numRows > 0) return;
  const text = element('p', {class: 'soft'});
  const tell = () => {
    text.textContent = {connecting: 'Connecting', live: 'Waiting for the first tick', ended: 'The run has ended without a tick.',
      waiting: 'No connection: trying again'}[feed.state];
  };
  feed.addEventListener('state', tell);
  tell();
  document.getElementById('header').append(text);
  await new Promise((done) => { feed.run.addEventListener('append', done, {once: true}); });
  feed.removeEventListener('state', tell);
  text.remove();
}

/** Calls `refresh` after the run has grown, as often as drawing it allows. */
export function followGrowth(shared, refresh) {
  let waiting = false, delay = GROWTH_PERIOD;
  const grow = async () => {
    const start = performance.now();
    shared.phases.update();
    waiting = false;
    refresh();
    await null;  // uPlot draws
    delay = Math.max(GROWTH_PERIOD, GROWTH_SHARE * (performance.now() - start));
  };
  shared.run.addEventListener('append', () => {
    if (waiting) return;
    waiting = true;
    setTimeout(grow, delay);
  });
}

/** Cursor and plots stay at the end until the reader goes elsewhere. */
export function showEnd({player, view}) {
  view.addEventListener('away', () => player.setFollowing(false));
  view.setLast(SPAN);
  player.setFollowing(true);
}
