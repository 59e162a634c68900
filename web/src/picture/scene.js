// The robot in 3D with contact wrenches, centre of pressure and push; from above in the corner.
import {Color, Group, Mesh, MeshBasicMaterial, OrthographicCamera, SphereGeometry, Vector3} from 'three';
import {CraneView} from './crane.js';
import {DERIVED} from '../figures.js';
import {element} from '../dom.js';
import {GroundBlocks} from './ground.js';
import {Arrow, Block, mark, Outline} from './markers.js';
import {RobotView, place} from '../robot_view.js';
import {colorNow, isDark} from '../palette.js';
import {Samples, pose, vector} from '../samples.js';
import {blockRise, convexHull, rotate, transform} from '../spatial.js';
import {StepsView} from '../steps_view.js';
import {GRID, PIECE, View3D} from './view3d.js';

const METRES_PER_NEWTON = 1 / 900;
const METRES_PER_NEWTON_METRE = 1 / 100;
const LEAST_PUSH = 3;  // N: below it the sensor's noise
const INSET = 0.34;    // of the picture's smaller side
const ABOVE = 0.26;    // m, half of what the view from above shows, at least
const ABOVE_STEP = 0.1;  // m
const COARSEST = 0.5;
const SLOW_FRAME = 22;      // ms
const FRAME_SHARE = 0.1;    // of a new frame in the mean
const LONGEST_PAUSE = 500;  // ms; what took longer was no frame
const REGION_CORNERS = 16;  // of a message, at the most
const GROUND_LAYER = 1;  // what the view from above shows
const FOLLOW = 0.15;     // m that the robot goes from the middle before the view goes with it
const CLIMB = 0.4;       // m likewise, up or down

/** True motion when the run has it, else the estimated one. */
function motionSignals(run) {
  const type = run.find('ground_truth_t', 'base_position[0]') ? 'ground_truth_t' : 'robot_state_t';
  return {...vector('base.position', type, 'base_position'),
    ...vector('base.orientation', type, 'base_orientation', 4),
    ...vector('joint', type, 'joint_position', run.robot.joints.length),
    ...vector('crane', 'ground_truth_t', 'crane_point'), ...vector('crane_force', 'ground_truth_t', 'crane_force'),
    crane_share: ['ground_truth_t', 'crane_share'],
    ...(type === 'ground_truth_t' ? vector('com', type, 'com_position')
      : vector('com', 'planner_status_t', 'com_position'))};
}

const wrench = (kind, f, type) => ({...vector(`${kind}${f}.force`, type, `foot_wrench[${f}].force`),
  ...vector(`${kind}${f}.moment`, type, `foot_wrench[${f}].moment`),
  ...vector(`${kind}${f}.cop`, DERIVED, `foot[${f}].cop_${kind}`, 2)});

function contactSignals(run) {
  const truth = run.find('ground_truth_t', 'foot_pose[0].position[0]');
  return Object.assign({}, ...run.robot.feet.map((_, f) => ({
    ...pose(`sole${f}`, truth ? 'ground_truth_t' : 'planner_status_t', `foot_pose[${f}]`),
    ...wrench('measured', f, 'robot_state_t'), ...wrench('computed', f, 'joint_command_t'),
    [`contact${f}`]: ['support_plan_t', `in_contact[${f}]`],
  })), pose('frame', 'balance_torque_t', 'frame_o'), vector('cop', 'balance_torque_t', 'cop', 2),
  vector('corner_x', 'balance_torque_t', 'corner_x', REGION_CORNERS),
  vector('corner_y', 'balance_torque_t', 'corner_y', REGION_CORNERS),
  vector('capture', 'planner_status_t', 'capture_point'), vector('step', 'planner_status_t', 'step_position'),
  vector('push', 'external_push_t', 'force'), {pushed: [DERIVED, 'push_magnitude']},
  vector('point', 'external_push_t', 'point'), {
    ...vector('measured_cop', DERIVED, 'cop_measured_place'), ...vector('desired_cop', DERIVED, 'cop_desired', 2),
    num_corners: ['balance_torque_t', 'num_corners'], step_needed: ['planner_status_t', 'step_needed'],
    active_x: ['balance_torque_t', 'active_x'], active_y: ['balance_torque_t', 'active_y']});
}

export class SceneView extends View3D {
  /** `host` is the element to fill; `others` runs that are drawn as ghosts. */
  constructor(host, run, others) {
    super(host, run.robot);
    this.run = run;
    this.ghosts = others.map((other) => ({run: other, samples: new Samples(), view: new RobotView(other.robot, {ghost: true})}));
    this.samples = new Samples();
    this.row = 0;
    this.visible = true;
    this.show = {forces: true, moments: false, pressure: true, com: true, steps: true};
    this.note = element('p', {class: 'stale', role: 'status', hidden: true});
    host.append(this.note);
    this.above = new OrthographicCamera(-ABOVE, ABOVE, ABOVE, -ABOVE, 0.01, 20);
    this.above.up.set(1, 0, 0);  // forward is up
    this.above.layers.set(GROUND_LAYER);
    this.#build();
    this.start();
  }

  async load() {
    await Promise.all([
      this.samples.load(this.run, {...motionSignals(this.run), ...contactSignals(this.run)}),
      this.steps.load(),
      ...this.ghosts.map(({run, samples}) => samples.load(run, motionSignals(run))),
    ]);
    this.setRow(this.run.meta.live ? this.run.numRows - 1 : 0);
  }

  #build() {
    const {scene} = this;
    for (const {view} of this.ghosts) scene.add(view.object);
    const block = this.run.scenario.sim?.block;
    if (block) {
      this.block = new Block(block);
      scene.add(this.block.object);
    }
    if (this.run.meta.ground?.length) {
      this.blocks = new GroundBlocks(this.run.meta.ground);
      scene.add(this.blocks.object);
    }
    this.colored = [];  // [material, role]
    const colored = (object, name) => {
      this.colored.push([object.material, name]);
      return object;
    };
    const flat = (kind, name, size) => colored(mark(kind, 0, size), name);
    const arrow = (name, radius) => colored(new Arrow(0, radius), name);
    const outline = (name, count, dashed) => colored(new Outline(0, count, dashed), name);
    this.arrows = this.run.robot.feet.map(() => ({
      measured: arrow('measured-mark', 0.0055), computed: arrow('computed', 0.009),
      measuredMoment: arrow('measured-mark', 0.004), computedMoment: arrow('desired', 0.006)}));
    this.pushArrow = arrow('push', 0.012);
    this.crane = new CraneView(METRES_PER_NEWTON);
    colored(this.crane, 'support');
    colored(this.crane.arrow, 'push');
    this.soles = this.run.robot.feet.map((foot) => outline('support', foot.corners.length));
    this.polygon = outline('support', this.run.robot.feet.reduce((sum, foot) => sum + foot.corners.length, 0));
    this.region = outline('limit', REGION_CORNERS, true);
    this.steps = new StepsView(this.run, colored);
    this.capture = flat('disc', 'capture', 0.011);
    this.step = flat('ring', 'capture', 0.045);
    this.frame = new Group();
    this.marks = {desired: flat('diamond', 'desired', 0.024), computed: flat('ring', 'computed', 0.013),
      measured: flat('disc', 'measured-mark', 0.0075)};
    this.frame.add(this.marks.desired, this.marks.computed);
    this.measuredFrame = new Group();
    this.marks.measured.position.z = 0.001;
    this.measuredFrame.add(this.marks.measured);
    this.comMark = flat('cross', 'com', 0.014);
    this.com = colored(new Mesh(new SphereGeometry(0.022, 20, 14),
      new MeshBasicMaterial({depthTest: false, transparent: true})), 'com');
    this.com.renderOrder = 9;
    const flats = [this.frame, this.measuredFrame, this.comMark, this.capture, this.step, this.polygon.object, this.region.object,
      ...this.soles.map((s) => s.object)];
    scene.add(...flats, this.com, this.pushArrow.object, this.crane.object, this.steps.object,
      ...this.arrows.flatMap((arrows) => Object.values(arrows).map((x) => x.object)));
    for (const object of [...flats, ...this.steps.flat]) object.traverse((o) => o.layers.enable(GROUND_LAYER));
  }

  setTheme() {
    for (const [material, role] of this.colored) material.color.set(colorNow(role));
    this.insetBackground = new Color(isDark() ? 0x20252c : 0xffffff);
    super.setTheme();
  }

  setShow(name, on) {
    this.show[name] = on;
    this.setRow(this.row);
  }

  /** Shows the run as its values of this row are. */
  setRow(row) {
    this.row = row;
    const {samples, show} = this;
    const posed = this.robotView.setPose(samples.pose('base', row),
      samples.vector('joint', row, this.run.robot.joints.length));
    if (posed) {
      if (this.posedAt === undefined) this.look('free');  // a page may be opened before a run's first pose
      this.posedAt = this.run.timeAt(row);
      this.#follow();
    }
    this.note.hidden = posed;
    this.note.textContent = this.posedAt === undefined ? 'no message tells the robot\'s pose'
      : `no message tells the pose at this time: it is that of ${this.posedAt.toFixed(3)} s`;
    for (const ghost of this.ghosts) {
      const other = ghost.run.rowAt(this.run.timeAt(row));
      ghost.view.setPose(ghost.samples.pose('base', other), ghost.samples.vector('joint', other, ghost.run.robot.joints.length));
    }
    if (this.block) this.block.setRise(blockRise(this.run.scenario.sim.block, this.run.timeAt(row)));

    const com = samples.vector('com', row);
    this.com.visible = this.comMark.visible = show.com && com.every(Number.isFinite);
    if (this.com.visible) {
      this.com.position.set(...com);
      const ground = samples.at('frame.position[2]', row);
      this.comMark.position.set(com[0], com[1], (Number.isFinite(ground) ? ground : 0) + 0.001);
    }
    const force = samples.vector('push', row);
    const point = samples.vector('point', row);
    const pushed = samples.at('pushed', row) > LEAST_PUSH;
    const push = force.map((f) => f * METRES_PER_NEWTON * 1.5);
    this.pushArrow.set(point.map((p, i) => p - push[i]), pushed ? push : [0, 0, 0]);
    this.crane.set(samples.vector('crane', row), samples.vector('crane_force', row), samples.at('crane_share', row));
    this.#setFeet(row);
    this.#setPressure(row);
    this.steps.shown = show.steps;
    this.steps.setRow(row);
    this.draw();
  }

  /** The view, the ground and its grid go with a robot that walks away. */
  #follow() {
    const {x, y, z} = this.robotView.object.position;
    const {target} = this.controls;
    const away = Math.hypot(x - target.x, y - target.y);
    const up = z - target.z;  // on stairs
    if (away > FOLLOW || Math.abs(up) > CLIMB) {
      const share = Math.max(0, 1 - FOLLOW / away), rise = Math.max(0, 1 - CLIMB / Math.abs(up));
      const move = new Vector3((x - target.x) * share, (y - target.y) * share, up * rise);
      target.add(move);
      this.camera.position.add(move);
      this.controls.update();
    }
    const square = GRID * PIECE;
    this.ground.position.set(x, y, 0);
    this.grid.position.set(Math.round(x / square) * square, Math.round(y / square) * square, 0);
  }

  #setFeet(row) {
    const {samples, show} = this;
    const polygon = [];
    this.run.robot.feet.forEach((foot, f) => {
      const sole = samples.pose(`sole${f}`, row);
      const corners = foot.corners.map(([x, y]) => transform(sole, [x, y, 0]));
      this.soles[f].set(show.pressure && corners.flat().every(Number.isFinite) ? corners : []);
      if (samples.at(`contact${f}`, row) > 0) polygon.push(...corners);
      for (const kind of ['measured', 'computed']) {
        const arrows = this.arrows[f];
        const moment = samples.vector(`${kind}${f}.moment`, row);
        // What the ground does to the robot, where it acts on the sole.
        const cop = samples.vector(`${kind}${f}.cop`, row, 2), loaded = cop.every(Number.isFinite);
        const at = loaded ? transform(sole, [...cop, 0]) : sole.position;
        const force = rotate(sole.orientation, samples.vector(`${kind}${f}.force`, row).map((v) => -v * METRES_PER_NEWTON));
        arrows[kind].set(at, show.forces && loaded ? force : [0, 0, 0]);
        const turn = rotate(sole.orientation, moment.map((v) => -v * METRES_PER_NEWTON_METRE));
        arrows[`${kind}Moment`].set(sole.position, show.moments ? turn : [0, 0, 0]);
      }
    });
    const hull = polygon.flat().every(Number.isFinite) ? convexHull(polygon) : [];
    this.polygon.set(show.pressure ? hull : []);
  }

  #setPressure(row) {
    const {samples, show} = this;
    const frame = samples.pose('frame', row);
    const known = show.pressure && [...frame.position, ...frame.orientation].every(Number.isFinite);
    this.frame.visible = known;
    const count = samples.at('num_corners', row);
    const corners = Array.from({length: count > 0 ? count : 0}, (_, i) =>
      transform(frame, [samples.at(`corner_x[${i}]`, row), samples.at(`corner_y[${i}]`, row), 0.001]));
    this.region.set(known && corners.flat().every(Number.isFinite) ? corners : []);
    const balancing = samples.at('active_x', row) > 0 || samples.at('active_y', row) > 0;
    const put = (object, [x, y, z = 0], on = true) => {
      object.visible = known && on && Number.isFinite(x + y + z);
      if (object.visible) object.position.set(x, y, z + 0.001);
    };
    put(this.capture, samples.vector('capture', row));
    put(this.step, samples.vector('step', row), samples.at('step_needed', row) > 0);
    put(this.marks.computed, samples.vector('cop', row, 2));
    put(this.marks.desired, samples.vector('desired_cop', row, 2), balancing);
    if (known) place(this.frame, frame);
    const measured = samples.vector('measured_cop', row);
    this.marks.measured.visible = known && measured.every(Number.isFinite);
    if (this.marks.measured.visible) place(this.measuredFrame, {position: measured, orientation: frame.orientation});
  }

  /** Both soles in the view from above; in steps, so that it holds still. */
  #fitAbove(soles, middle) {
    const reach = soles.map((sole, f) => Math.hypot(sole[0] - middle[0], sole[1] - middle[1])
      + Math.max(...this.run.robot.feet[f].corners.map(([x]) => Math.abs(x))));
    const half = Math.max(ABOVE, Math.ceil(Math.max(...reach) / ABOVE_STEP) * ABOVE_STEP);
    if (half === this.above.top) return;
    Object.assign(this.above, {left: -half, right: half, top: half, bottom: -half});
    this.above.updateProjectionMatrix();
  }

  draw() { if (this.visible || this.recorded) super.draw(); }

  /** Once a frame while the run plays: coarser while frames are slow to come, as without a graphics card. */
  pace(playing) {
    const now = performance.now();
    const took = now - this.#lastPace;
    this.#lastPace = now;
    if (this.recorded) return;  // a video keeps its size
    if (!playing) this.setRatio(this.finest);
    else if (took < LONGEST_PAUSE) this.#frameTime += FRAME_SHARE * (took - this.#frameTime);
    if (playing && this.#frameTime > SLOW_FRAME && this.ratio > COARSEST) {
      this.setRatio(Math.max(COARSEST, 0.75 * this.ratio));
      this.#frameTime = 0;  // measured anew
    }
  }
  #lastPace = 0;
  #frameTime = 0;

  /** At once. */
  renderNow() {
    const {renderer} = this;
    const {clientWidth: width, clientHeight: height} = this.host;
    if (width === 0 || height === 0) return;
    renderer.setViewport(0, 0, width, height);
    renderer.setScissorTest(false);
    this.steps.clear(this.camera, width, height);
    super.renderNow();
    const side = Math.round(INSET * Math.min(width, height));
    const soles = this.run.robot.feet.map((_, f) => this.samples.pose(`sole${f}`, this.row).position);
    const middle = [0, 1, 2].map((i) => soles.reduce((sum, sole) => sum + sole[i], 0) / soles.length);
    if (side < 60 || !this.show.pressure || !middle.every(Number.isFinite)) return;
    this.#fitAbove(soles, middle);
    this.above.position.set(middle[0], middle[1], middle[2] + 1);  // nearer than the fog
    this.above.lookAt(...middle);
    renderer.setViewport(width - side - 8, 8, side, side);
    renderer.setScissor(width - side - 8, 8, side, side);
    renderer.setScissorTest(true);
    const {background} = this.scene;
    this.scene.background = this.insetBackground;
    renderer.render(this.scene, this.above);
    this.scene.background = background;
    renderer.setScissorTest(false);
  }
}
