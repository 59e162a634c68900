// A run in progress: its ticks from the stream of `poise view`, and the page that grows with them.
import {element} from '../dom.js';
const RETRY = 1000;          // ms
const SPAN = 10;             // s that the plots show at first
const GROWTH_PERIOD = 33;    // ms, at least
const GROWTH_SHARE = 2;      // times what drawing took: the picture goes first
const FORMAT = 1;
const HEADER = 16;           // bytes

/** {first, count, values by name} of a batch of docs/report-format.md. Throws when it is none of `run`. */
export function decodeBatch(buffer, run) {
  const head = new DataView(buffer);
  if (buffer.byteLength < HEADER || head.getUint32(0, true) !== FORMAT) throw new Error('the stream is of another version');
  const count = head.getUint32(4, true);
  const first = head.getFloat64(8, true);
  const values = {};
  let at = HEADER;
  const take = (type, wanted) => {
    for (const [name, signal] of run.signals) {
      if (!signal.append || signal.integer !== wanted) continue;
      if (at + count * type.BYTES_PER_ELEMENT > buffer.byteLength) throw new Error('a batch of the stream is too short');
      values[name] = new type(buffer, at, count);
      at += count * type.BYTES_PER_ELEMENT;
    }
  };
  take(Float64Array, true);
  take(Float32Array, false);
  if (at !== buffer.byteLength) throw new Error('a batch of the stream is too long');
  return {first, count, values};
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
  status = {ended: false, checks: [], events: [], components: [], checked_ticks: 0, problem: ''};
  #ticks = Infinity;  // of the run, once it has ended

  constructor(run) {
    super();
    this.run = run;
    this.#connect();
  }

  #connect() {
    const {run} = this;
    const url = new URL('stream', location.href);
    url.searchParams.set('from', run.firstTick + run.numRows);
    const token = new URL(location.href).searchParams.get('token');
    if (token) url.searchParams.set('token', token);
    url.protocol = 'ws:';
    const socket = this.#socket = new WebSocket(url);
    socket.binaryType = 'arraybuffer';
    socket.addEventListener('message', ({data}) => {
      if (typeof data === 'string') this.#tell(JSON.parse(data));
      else this.#add(decodeBatch(data, run));
    });
    socket.addEventListener('close', () => {
      if (this.status.ended && this.#allHasCome()) return;
      this.#setState('waiting');
      setTimeout(() => this.#connect(), RETRY);
    });
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
      Object.assign(this.status, {problem: ''}, status);
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
      this.dispatchEvent(new Event('restart'));
    }
    this.lost = lost;
    this.#ticks = state === 'ended' ? ticks : Infinity;
    this.#setState(state === 'ended' && !this.#allHasCome() ? 'live' : state);  // the text overtakes the last ticks
  }

  #add(batch) {
    addBatch(this.run, batch);
    if (this.state === 'live' && this.#allHasCome()) this.#setState('ended');
  }

  #allHasCome() {
    return this.run.firstTick + this.run.numRows >= this.#ticks;
  }

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
