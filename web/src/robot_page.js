// The page of `poise robot check`: a robot standing, with its frames, joint axes and soles, and what was found of it.
import {
  AmbientLight, AxesHelper, Box3, CircleGeometry, Color, DirectionalLight, Group, HemisphereLight, Mesh, MeshBasicMaterial,
  PerspectiveCamera, Quaternion, Scene, Vector3, WebGLRenderer,
} from 'three';
import {OrbitControls} from 'three/addons/controls/OrbitControls.js';
import {element, table} from './dom.js';
import {Arrow} from './markers.js';
import {NoPicture, has3D} from './no_picture.js';
import {isDark} from './palette.js';
import {RobotView} from './robot_view.js';
import {formatNumber} from './units.js';

const FRAME = 0.06;  // m, of a drawn frame's axes
const AXIS = 0.09;   // m, of a drawn joint axis
const VIEWS = {free: [0.75, -0.62, 0.28], front: [1, 0, 0.12], side: [0, -1, 0.12], top: [0, -0.001, 1]};

/** Three.js's picture of the robot in its stance; `show` switches what is drawn over it. */
class StillView {
  constructor(host, {robot, stance}) {
    this.host = host;
    this.renderer = new WebGLRenderer({antialias: true});
    this.renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    this.renderer.domElement.setAttribute('role', 'img');
    this.renderer.domElement.setAttribute('aria-label', 'The robot in 3D');
    host.append(this.renderer.domElement);
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(32, 1, 0.05, 60);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.addEventListener('change', () => this.draw());
    const sun = new DirectionalLight(0xffffff, 1.6);
    sun.position.set(2, -3, 5);
    this.ground = new Mesh(new CircleGeometry(3, 48), new MeshBasicMaterial({depthWrite: false}));
    this.ground.renderOrder = -1;
    this.view = new RobotView(robot);
    this.view.setPose(stance.base, stance.joints);
    this.layers = {frames: new Group(), axes: new Group()};
    this.#mark(robot);
    this.scene.add(new HemisphereLight(0xffffff, 0x8890a0, 1.6), new AmbientLight(0xffffff, 0.35), sun, this.ground,
      this.view.object, ...Object.values(this.layers));
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.setTheme());
    this.setTheme();
    new ResizeObserver(() => this.#resize()).observe(host);
    this.look('free');
  }

  /** A frame of each body, an arrow along each joint's axis. */
  #mark(robot) {
    this.view.object.updateMatrixWorld(true);
    const at = new Vector3(), turn = new Quaternion(), size = new Vector3();
    robot.bodies.forEach((body, b) => {
      this.view.groups[b].matrixWorld.decompose(at, turn, size);
      const frame = new AxesHelper(FRAME);
      frame.material.depthTest = false;
      frame.position.copy(at);
      frame.quaternion.copy(turn);
      this.layers.frames.add(frame);
      if (!body.axis) return;
      const axis = new Vector3(...body.axis).applyQuaternion(turn).multiplyScalar(AXIS);
      const arrow = new Arrow(0xa11fb0, 0.004);
      arrow.set(at.toArray(), axis.toArray());
      this.layers.axes.add(arrow.object);
    });
  }

  setTheme() {
    const dark = isDark();
    this.scene.background = new Color(dark ? 0x14171c : 0xeef1f5);
    this.ground.material.color.set(dark ? 0x1b1f26 : 0xe4e8ee);
    this.draw();
  }

  /** One of VIEWS, with the robot in the middle. */
  look(name) {
    const box = new Box3().setFromObject(this.view.object), size = box.getSize(new Vector3());
    box.getCenter(this.controls.target);
    const distance = 1.15 * Math.max(size.x, size.y, size.z) / 2 / Math.tan(this.camera.fov * Math.PI / 360);
    this.camera.position.set(...VIEWS[name]).normalize().multiplyScalar(distance + size.x / 2).add(this.controls.target);
    this.controls.update();
    this.draw();
  }

  show(name, on) {
    this.layers[name].visible = on;
    this.draw();
  }

  #resize() {
    const {clientWidth: width, clientHeight: height} = this.host;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  draw() { this.renderer.render(this.scene, this.camera); }
}

/** The soles from above, forwards up, to one scale. */
function solesPicture(soles) {
  const scale = 900, pad = 8;  // pixels a metre
  return element('div', {class: 'soles'}, ...[...soles].reverse().map((sole) => {
    const reach = (k) => Math.max(...sole.corners.map((c) => Math.abs(c[k])));
    const [height, width] = [2 * reach(0) * scale + 2 * pad, 2 * reach(1) * scale + 2 * pad];
    const points = sole.corners.map(([x, y]) => [width / 2 - y * scale, height / 2 - x * scale]);
    const canvas = element('canvas', {width: Math.ceil(width), height: Math.ceil(height), role: 'img',
      'aria-label': `The ${sole.foot} sole from above`});
    const context = canvas.getContext('2d');
    context.strokeStyle = context.fillStyle = isDark() ? '#9fb0c5' : '#5b6675';
    context.beginPath();
    points.forEach(([x, y], i) => (i ? context.lineTo(x, y) : context.moveTo(x, y)));
    context.closePath();
    context.lineWidth = 2;
    context.stroke();
    context.fillRect(width / 2 - 2, height / 2 - 2, 4, 4);  // the sole frame's origin
    return element('figure', {}, canvas, element('figcaption', {}, sole.foot));
  }));
}

const cm = (metres) => `${formatNumber(100 * metres, 3)} cm`;
const degrees = (angle) => `${formatNumber(angle * 180 / Math.PI, 3)}°`;

function tables(check) {
  const rows = [['mass', `${formatNumber(check.mass, 4)} kg`], ['joints', String(check.joints)],
    ['COM above the soles', cm(check.com_height)], ['ω', `${formatNumber(check.frequency, 3)} rad/s`],
    ['between the soles', cm(check.foot_spacing)],
    ...check.soles.map((s) => [`${s.foot} sole`, `${formatNumber(1e4 * s.area, 3)} cm², nearest edge ${cm(s.inner_radius)} from the origin`]),
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
  const box = (name, label) => element('label', {}, element('input', {type: 'checkbox', checked: true,
    change: (e) => still.show(name, e.target.checked)}), label);
  if (drawn3d) host.append(element('div', {class: 'toolbar'}, ...Object.keys(VIEWS).map((name) =>
    element('button', {type: 'button', click: () => still.look(name)}, name)), box('frames', 'frames'), box('axes', 'joint axes')));
  const [drawn, inFiles] = data.triangles;
  const notes = [data.drawn_instead, drawn < inFiles ? `Of the meshes' ${inFiles} triangles ${drawn} are drawn.` : ''].filter(Boolean);
  document.getElementById('side').append(element('h2', {}, 'Soles, from above'), solesPicture(check.soles),
    ...(notes.length > 0 ? [element('h2', {}, 'Picture'), element('p', {class: 'note', role: 'note'}, notes.join(' '))] : []),
    ...(good ? [] : [element('h2', {}, 'Defects'), element('ul', {}, ...check.defects.map((d) => element('li', {}, d)))]));
  document.getElementById('tables').append(...tables(check));
  document.getElementById('player').hidden = true;
  document.documentElement.dataset.ready = String(Math.round(performance.now()));
  window.poise = {still, data};
}
