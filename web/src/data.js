// A run's signals by tick, whether they come with the page or arrive while the run goes on.
import {unpack} from './codec.js';
import {Column} from './column.js';
import {parseMessage} from './messages.js';

/**
 * Unit, text, names of values and label of a field path such as "foot_wrench[1].force[2]". The label names joints and feet:
 * "foot_wrench[left].force[2]". `names`: of lists' elements by the message's count.
 */
function describeField(messages, type, path, names) {
  let message = messages[type];
  let result = {unit: '', text: ''};
  const labels = path.split('.');
  for (const [i, part] of labels.entries()) {
    const [, name, index] = /^(\w+)(?:\[(\d+)\])?$/.exec(part) ?? [];
    const field = message?.fields[name];
    if (!field) break;
    const text = [result.text, field.text].filter(Boolean).join('; ');
    const known = names[field.count]?.[index];
    if (known !== undefined) labels[i] = `${name}[${known}]`;
    result = {unit: field.unit || result.unit, text, valueNames: field.values};
    message = messages[field.type];
  }
  return {...result, label: labels.join('.')};
}

/** One scalar by row; NaN where its channel has no message. `values` is there after load(). */
class Signal {
  #column = null;
  #loading = null;

  /** By row, of a page whose rows hold several ticks: the least and the largest of all the row's values; there after load(). */
  least;
  largest;

  constructor(channel, spec, description) {
    const {field, integer = false} = spec;
    Object.assign(this, {channel, spec, field, integer, name: `${channel.name}.${field}`}, description);
    /** As people read it: joints and feet by their names. */
    this.title = `${channel.name}.${this.label}`;
    if (channel.run.meta.live) this.clear();
  }

  get values() { return this.#column?.values; }

  load() { return this.#loading ??= this.#load(); }

  async #load() {
    const {channel, spec} = this;
    const bounds = spec.least ? [spec.least, spec.largest].map((bound) => channel.read(bound, true)) : [];
    const [values, least, largest] = await Promise.all([channel.read(spec, this.integer), ...bounds]);
    Object.assign(this, {least, largest});
    this.#column = new Column(values);
  }

  /** Rows at the beginning that there are no values of yet. */
  prepend(count) { this.#column.prepend(count); }

  /** Values that come after later ones. */
  fill(row, values) { this.#column.set(row, values); }

  /** Adds `values` at the end and lets go of the first `dropped`. Throws when packed values have not been loaded. */
  append(values, dropped = 0) {
    if (!this.#column && this.spec.blob !== undefined) throw new Error(`${this.name}: load it before it grows`);
    if (!this.#column) this.clear();
    this.#column.append(values, dropped, this.channel.run.keep);
  }

  /** Lets go of all values and has none to load: the run grows from here. */
  clear() {
    this.#column = new Column(this.integer ? new Float64Array(0) : new Float32Array(0));
    this.#loading = Promise.resolve();
  }
}

const FEW = 0.2;  // of the ticks: messages of a channel that nothing sends in every tick

class Channel {
  #ticks = null;

  constructor(run, spec, blob) {
    Object.assign(this, {run, spec, blob, name: spec.name, type: spec.type});
    /** It has a message in a few ticks only, as of an operator; a channel with gaps has not. */
    this.sparse = spec.sparse
      ?? (spec.ticks !== undefined && (run.meta.live !== undefined || spec.count < FEW * run.numRows));
  }

  /** A packed column by row. */
  async read(packed, integer) {
    if (this.run.rows) return unpack(packed, this.run.numRows, this.blob, integer);
    const column = await unpack(packed, this.spec.count, this.blob, integer);
    if (this.spec.ticks === undefined) return column;
    const ticks = await (this.#ticks ??= unpack(this.spec.ticks, this.spec.count, this.blob, true));
    const values = new column.constructor(this.run.numRows).fill(NaN);
    ticks.forEach((tick, i) => { values[tick - this.run.firstTick] = column[i]; });
    return values;
  }
}

/** The last of `list` for which `before` holds, or the first. */
function lastOf(list, before) {
  let low = 0, high = list.length;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (before(list[middle])) low = middle;
    else high = middle;
  }
  return list[low];
}

/** Rows of several ticks: [first tick, stride, rows] in order, without gaps, up to tick `end`. */
class Rows {
  constructor(spans, end) {
    this.count = 0;
    this.spans = spans.map(([tick, stride, count]) => {
      const span = {tick, stride, count, row: this.count};
      this.count += count;
      return span;
    });
    this.end = end;
  }
  spanOfRow(row) { return lastOf(this.spans, (s) => s.row <= row); }
  tickOf(row) {
    if (row >= this.count) return this.end + row - this.count;
    const {tick, stride, row: first} = this.spanOfRow(row);
    return tick + (row - first) * (row < 0 ? 1 : stride);
  }
  rowOf(tick) {
    if (tick >= this.end) return this.count + tick - this.end;
    const {tick: first, stride, row} = lastOf(this.spans, (s) => s.tick <= tick);
    return tick < first ? tick - first : row + Math.floor((tick - first) / stride);
  }
  /** The most ticks in one row. */
  get largest() { return Math.max(...this.spans.map((s) => s.stride)); }
}

/**
 * One run. `meta`: the JSON of docs/reference/report_format.md; `messages`: of messages.js; `blob`: gives the text of a packed
 * column by its id. It holds the ticks from `firstTick` on, a row each, or of a long run in `rows` of several (meta.rows); a part of a run begins later than 0.
 * A live run (meta.live) starts without ticks, grows by appendTicks, which fires 'append', and keeps the last meta.live.keep ticks.
 */
export class Run extends EventTarget {
  constructor(meta, messages, blob) {
    super();
    Object.assign(this, {meta, scenario: meta.scenario, robot: meta.robot});
    this.period = meta.run.tick_period;
    this.leadTicks = meta.run.lead_ticks ?? 0;  // before the scenario's time 0
    this.firstTick = meta.run.cut?.first_tick ?? 0;
    this.rows = meta.rows && new Rows(meta.rows, meta.run.ticks);
    this.numRows = this.rows?.count ?? Math.max(0, meta.run.ticks - this.firstTick);
    this.keep = meta.live?.keep ?? Infinity;
    this.restarts = 0;
    this.signals = new Map();
    const joints = meta.robot.joints.map((joint) => joint.name);
    // A count in a message tells whose names a list's elements have; motors stand in the order of the joints they drive.
    const names = {num_joints: joints, num_motors: joints, num_feet: meta.robot.feet.map((foot) => foot.name)};
    const known = {...messages, ...Object.fromEntries((meta.messages ?? []).map(parseMessage).map((m) => [m.name, m]))};
    this.channels = meta.channels.map((spec) => {
      const channel = new Channel(this, spec, blob);
      for (const signal of spec.signals) {
        const made = new Signal(channel, signal, describeField(known, spec.type, signal.field, names));
        this.signals.set(made.name, made);
      }
      return channel;
    });
  }

  /** Time of the first row and of the last, s. */
  get start() { return this.timeAt(0); }
  get end() { return this.timeAt(Math.max(0, this.numRows - 1)); }

  /** The signal of the first channel of `type`, as the run's checks take it; undefined when there is none. */
  find(type, field) {
    const channel = this.channels.find((c) => c.type === type);
    return channel && this.signals.get(`${channel.name}.${field}`);
  }

  /** A row's first tick; the row that holds a tick. Either may lie outside of what the run holds. */
  tickOf(row) { return this.rows ? this.rows.tickOf(row) : this.firstTick + row; }
  rowOfTick(tick) { return this.rows ? this.rows.rowOf(tick) : tick - this.firstTick; }
  timeOfTick(tick) { return (tick - this.leadTicks) * this.period; }
  /** The row of a time, which may lie outside of what the run holds. */
  rowOf(time) { return this.rowOfTick(Math.round(time / this.period) + this.leadTicks); }
  rowAt(time) { return Math.min(this.numRows - 1, Math.max(0, this.rowOf(time))); }
  timeAt(row) { return this.timeOfTick(this.tickOf(row)); }
  /** Ticks between a row and the next. */
  strideOf(row) { return this.rows ? this.rows.spanOfRow(row).stride : 1; }

  /** `values`: by signal name, `count` numbers each; a signal that is not named gets NaN. */
  appendTicks(count, values) {
    const none = new Float32Array(count).fill(NaN);
    const dropped = Math.max(0, this.numRows + count - this.keep);
    for (const signal of this.signals.values()) signal.append(values[signal.name] ?? none, dropped);
    this.firstTick += dropped;
    this.numRows += count - dropped;
    this.dispatchEvent(new Event('append'));
  }

  /** Ticks that come after later ones: batches {first, count, values}. What finds no room is passed over. Fires 'restart' and 'append'. */
  fillTicks(batches) {
    const least = Math.max(0, this.firstTick + this.numRows - this.keep);
    const kept = batches.filter(({first, count}) => count > 0 && first + count > least);
    const added = Math.max(0, ...kept.map(({first}) => this.firstTick - Math.max(first, least)));
    for (const signal of added > 0 ? this.signals.values() : []) signal.prepend(added);
    this.firstTick -= added;
    this.numRows += added;
    for (const {first, count, values} of kept) {
      const skipped = Math.max(0, least - first), row = first + skipped - this.firstTick;
      for (const signal of this.signals.values()) {
        const column = values[signal.name];
        if (column) signal.fill(row, column.subarray(skipped, skipped + Math.max(0, this.numRows - row)));
      }
    }
    this.#renumber();
    this.dispatchEvent(new Event('append'));
  }

  /** A live run lets go of all its ticks; others come. Fires 'restart'. */
  restart() {
    for (const signal of this.signals.values()) signal.clear();
    this.numRows = 0;
    this.#renumber();
  }

  /** Rows hold other ticks than before: `restarts` counts that. */
  #renumber() {
    ++this.restarts;
    this.dispatchEvent(new Event('restart'));
  }
}

const ORDINALS = ['first', 'second', 'third', 'fourth', 'fifth', 'sixth', 'seventh', 'eighth', 'ninth', 'tenth'];

/** The runs that `poise report` wrote into the page, each with its place among them: `index`, and in words `called`. */
export function embeddedRuns(document) {
  const messages = JSON.parse(document.getElementById('poise-messages').textContent);
  const blob = (id) => document.getElementById(id).textContent;
  return [...document.querySelectorAll('script.poise-run')]
    .map((element, index) => Object.assign(new Run(JSON.parse(element.textContent), messages, blob),
      {index, called: `${ORDINALS[index] ?? `${index + 1}th`} run`}));
}
