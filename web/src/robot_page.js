// The page of `poise robot check`: a robot standing, with its frames, joint axes and soles, and what was found of it.
import {AxesHelper, Group, Vector3} from 'three';
import {checkbox, element, shape, table} from './dom.js';
import {Arrow, Label, Outline, mark} from './picture/markers.js';
import {NoPicture, has3D} from './no_picture.js';
import {isDark} from './palette.js';
import {FOOT_COLORS, place} from './robot_view.js';
import {formatNumber} from './units.js';
import {View3D} from './picture/view3d.js';

const FRAME = 0.06;  // m, of a drawn frame's axes
const AXIS = 0.09;   // m, of a drawn joint axis
const CORNER = 0.006;  // m, of a drawn corner's dot
const BESIDE = 0.26;  // m from a sole's middle outwards, where its size stands

const mm = (metres) => formatNumber(Math.round(1e4 * metres) / 10);

/** "220 × 110 mm": how long and how wide a sole is at the most. */
function sizeOf(corners) {
  const [length, width] = [0, 1].map((k) => Math.max(...corners.map((c) => c[k])) - Math.min(...corners.map((c) => c[k])));
  return `${mm(length)} × ${mm(width)} mm`;
}

/** The robot in its stance; `show` switches what is drawn over it. */
class StillView extends View3D {
  constructor(host, {robot, stance}) {
    super(host, robot);
    this.robotView.setPose(stance.base, stance.joints);
    this.layers = {frames: new Group(), axes: new Group(), soles: new Group()};
    this.#mark(robot);
    this.scene.add(...Object.values(this.layers));
    this.start();
  }

  /** A frame of each body, an arrow along each joint's axis, each sole with its corners and size. */
  #mark(robot) {
    this.robotView.object.updateMatrixWorld(true);
    robot.bodies.forEach((body, b) => {
      const {matrixWorld} = this.robotView.groups[b];
      const frame = new AxesHelper(FRAME);
      frame.material.depthTest = false;
      frame.applyMatrix4(matrixWorld);
      this.layers.frames.add(frame);
      if (!body.axis) return;
      const axis = new Vector3(...body.axis).transformDirection(matrixWorld).multiplyScalar(AXIS);
      const arrow = new Arrow(0xa11fb0, 0.004);
      arrow.set(frame.position.toArray(), axis.toArray());
      this.layers.axes.add(arrow.object);
    });
    this.labels = robot.feet.map(({body, sole, corners}, f) => {
      const drawn = new Group(), outline = new Outline(FOOT_COLORS[f], corners.length), label = new Label(220, 0.0018);
      outline.set(corners.map(([x, y]) => [x, y, 0]));
      drawn.add(outline.object, ...corners.map(([x, y]) => {
        const dot = mark('disc', FOOT_COLORS[f], CORNER);
        dot.position.set(x, y, 0);
        return dot;
      }));
      const holder = new Group();
      holder.applyMatrix4(this.robotView.groups[body].matrixWorld);
      place(drawn, sole);
      holder.add(drawn);
      this.layers.soles.add(holder, label.object);
      holder.updateMatrixWorld(true);
      const at = drawn.localToWorld(new Vector3());
      return {label, text: sizeOf(corners), at: at.setY(at.y + Math.sign(at.y) * BESIDE).toArray()};
    });
  }

  setTheme() {
    for (const {label, text, at} of this.labels) label.set(text, at, isDark());
    super.setTheme();
  }

  show(name, on) {
    this.layers[name].visible = on;
    this.draw();
  }
}

const MARGIN = 50;  // mm about a drawn sole, where its corners' numbers stand
const APART = 11;   // mm between two of these numbers

/** A sole from above, forwards up, with the place of each corner about the sole frame's origin, mm. */
function solePicture({foot, corners, guessed}) {
  const points = corners.map(([x, y]) => [-1e3 * y, -1e3 * x]);
  const [left, top, right, bottom] = [Math.min, Math.max].flatMap((most) => [0, 1].map((k) => most(0, ...points.map((p) => p[k]))));
  const taken = [];
  const numbers = points.map(([x, y], i) => {
    const at = [x + 5 * Math.sign(x), y + (y < (top + bottom) / 2 ? -4 : 11)];
    if (taken.some(([u, v]) => Math.abs(v - at[1]) < APART && u * at[0] > 0)) return '';
    taken.push(at);
    return shape('text', {x: at[0], y: at[1], 'text-anchor': x < 0 ? 'end' : 'start'}, corners[i].map(mm).join(', '));
  });
  return element('figure', {}, shape('svg', {viewBox: [left - MARGIN, top - 18, right - left + 2 * MARGIN, bottom - top + 36].join(' '), role: 'img',
    'aria-label': `The ${foot} sole from above, ${sizeOf(corners)}`},
  shape('polygon', {points: points.join(' ')}), shape('path', {d: 'M-6 0H6M0 -6V6'}),
  ...points.map(([cx, cy], i) => shape('circle', {cx, cy, r: 2}, shape('title', {}, `${corners[i].map(mm).join(', ')} mm`))), ...numbers),
  element('figcaption', {}, `${foot}, ${sizeOf(corners)}${guessed ? ': a guess' : ''}`));
}

const cm = (metres) => `${formatNumber(100 * metres, 3)} cm`;
const degrees = (angle) => `${formatNumber(angle * 180 / Math.PI, 3)}°`;

function tables(check) {
  const rows = [['mass', `${formatNumber(check.mass, 4)} kg`], ['joints', String(check.joints)],
    ['COM above the soles', cm(check.com_height)], ['ω', `${formatNumber(check.frequency, 3)} rad/s`],
    ['between the soles', cm(check.foot_spacing)],
    ...check.soles.map((s) => [`${s.foot} sole`, `${sizeOf(s.corners)}, ${formatNumber(1e4 * s.area, 3)} cm², nearest edge ${cm(s.inner_radius)} from the origin${s.guessed ? ': a guess' : ''}`]),
    ...Object.entries({forward: 'forwards', back: 'back', outward: 'outwards', up: 'up'})
      .map(([key, name]) => [`left foot reaches ${name}`, cm(check.reach[key])]),
    ['gears', check.gear_stiffness > 0 ? `${formatNumber(check.gear_stiffness, 3)} N·m/rad` : 'rigid'],
    ['readings are old', `${formatNumber(1e3 * check.sensor_delay, 3)} ms`]];
  const share = (torque, {limit}) => torque === null ? '–' : element('span', {class: torque > limit ? 'failed' : null},
    `${formatNumber(torque, 3)} (${formatNumber(100 * torque / limit, 2)} %)`);
  return [table('The robot', ['what', 'value'], rows),
    table('Torque, N·m', ['joint', 'both feet', 'one foot', 'a step', 'rated', 'limit'], check.torque.map((t) =>
      [t.joint, share(t.double_support, t), share(t.single_support, t), share(t.step, t), formatNumber(t.rated, 3), formatNumber(t.limit, 3)]),
    {numbers: [1, 2, 3, 4, 5]}),
    table('Largest push by the bound m ω d, N·s', ['direction', 'both feet', 'right foot', 'left foot'], check.push.map((p) =>
      [degrees(p.direction), ...[p.double_support, p.right_foot, p.left_foot].map((v) => formatNumber(v, 3))]),
    {numbers: [0, 1, 2, 3]})];
}

/** Fills the page with `data`: {robot, stance, check, drawn_instead, triangles}. */
export function robotPage(data) {
  const {check} = data;
  document.title = `${check.name} – Poise`;
  const good = check.defects.length === 0;
  document.getElementById('header').append(element('h1', {}, check.name), element('p', {}, 'A robot, from its files alone'),
    element('span', {class: `badge ${good ? 'ok' : 'failed'}`}, good ? 'no defect was found' : `${check.defects.length} defects`));
  const drawn3d = has3D(), host = document.getElementById('scene');
  const still = drawn3d ? new StillView(host, data) : new NoPicture(host);
  const box = (name, label) => checkbox(label, true, (on) => still.show(name, on));
  if (drawn3d) {
    host.append(still.toolbar(box('frames', 'frames'), box('axes', 'joint axes'), box('soles', 'soles'),
      still.pngButton(() => check.name)));
  }
  const [drawn, inFiles] = data.triangles;
  const notes = [data.drawn_instead, drawn < inFiles ? `Of the meshes' ${inFiles} triangles ${drawn} are drawn.` : ''].filter(Boolean);
  document.getElementById('side').append(element('h2', {}, 'Soles from above: corners x, y in mm'),
    element('div', {class: 'soles'}, ...[...check.soles].reverse().map(solePicture)),
    ...(notes.length > 0 ? [element('h2', {}, 'Picture'), element('p', {class: 'note', role: 'note'}, notes.join(' '))] : []),
    ...(good ? [] : [element('h2', {}, 'Defects'), element('ul', {}, ...check.defects.map((d) => element('li', {}, d)))]));
  document.getElementById('tables').append(...tables(check));
  document.getElementById('player').hidden = true;
  document.documentElement.dataset.ready = String(Math.round(performance.now()));
  window.poise = {still, data};
}
