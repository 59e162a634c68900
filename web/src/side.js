// What holds at the time cursor, and the events.
import {element} from './dom.js';
import {DERIVED, measuredName} from './figures.js';
import {FOOTSTEPS} from './footsteps.js';
import {formatNumber, quantity} from './units.js';

const DIGITS = 3;

/** What holds at the time cursor, of the other runs beneath the first: {element, load(), update(time)}. */
export class Readout {
  constructor(runs) {
    this.parts = runs.map((run) => ({run, rows: rowsOf(run), cells: new Map()}));
    const names = [...new Set(this.parts.flatMap(({rows}) => rows.map(([name]) => name)))];
    const row = (name) => {
      const values = this.parts.map(({cells}, i) => {
        const value = element('div', {class: i > 0 ? 'second' : null}, '–');
        cells.set(name, value);
        return value;
      });
      return element('tr', {}, element('th', {scope: 'row'}, name), element('td', {class: 'number'}, ...values));
    };
    this.element = element('table', {class: 'readout'}, element('tbody', {}, ...names.map(row)));
  }

  async load() {
    await Promise.all(this.parts.flatMap(({rows}) => rows.flatMap(([, signals]) => signals)).map((s) => s.load()));
  }

  update(time) {
    for (const {run, rows, cells} of this.parts) {
      const row = run === this.parts[0].run ? run.rowAt(time) : run.rowOf(time);  // the others may have ended before
      for (const [name, signals, text] of rows) cells.get(name).textContent = text(signals.map((s) => s.values?.[row] ?? NaN));
    }
  }
}

/** [name, signals, text of their values] */
function rowsOf(run) {
  const derived = (...fields) => fields.map((field) => run.find(DERIVED, field));
  const named = (name, type, field) => {
    const signal = run.find(type, field);
    return [name, [signal], ([v]) => signal.valueNames?.[v] ?? formatNumber(v)];
  };
  const metres = (values) => quantity(values, 'm', DIGITS, true);
  const newton = (values) => quantity(values, 'N', DIGITS, true);
  const step = ['stepping', 'step_reason', 'step_foot'].map((field) => run.find('planner_status_t', field));
  const feet = run.robot.feet.map((foot) => foot.name);
  return [
    ['phase', [run.find('planner_status_t', 'phase')], ([i]) => run.scenario.step_planner?.phase?.[i]?.name ?? formatNumber(i)],
    named('plan', 'support_plan_t', 'status'), named('controller', 'task_torque_t', 'status'),
    named('bridge', 'bridge_status_t', 'state'),
    ['η', [run.find('joint_command_t', 'eta')], ([v]) => formatNumber(v, DIGITS)],
    ['CoP computed x, y', ['cop[0]', 'cop[1]'].map((f) => run.find('balance_torque_t', f)), metres],
    [`CoP ${measuredName(run)} x, y`, derived('cop_measured[0]', 'cop_measured[1]'), metres],
    ['COM error x, y, z', derived('com_error[0]', 'com_error[1]', 'com_error[2]'), metres],
    ['push', derived('push_magnitude'), newton],
    ['step', step, (v) => (Number.isNaN(v[0]) ? '–' : v[0] > 0 ? `${feet[v[2]]}, ${step[0].valueNames[v[0]]}: ${step[1].valueNames[v[1]]}` : 'none')],
    ...stepRows(run),
    ...run.robot.feet.flatMap((foot, f) => ['measured', 'computed'].map((kind) =>
      [`${foot.name} load, ${kind === 'measured' ? measuredName(run) : kind}`, derived(`foot[${f}].load_${kind}`), newton])),
  ].filter(([, signals]) => signals.every(Boolean));
}

/** Of a run whose planner makes steps. */
function stepRows(run) {
  if (!run.find(FOOTSTEPS, 'stance')) return [];
  const caught = ([stance, steps]) => (Number.isNaN(stance) ? '–' : Number.isNaN(steps) ? (stance < 0 ? 'on both feet' : '–')
    : steps > 2 ? 'beyond 2 steps' : `${steps} step${steps === 1 ? '' : 's'}`);
  const touchDown = run.find(FOOTSTEPS, 'touch_down[0]'), planned = run.find(FOOTSTEPS, 'planned');
  return [['capture point within', [run.find(FOOTSTEPS, 'stance'), run.find(DERIVED, 'capture_steps')], caught],
    ['next touch-down in', [planned, touchDown], ([count, time]) => (Number.isNaN(count) ? '–' : count > 0 ? quantity([time], 's', DIGITS, true) : 'none planned')]];
}

/** The events of a run; a click goes there, and what came last before the time cursor is marked. */
export class EventList {
  element = element('section', {class: 'events'});
  #buttons = [];  // [time, element]

  /** `run`: of several, which. */
  constructor(player, run) {
    Object.assign(this, {player, name: run ? ` of the ${run.called}` : ''});
    this.element.classList.toggle('second', run?.index > 0);
    player.addEventListener('time', () => this.#mark());
  }

  /** `until`: " up to 3 s" where more may come. */
  show(events, until = '') {
    this.#buttons = events.map((event) => [event.time, element('button', {type: 'button', title: event.detail, click: () => this.player.seek(event.time)},
      element('span', {class: 'number'}, `${event.time.toFixed(3)} s`), ' ',
      element('span', {class: event.name === 'fall' ? 'failed' : null}, event.name.replaceAll('_', ' ')),
      event.detail ? element('span', {class: 'text'}, ` ${event.detail}`) : '')]);
    this.element.hidden = events.length === 0;
    this.element.replaceChildren(element('h2', {}, `Events${this.name}${until}`),
      element('ol', {}, ...this.#buttons.map(([, button]) => element('li', {}, button))));
    this.#mark();
  }

  #mark() {
    const now = this.player.time + this.player.run.period / 2;
    const last = this.#buttons.findLast(([time]) => time <= now)?.[0];
    for (const [time, button] of this.#buttons) {
      if (time === last) button.setAttribute('aria-current', 'time');
      else button.removeAttribute('aria-current');
    }
  }
}

const TIME = /\b(at|since) (-?\d+(?:\.\d+)?) s\b/gi;

/** A story whose times, as far as the run has them, lead there. */
export function storyText(text, player) {
  const {run} = player, parts = [];
  let end = 0;
  for (const match of text.matchAll(TIME)) {
    const time = Number(match[2]);
    if (time < run.start || time > run.end + run.period) continue;
    const at = match.index + match[1].length + 1;
    parts.push(text.slice(end, at), element('button', {type: 'button', class: 'time-link', click: () => player.seek(time)}, `${match[2]} s`));
    end = at + match[2].length + 2;
  }
  return element('p', {class: 'story'}, ...parts, text.slice(end));
}
