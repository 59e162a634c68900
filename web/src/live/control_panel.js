// The panel of a page that may act: stop, walk, settings, push, and the pace of an interactive run.
import {endText, Undo} from './control.js';
import {button, element, icon, onKeys} from '../dom.js';
import {LAG_PERIOD, liveText} from '../bar.js';
import {formatNumber, withUnit} from '../units.js';

const STEPS = 200;  // of a slider
const SPEEDS = [0.1, 0.2, 0.5, 1];
const PUSH_SHARE = 0.2;     // of the largest force, first value of the push form
const PUSH_DURATION = 0.2;  // s, likewise
const MOVE_DURATION = 1;  // s, of the form that moves a joint
const DIRECTIONS = {forward: [1, 0, 0], backward: [-1, 0, 0], left: [0, 1, 0], right: [0, -1, 0], up: [0, 0, 1]};
const AXES = [['forward', 'm/s'], ['left', 'm/s'], ['turn', 'rad/s']];

/** Why this run cannot do an act; '' where it may. */
function obstacle(what, {standing}, run) {
  const {walk, recovery} = run.scenario.step_planner ?? {};
  if (standing.run?.ended) return 'the run has ended: go back, or start again';
  if (['walk', 'step'].includes(what) && !walk?.enabled) return 'needs a scenario with base: "base/walking"';
  if (what === 'stop_walking' && !walk?.enabled && !recovery?.enabled) {
    return 'needs a scenario with base: "base/walking" or step_planner.recovery.enabled=true';
  }
  return what === 'reset' && !standing.stopped ? 'nothing is stopped' : '';
}

/** Greys a control; `why` is what its title says then, '' lets it be used. */
function disable(control, why) {
  control.dataset.title ??= control.title;
  control.title = why || control.dataset.title;
  control.disabled = why !== '';
}

const select = (label, options, more = {}) =>
  element('select', {'aria-label': label, ...more}, ...options.map((option) => element('option', {}, option)));
const numberInput = (label, value, more = {}) =>
  element('input', {type: 'number', step: 'any', min: 0, 'aria-label': label, value, ...more});

/** {element, update}: a form that sends an act `what` with what `told()` says of it. */
function actForm(control, run, what, label, told, ...inputs) {
  const send = element('button', {id: what}, label);
  const form = element('form', {class: 'line', submit: (e) => {
    e.preventDefault();
    control.act(what, told());
  }}, ...inputs, send);
  return {element: form, update: () => disable(send, obstacle(what, control, run))};
}

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
    this.refused = element('p', {class: 'answer refused', 'aria-live': 'polite'});
    this.element = element('div', {class: 'setting', title: text},
      element('label', {}, element('span', {class: 'name'}, field), this.value), this.slider,
      element('p', {class: 'soft'}, `${text} `, element('span', {class: 'range'}, `[${formatNumber(low)}, ${formatNumber(high)}] ${unit}`), ' ', this.asked), this.refused);
  }

  #ask(value) {
    this.slider.value = value;
    this.control.act('set', {field: this.field, value});
    this.update();
  }

  update() {
    const setting = this.control.setting(this.field);
    if (!setting) return;
    this.value.textContent = withUnit(setting.value, setting.unit);
    const asked = this.control.waiting.findLast((act) => act.do === 'set' && act.field === this.field);
    this.asked.textContent = asked ? `asked: ${withUnit(asked.value, setting.unit)}` : '';
    const last = this.control.standing.acts.findLast((act) => act.do === 'set' && act.name === this.field);
    this.refused.textContent = !asked && last?.state === 'refused' ? `refused: ${last.reason}` : '';
    if (!asked) this.slider.value = setting.value;
  }
}

function pushForm(control, run) {
  const {push_limit: limit, push_longest: longest = 1} = control.standing;
  const body = select('Body', run.robot.bodies.map(({name}) => name));
  const direction = select('Direction', Object.keys(DIRECTIONS));
  const force = numberInput('Force, N', Math.round(PUSH_SHARE * limit), {max: limit});
  const duration = numberInput('Duration, s', PUSH_DURATION, {min: 0.002, max: longest});
  const told = () => ({body: body.value, point: [0, 0, 0], duration: Number(duration.value),
    force: DIRECTIONS[direction.value].map((x) => x * Number(force.value))});
  return actForm(control, run, 'push', 'Push', told, body, direction, force, 'N', duration, 's');
}

/** Sends a joint that no leg needs to an angle. */
function moveForm(control, run) {
  const joints = control.standing.movable;
  const joint = select('Joint', joints.map((j) => j.joint), {change: () => show()});
  const angle = numberInput('Angle, rad', 0);
  const duration = numberInput('Duration, s', MOVE_DURATION);
  const show = () => {
    const {low, high} = joints[joint.selectedIndex];
    Object.assign(angle, {min: low, max: high, title: `${formatNumber(low)} to ${formatNumber(high)} rad`});
    angle.value = Math.min(high, Math.max(low, Number(angle.value)));
  };
  show();
  const told = () => ({joint: joint.value, value: Number(angle.value), duration: Number(duration.value)});
  return actForm(control, run, 'move', 'Move', told, joint, angle, 'rad', duration, 's');
}

/** Pad, sliders and buttons of a walk, and single steps; what this run cannot do is grey, and says why. */
function walking(control, run) {
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
    pointerdown: (e) => {
      if (inputs[0].disabled) return;
      pad.setPointerCapture(e.pointerId);
      toward(e);
    },
    pointermove: (e) => { if (pad.hasPointerCapture(e.pointerId)) toward(e); }}, dot);
  const velocity = () => inputs.map((input) => Number(input.value));
  const show = () => {
    const v = velocity();
    v.forEach((x, i) => { values[i].textContent = `${x.toFixed(2)} ${AXES[i][1]}`; });
    dot.style.top = `${50 - 50 * v[0] / Math.max(high[0], -low[0], 1e-9)}%`;
    dot.style.left = `${50 - 50 * v[1] / Math.max(high[1], -low[1], 1e-9)}%`;
  };
  show();
  const walk = button('Walk', 'Walk with this velocity', () => control.act('walk', {velocity: velocity()}), {id: 'walk'});
  const stop = button('Stop walking', 'Stand, feet side by side', () => control.act('stop_walking'), {id: 'stop-walking'});
  const steps = run.robot.feet.map(({name}) => button(`step, ${name}`, `A step with the ${name} foot`, () => control.act('step', {foot: name})));
  const reason = element('p', {class: 'soft reason'});
  const place = element('details', {class: 'walking', open: !obstacle('walk', control, run)}, element('summary', {}, 'Walk and step'), reason,
    element('div', {class: 'walk'}, pad, element('div', {}, ...AXES.map(([name], i) => element('label', {}, name, inputs[i], values[i])))),
    element('div', {class: 'line'}, walk, stop, ...steps));
  return {element: place, update: () => {
    const why = obstacle('walk', control, run);
    reason.textContent = why && `not possible: ${why}`;
    for (const input of [...inputs, walk]) disable(input, why);
    pad.classList.toggle('off', why !== '');
    disable(stop, obstacle('stop_walking', control, run));
    for (const step of steps) disable(step, obstacle('step', control, run));
  }};
}

/** Pause, single tick, slow motion and back: of an interactive run. */
function pace(control, player, run) {
  const go = button('', '', () => control.act(control.standing.run.paused ? 'go' : 'pause'), {id: 'go'});
  const tick = button('one tick', 'Run one tick (.)', () => control.act('tick', {ticks: 1}), {id: 'one-tick'});
  const speed = element('select', {id: 'run-speed', 'aria-label': 'Speed of the run',
    change: () => control.act('speed', {value: Number(speed.value)})},
  ...SPEEDS.map((s) => element('option', {value: s}, `${s}×`)));
  const back = button('back to the cursor', 'Back to the tick at the time cursor, and on from there',
    () => control.act('back', {ticks: player.tick}), {id: 'back'});
  const again = button('start again', 'The run begins anew, with the settings that it began with, and goes on; what was is kept as a branch',
    () => control.act('restart'), {id: 'restart'});
  const state = element('output', {class: 'soft'});
  return {element: element('div', {class: 'line'}, go, tick, speed, back, again, state), update: () => {
    const {run: now} = control.standing;
    go.replaceChildren(icon(now.paused ? 'play' : 'pause'), now.paused ? ' go' : ' pause');
    go.dataset.title = now.paused ? 'The run goes on (p)' : 'The run waits (p)';
    for (const act of [go, tick]) disable(act, obstacle('go', control, run));
    speed.value = now.speed;
    back.disabled = again.disabled = !now.can_go_back || now.again >= 0;
    state.textContent = `${now.again >= 0 ? `made again, up to tick ${now.again}` : now.ended ? endText(now) : now.paused ? `waits at tick ${now.tick}`
      : `runs at ${now.speed}×`}${now.branch > 0 ? `, branch ${now.branch}` : ''}`;
  }};
}

function actText(act) {
  const what = {push: () => `push ${act.name}, ${formatNumber(Math.hypot(...act.force), 3)} N`, set: () => `${act.name} = ${formatNumber(act.value)}`,
    walk: () => `walk ${act.velocity.map((v) => formatNumber(v, 2)).join(', ')}`, step: () => `step, ${act.name}`,
    move: () => `${act.name} to ${formatNumber(act.value)} rad`,
    tick: () => `${act.ticks} tick`, speed: () => `speed ${act.value}×`, back: () => `back to tick ${act.ticks}`}[act.do];
  const state = {unsent: `not sent: no connection${act.do === 'stop' ? '; it will be as soon as there is one' : ''}`, sent: 'sent, no answer yet', accepted: act.tick === undefined ? 'done' : `from tick ${act.tick}`, refused: `refused: ${act.reason}`}[act.state];
  return [what ? what() : act.do.replaceAll('_', ' '), state];
}

/** Beside the buttons of some acts: what became of the last of them. */
function answer(control, kinds) {
  const place = element('p', {class: 'answer', 'aria-live': 'polite'});
  return {element: place, update: () => {
    const last = actsOf(control).findLast((act) => kinds.includes(act.do));
    place.textContent = last ? actText(last).join(' ') : '';
    place.className = `answer ${last?.state ?? ''}`;
  }};
}

/** All acts that are known of, the newest last; what could not be sent is one. */
function actsOf({standing, unsent}) {
  return [...standing.acts, ...(unsent ? [{...unsent, name: unsent.field ?? unsent.foot ?? unsent.joint ?? unsent.body, state: 'unsent'}] : [])];
}

/**
 * {element, settings, stop}: the panel, its settings, and the emergency stop, which appear when the server tells what may be done.
 * `shared`: as for the page's other parts.
 */
export function controlPanel(control, shared) {
  const {player, run, feed} = shared;
  const host = element('section', {id: 'control', hidden: true, 'aria-label': 'Control'});
  const settings = element('div', {}), stopHost = element('span', {class: 'stop'});
  const undo = new Undo(control);
  let update, tellLag;

  const build = () => {
    const {standing} = control;
    const rows = (standing.settings ?? []).map((setting) => new SettingRow(control, setting));
    const undoButton = button('undo', 'Take the last change back (u)', () => undo.undo(), {id: 'undo'});
    const limit = formatNumber(standing.push_limit, 3);
    const dragged = {element: element('p', {class: 'soft'}, `Drag the robot to push it, up to ${limit} N.`)};
    const parts = [
      [control.can('pause'), () => [pace(control, player, run)], ['pause', 'go', 'tick', 'speed', 'back', 'restart']],
      [control.can('push'), () => [dragged, pushForm(control, run)], ['push']],
      [control.can('move') && standing.movable?.length > 0, () => [moveForm(control, run)], ['move']],
      [control.can('walk'), () => [walking(control, run)], ['walk', 'stop_walking', 'step']],
    ].flatMap(([may, make, kinds]) => (may ? [...make(), answer(control, kinds)] : []));
    const estop = button('EMERGENCY STOP', 'The bridge stops the robot (e)', () => control.act('stop'), {id: 'estop'});
    const reset = button('reset', 'End a stop, when the motors are at rest', () => control.act('reset'), {id: 'reset'});
    const stopAnswer = answer(control, ['stop', 'reset']);
    const lag = element('p', {class: 'answer lag', role: 'status'});
    const acts = element('ol', {class: 'acts', 'aria-live': 'polite'});
    const filter = element('input', {type: 'search', placeholder: 'setting', 'aria-label': 'Search settings', input: () => {
      const words = filter.value.toLowerCase();
      for (const row of rows) row.element.hidden = !`${row.field} ${row.element.title}`.toLowerCase().includes(words);
    }});
    host.replaceChildren(element('h2', {}, 'Control'), lag, ...parts.map((part) => part.element), acts);
    settings.replaceChildren(...(rows.length > 0 ? [element('details', {class: 'settings', open: true}, element('summary', {}, `${rows.length} settings`),
      element('div', {class: 'line'}, filter, undoButton), ...rows.map((row) => row.element))] : []));
    stopHost.replaceChildren(control.can('stop') ? estop : '', control.can('reset') ? reset : '', stopAnswer.element);
    host.hidden = false;
    update = () => {
      for (const part of [...rows, ...parts, stopAnswer]) part.update?.();
      undoButton.disabled = !undo.next;
      undoButton.textContent = undo.next ? `undo ${undo.next.field}` : 'undo';
      disable(reset, obstacle('reset', control, run));
      acts.replaceChildren(...actsOf(control).slice(-6).reverse().map((act) => {
        const [what, state] = actText(act);
        return element('li', {class: act.state}, what, element('span', {class: 'text'}, ` ${state}`));
      }));
    };
    tellLag = () => {
      const [state, words] = liveText(feed);
      lag.textContent = state === 'behind' ? `The picture is ${words.replace(/^\W+/, '')}.` : '';
    };
  };
  setInterval(() => tellLag?.(), LAG_PERIOD);

  let built = '';
  control.addEventListener('change', () => {
    if (!control.standing) return;
    const kind = JSON.stringify([control.standing.can, (control.standing.settings ?? []).map((s) => s.field)]);
    if (kind !== built) build();
    built = kind;
    update();
  });
  control.addEventListener('change', () => onKeys({
    e: () => control.can('stop') && control.act('stop'), u: () => undo.undo(),
    p: () => control.can('pause') && control.act(control.standing.run.paused ? 'go' : 'pause'),
    '.': () => control.can('tick') && control.act('tick', {ticks: 1}),
  }), {once: true});  // a page that only looks has no such keys
  return {element: host, settings, stop: stopHost};
}

export const CONTROL_KEYS = [['e', 'emergency stop'], ['u', 'undo a setting'], ['p', 'pause, go on (interactive)'], ['.', 'run one tick (interactive)'],
  ['esc', 'let go of the robot']];
