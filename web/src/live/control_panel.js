// The panel of a page that may act: stop, walk, settings, push, and the pace of an interactive run.
import {Undo} from './control.js';
import {element} from '../dom.js';
import {formatNumber, withUnit} from '../units.js';

const STEPS = 200;  // of a slider
const SPEEDS = [0.1, 0.2, 0.5, 1];
const PUSH_SHARE = 0.2;     // of the largest force, first value of the push form
const PUSH_DURATION = 0.2;  // s, likewise
const DIRECTIONS = {forward: [1, 0, 0], backward: [-1, 0, 0], left: [0, 1, 0], right: [0, -1, 0], up: [0, 0, 1]};
const AXES = [['forward', 'm/s'], ['left', 'm/s'], ['turn', 'rad/s']];

const button = (text, title, click, more = {}) => element('button', {type: 'button', title, click, ...more}, text);

function valueText({value, unit}) { return withUnit(value, unit); }

/** One setting: its slider asks, its value is what is in force. */
class SettingRow {
  constructor(control, {field, unit, text, low, high, whole}) {
    Object.assign(this, {control, field});
    const step = whole ? 1 : (high - low) / STEPS;
    this.slider = element('input', {type: 'range', min: low, max: high, step: whole ? 1 : 'any', 'aria-label': `${field}, ${unit}`,
      change: () => this.#ask(Number(this.slider.value)),
      keydown: (e) => {
        const by = {ArrowLeft: -step, ArrowDown: -step, ArrowRight: step, ArrowUp: step}[e.key];
        if (by === undefined) return;
        e.preventDefault();
        e.stopPropagation();  // the page's own keys step in time
        this.#ask(Math.min(high, Math.max(low, Number(this.slider.value) + by)));
      }});
    this.value = element('output', {class: 'number'});
    this.asked = element('span', {class: 'soft'});
    this.element = element('div', {class: 'setting', title: text},
      element('label', {}, element('span', {class: 'name'}, field), this.value), this.slider,
      element('p', {class: 'soft'}, `${text} `, element('span', {class: 'range'}, `[${formatNumber(low)}, ${formatNumber(high)}] ${unit}`), ' ', this.asked));
  }

  #ask(value) {
    this.slider.value = value;
    this.control.act('set', {field: this.field, value});
    this.update();
  }

  update() {
    const setting = this.control.setting(this.field);
    if (!setting) return;
    this.value.textContent = valueText(setting);
    const asked = this.control.waiting.findLast((act) => act.do === 'set' && act.field === this.field);
    this.asked.textContent = asked ? `asked: ${withUnit(asked.value, setting.unit)}` : '';
    if (!asked && document.activeElement !== this.slider) this.slider.value = setting.value;
    else if (!asked) this.slider.value = setting.value;
  }
}

function pushForm(control, robot) {
  const body = element('select', {'aria-label': 'Body'}, ...robot.bodies.map(({name}) => element('option', {value: name}, name)));
  const direction = element('select', {'aria-label': 'Direction'}, ...Object.keys(DIRECTIONS).map((name) => element('option', {}, name)));
  const force = element('input', {type: 'number', min: 0, max: control.standing.push_limit, step: 'any', 'aria-label': 'Force, N',
    value: Math.round(PUSH_SHARE * control.standing.push_limit)});
  const duration = element('input', {type: 'number', min: 0.002, max: control.standing.push_longest ?? 1, step: 'any',
    'aria-label': 'Duration, s', value: PUSH_DURATION});
  return element('form', {class: 'line', submit: (e) => {
    e.preventDefault();
    control.act('push', {body: body.value, point: [0, 0, 0], duration: Number(duration.value),
      force: DIRECTIONS[direction.value].map((x) => x * Number(force.value))});
  }}, body, direction, force, 'N', duration, 's', element('button', {id: 'push'}, 'Push'));
}

function walkPad(control) {
  const {low, high} = control.standing.walk;
  const inputs = AXES.map(([name, unit], i) => element('input', {type: 'range', min: low[i], max: high[i], step: 'any', value: 0,
    'aria-label': `${name}, ${unit}`, input: () => show(), keydown: (e) => e.stopPropagation()}));
  const values = AXES.map(() => element('output', {class: 'number'}));
  const dot = element('span', {class: 'dot'});
  const toward = (e) => {
    const box = pad.getBoundingClientRect();
    const share = [1 - 2 * (e.clientY - box.top) / box.height, 1 - 2 * (e.clientX - box.left) / box.width];
    share.forEach((s, i) => { inputs[i].value = s >= 0 ? Math.min(1, s) * high[i] : Math.max(-1, s) * -low[i]; });
    show();
  };
  const pad = element('div', {class: 'pad', title: 'velocity: up is forward', 'aria-hidden': 'true',
    pointerdown: (e) => { pad.setPointerCapture(e.pointerId); toward(e); },
    pointermove: (e) => { if (pad.hasPointerCapture(e.pointerId)) toward(e); }}, dot);
  const velocity = () => inputs.map((input) => Number(input.value));
  const show = () => {
    const v = velocity();
    v.forEach((x, i) => { values[i].textContent = `${x.toFixed(2)} ${AXES[i][1]}`; });
    dot.style.top = `${50 - 50 * v[0] / Math.max(high[0], -low[0], 1e-9)}%`;
    dot.style.left = `${50 - 50 * v[1] / Math.max(high[1], -low[1], 1e-9)}%`;
  };
  show();
  return element('div', {class: 'walk'}, pad, element('div', {}, ...AXES.map(([name], i) =>
    element('label', {}, name, inputs[i], values[i])),
  element('div', {class: 'line'}, button('Walk', 'Walk with this velocity', () => control.act('walk', {velocity: velocity()}), {id: 'walk'}),
    button('Stop walking', 'Stand, feet side by side', () => control.act('stop_walking'), {id: 'stop-walking'}))));
}

/** Pause, single tick, slow motion and back: of an interactive run. */
function pace(control, player) {
  const go = button('', '', () => control.act(control.standing.run.paused ? 'go' : 'pause'), {id: 'go'});
  const tick = button('one tick', 'Run one tick (.)', () => control.act('tick', {ticks: 1}), {id: 'one-tick'});
  const speed = element('select', {id: 'run-speed', 'aria-label': 'Speed of the run', change: () => {
    control.act('speed', {value: Number(speed.value)});
  }}, ...SPEEDS.map((s) => element('option', {value: s}, `${s}×`)));
  const back = button('back to the cursor', 'Back to the tick at the time cursor, and on from there',
    () => control.act('back', {ticks: player.tick}), {id: 'back'});
  const again = button('start again', 'The run begins anew, with the settings that it began with, and goes on; what was is kept as a branch',
    () => control.act('restart'), {id: 'restart'});
  const state = element('output', {class: 'soft'});
  return {element: element('div', {class: 'line'}, go, tick, speed, back, again, state), update: () => {
    const {run} = control.standing;
    go.textContent = run.paused ? '▶ go' : '⏸ pause';
    go.title = run.paused ? 'The run goes on (p)' : 'The run waits (p)';
    speed.value = run.speed;
    back.disabled = again.disabled = !run.can_go_back;
    state.textContent = `${run.ended ? `ended: ${run.detail}` : run.paused ? `waits at tick ${run.tick}` : `runs at ${run.speed}×`}${run.branch > 0 ? `, branch ${run.branch}` : ''}`;
  }};
}

function actText(act) {
  const what = {push: () => `push ${act.name}, ${formatNumber(Math.hypot(...act.force), 3)} N`, set: () => `${act.name} = ${formatNumber(act.value)}`,
    walk: () => `walk ${act.velocity.map((v) => formatNumber(v, 2)).join(', ')}`, step: () => `step, ${act.name}`,
    tick: () => `${act.ticks} tick`, speed: () => `speed ${act.value}×`, back: () => `back to tick ${act.ticks}`}[act.do];
  const state = {unsent: `not sent: no connection${act.do === 'stop' ? '; it will be as soon as there is one' : ''}`, sent: 'sent, no answer yet', accepted: act.tick === undefined ? 'done' : `from tick ${act.tick}`, refused: `refused: ${act.reason}`}[act.state];
  return [what ? what() : act.do.replaceAll('_', ' '), state];
}

/** The panel's element, which appears when the server tells what may be done. `shared`: as for the page's other parts. */
export function controlPanel(control, shared) {
  const {player, run} = shared;
  const host = element('section', {id: 'control', hidden: true, 'aria-label': 'Control'});
  const undo = new Undo(control);
  let update;

  const build = () => {
    const {standing} = control;
    const rows = (standing.settings ?? []).map((setting) => new SettingRow(control, setting));
    const undoButton = button('undo', 'Take the last change back (u)', () => undo.undo(), {id: 'undo'});
    const tempo = control.can('pause') ? pace(control, player) : undefined;
    const acts = element('ol', {class: 'acts', 'aria-live': 'polite'});
    const filter = element('input', {type: 'search', placeholder: 'setting', 'aria-label': 'Search settings', input: () => {
      const words = filter.value.toLowerCase();
      for (const row of rows) row.element.hidden = !`${row.field} ${row.element.title}`.toLowerCase().includes(words);
    }});
    const parts = [
      element('h2', {}, 'Control'),
      element('div', {class: 'line'},
        control.can('stop') ? button('EMERGENCY STOP', 'The bridge stops the robot (e)', () => control.act('stop'), {id: 'estop'}) : '',
        control.can('reset') ? button('reset', 'End a stop, when the motors are at rest', () => control.act('reset'), {id: 'reset'}) : ''),
      tempo?.element,
      control.can('push') ? element('p', {class: 'soft'}, `Drag the robot to push it, up to ${formatNumber(standing.push_limit, 3)} N.`) : '',
      control.can('push') ? pushForm(control, run.robot) : '',
      control.can('walk') ? walkPad(control) : '',
      control.can('step') ? element('div', {class: 'line'}, ...run.robot.feet.map(({name}) =>
        button(`step, ${name}`, `A step with the ${name} foot`, () => control.act('step', {foot: name})))) : '',
      rows.length > 0 ? element('details', {class: 'settings', open: true}, element('summary', {}, `${rows.length} settings`),
        element('div', {class: 'line'}, filter, undoButton), ...rows.map((row) => row.element)) : '',
      acts,
    ];
    host.replaceChildren(...parts.filter(Boolean));
    host.hidden = false;
    update = () => {
      for (const row of rows) row.update();
      tempo?.update();
      undoButton.disabled = !undo.next;
      undoButton.textContent = undo.next ? `undo ${undo.next.field}` : 'undo';
      const unsent = control.unsent ? [{...control.unsent, name: control.unsent.field ?? control.unsent.foot ?? control.unsent.body, state: 'unsent'}] : [];
      acts.replaceChildren(...[...control.standing.acts.slice(-6), ...unsent].reverse().map((act) => {
        const [what, state] = actText(act);
        return element('li', {class: act.state}, what, element('span', {class: 'text'}, ` ${state}`));
      }));
    };
  };

  let built = '';
  control.addEventListener('change', () => {
    if (!control.standing) return;
    const kind = JSON.stringify([control.standing.can, (control.standing.settings ?? []).map((s) => s.field)]);
    if (kind !== built) build();
    built = kind;
    update();
  });
  const keys = {
    e: () => control.can('stop') && control.act('stop'), u: () => undo.undo(),
    p: () => control.can('pause') && control.act(control.standing.run.paused ? 'go' : 'pause'),
    '.': () => control.can('tick') && control.act('tick', {ticks: 1}),
  };
  document.addEventListener('keydown', (e) => {
    const writing = e.target.matches('input:not([type=range], [type=checkbox]), select, textarea');
    if (!control.standing || writing || e.ctrlKey || e.metaKey || e.altKey || !Object.hasOwn(keys, e.key)) return;
    e.preventDefault();
    keys[e.key]();
  });
  return host;
}

export const CONTROL_KEYS = [['e', 'emergency stop'], ['u', 'undo a setting'], ['p', 'pause, go on (interactive)'], ['.', 'run one tick (interactive)'],
  ['esc', 'let go of the robot']];
