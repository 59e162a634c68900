// A robot in 3D: what the picture of a run and that of a robot's check share.
import {
  AmbientLight, Box3, CircleGeometry, Color, DirectionalLight, Fog, HemisphereLight, LineBasicMaterial, LineSegments, Mesh,
  MeshBasicMaterial, PerspectiveCamera, Scene, Vector3, WebGLRenderer,
} from 'three';
import {OrbitControls} from 'three/addons/controls/OrbitControls.js';
import {button, element, saveNamed} from '../dom.js';
import {isDark, onThemeChange} from '../palette.js';
import {RobotView} from '../robot_view.js';
import {geometryOf} from './markers.js';

const FILL = 1.22;  // of the picture's height that the robot may take, as its inverse
const FINEST = Math.min(2, globalThis.devicePixelRatio);  // pixels of the picture per CSS pixel
const SAVED = 2;        // likewise, of a saved picture, at least
const GROUND = 6;       // m, across
export const GRID = 0.1;  // m
export const PIECE = 5;   // squares
const FOG = [1.2, 4];   // m behind the robot, where the ground begins to fade and where it ends: no edge is its horizon
const VIEWS = {free: [0.75, -0.62, 0.28], front: [1, 0, 0.12], side: [0, -1, 0.12], top: [0, -0.001, 1]};

/** Squares of GRID on the ground, of short pieces: software renderers drop lines that reach behind the camera. */
function gridGeometry() {
  const n = Math.round(GROUND / GRID / 2);
  const points = [];
  for (let i = -n; i <= n; ++i) {
    for (let k = -n; k < n; k += PIECE) {
      points.push(i * GRID, k * GRID, 0, i * GRID, (k + PIECE) * GRID, 0, k * GRID, i * GRID, 0, (k + PIECE) * GRID, i * GRID, 0);
    }
  }
  return geometryOf(points);
}

export class View3D {
  finest = FINEST;
  #ratio = 0;
  #waiting = false;

  /** `host` is the element to fill. Whoever derives from this adds what else is drawn, and calls start(). */
  constructor(host, robot) {
    this.host = host;
    this.renderer = new WebGLRenderer({antialias: true});
    this.canvas = this.renderer.domElement;
    this.canvas.setAttribute('role', 'img');
    this.canvas.setAttribute('aria-label', 'The robot in 3D');
    host.append(this.canvas);
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(32, 1, 0.05, 60);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.addEventListener('change', () => this.draw());
    const sun = new DirectionalLight(0xffffff, 1.6);
    sun.position.set(2, -3, 5);
    // Drawn first and without depth, so that nothing that lies on it flickers.
    this.ground = new Mesh(new CircleGeometry(2 * GROUND, 48), new MeshBasicMaterial({depthWrite: false}));
    this.ground.renderOrder = -2;
    this.grid = new LineSegments(gridGeometry(), new LineBasicMaterial({depthWrite: false, depthTest: false}));
    this.grid.renderOrder = -1;
    this.scene.fog = new Fog(0);
    this.robotView = new RobotView(robot);
    this.scene.add(new HemisphereLight(0xffffff, 0x8890a0, 1.6), new AmbientLight(0xffffff, 0.35), sun, this.ground, this.grid, this.robotView.object);
  }

  start() {
    this.setRatio(FINEST);
    this.setTheme();
    this.look('free');
    new ResizeObserver(() => this.#resize()).observe(this.host);
    onThemeChange(() => this.setTheme());
  }

  setTheme() {
    const dark = isDark();
    this.scene.background = this.scene.fog.color = new Color(dark ? 0x14171c : 0xeef1f5);
    this.ground.material.color.set(dark ? 0x1b1f26 : 0xe4e8ee);
    this.grid.material.color.set(dark ? 0x333b47 : 0xc3cbd6);
    this.draw();
  }

  /** One of VIEWS, with the robot in the middle. */
  look(name) {
    const box = new Box3().setFromObject(this.robotView.object), size = box.getSize(new Vector3());
    box.getCenter(this.controls.target);
    const distance = FILL * Math.max(size.x, size.y, size.z) / 2 / Math.tan(this.camera.fov * Math.PI / 360);
    this.camera.position.set(...VIEWS[name]).normalize().multiplyScalar(distance + size.x / 2).add(this.controls.target);
    this.controls.update();
    this.draw();
  }

  /** A button for each of VIEWS, and `more`. */
  toolbar(...more) {
    const looks = Object.keys(VIEWS).map((name) => button(name, null, () => this.look(name)));
    return element('div', {class: 'toolbar'}, ...looks, ...more);
  }

  /** Saves the picture as a file called `name()`. */
  pngButton(name) {
    return button('PNG', 'Save the picture as PNG', () => this.png().then((blob) => saveNamed(name(), 'png', blob)));
  }

  #resize() {
    const {clientWidth: width, clientHeight: height} = this.host;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.renderNow();
  }

  /** Pixels of the picture per CSS pixel. */
  get ratio() { return this.#ratio; }
  setRatio(ratio) {
    if (ratio === this.#ratio) return;
    this.#ratio = ratio;
    this.renderer.setPixelRatio(ratio);
    this.draw();
  }

  /** In the next frame, once. */
  draw() {
    if (this.#waiting) return;
    this.#waiting = true;
    requestAnimationFrame(() => {
      this.#waiting = false;
      this.renderNow();
    });
  }

  /** At once. */
  renderNow() {
    const away = this.camera.position.distanceTo(this.controls.target);
    [this.scene.fog.near, this.scene.fog.far] = FOG.map((behind) => away + behind);
    this.renderer.render(this.scene, this.camera);
  }

  /** What `take` makes of the canvas, with as many pixels as a saved picture has. */
  #saved(take) {
    const ratio = this.#ratio;
    this.setRatio(Math.max(SAVED, ratio));
    this.renderNow();
    const result = take(this.canvas);
    this.setRatio(ratio);
    return result;
  }

  /** The picture as it is, as the address of an image, and as a file. */
  imageUrl() { return this.#saved((canvas) => canvas.toDataURL()); }
  png() { return this.#saved((canvas) => new Promise((done) => canvas.toBlob(done, 'image/png'))); }
}
