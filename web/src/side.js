// What holds at the time cursor, and the events.
import {element} from './dom.js';
import {FOOTSTEPS, plannedSignals, regionsAt, stepsThatCatch} from './footsteps.js';
import {formatNumber, quantity} from './units.js';

const DIGITS = 3;

/** {element, load(), update(row)}. */
export class Readout {
  constructor(run) {
    this.run = run;
    this.cells = new Map();
    const row = (name) => {
      const cell = element('td', {class: 'number'});
      this.cells.set(name, cell);
      return element('tr', {}, element('th', {scope: 'row'}, name), cell);
    };
    this.rows = this.#rows();
    this.element = element('table', {class: 'readout'}, element('tbody', {}, ...this.rows.map(([name]) => row(name))));
  }

  /** [name, signals, text of their values] */
  #rows() {
    const {run} = this;
    const find = (type, field) => run.find(type, field);
    const derived = (name) => run.signals.get(`derived.${name}`);
    const named = (signal) => ([v]) => signal.valueNames?.[v] ?? formatNumber(v);
    const metres = (values) => quantity(values, 'm', DIGITS);
    const newton = (values) => quantity(values, 'N', DIGITS);
    const plan = find('support_plan_t', 'status');
    const status = find('task_torque_t', 'status');
    const bridge = find('bridge_status_t', 'state');
    const phase = find('support_plan_t', 'phase');
    const step = ['stepping', 'step_reason', 'step_foot'].map((field) => find('support_plan_t', field));
    const feet = run.robot.feet.map((foot) => foot.name);
    return [
      ['phase', [phase], ([i]) => run.scenario.step_planner?.phase?.[i]?.name ?? formatNumber(i)],
      ['plan', [plan], plan && named(plan)], ['controller', [status], status && named(status)], ['bridge', [bridge], bridge && named(bridge)],
      ['η', [find('joint_command_t', 'eta')], ([v]) => formatNumber(v, DIGITS)],
      ['CoP computed x, y', ['cop[0]', 'cop[1]'].map((f) => find('balance_torque_t', f)), metres],
      ['CoP measured x, y', [derived('cop_measured_x'), derived('cop_measured_y')], metres],
      ['COM error x, y, z', ['x', 'y', 'z'].map((a) => derived(`com_error_${a}`)), metres],
      ['push', [derived('push_magnitude')], newton],
      ['step', step, (v) => (v[0] > 0 ? `${feet[v[2]]}, ${step[0].valueNames[v[0]]}: ${step[1].valueNames[v[1]]}` : 'none')],
      ...this.#stepRows(),
      ...run.robot.feet.flatMap((foot) => ['measured', 'computed'].map((kind) =>
        [`${foot.name} load, ${kind}`, [derived(`${foot.name}_load_${kind}`)], newton])),
    ].filter(([, signals]) => signals.every(Boolean));
  }

  /** Of a run whose planner makes steps. */
  #stepRows() {
    const {run} = this;
    if (!run.find(FOOTSTEPS, 'stance')) return [];
    const names = Object.entries(plannedSignals());
    const capture = ['0', '1'].map((i) => run.find('support_plan_t', `capture_point[${i}]`));
    const caught = (values) => {
      const byName = new Map(names.map(([name], i) => [name, values[i]]));
      const regions = regionsAt({at: (name) => byName.get(name) ?? NaN}, 0);
      if (regions.every((region) => region.length === 0)) return 'on both feet';
      const steps = stepsThatCatch(regions, values.slice(names.length));
      return steps === undefined ? 'beyond 2 steps' : `${steps} step${steps === 1 ? '' : 's'}`;
    };
    const signals = names.map(([, [type, field]]) => run.find(type, field));
    const touchDown = run.find(FOOTSTEPS, 'touch_down[0]'), planned = run.find(FOOTSTEPS, 'planned');
    return [['capture point within', [...signals, ...capture], caught],
      ['next touch-down in', [planned, touchDown], ([count, time]) => (count > 0 ? quantity([time], 's', DIGITS) : 'none planned')]];
  }

  async load() { await Promise.all(this.rows.flatMap(([, signals]) => signals).map((s) => s.load())); }

  update(row) {
    for (const [name, signals, text] of this.rows) {
      this.cells.get(name).textContent = text(signals.map((s) => s.values?.[row] ?? NaN));
    }
  }
}

/** Events as a list; a click goes there. `until`: " up to 3 s" where more may come. */
export function eventList(events, player, until = '') {
  if (events.length === 0) return '';
  return element('section', {class: 'events'}, element('h2', {}, `Events${until}`), element('ol', {}, ...events.map((event) =>
    element('li', {}, element('button', {type: 'button', title: event.detail, click: () => player.seek(event.time)},
      element('span', {class: 'number'}, `${event.time.toFixed(3)} s`), ` ${event.name.replaceAll('_', ' ')}`,
      event.detail ? element('span', {class: 'text'}, ` ${event.detail}`) : '')))));
}
