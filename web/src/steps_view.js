// Footprints with the time of their touch-down, planned footholds, the capture point's trace, and the regions of 0, 1 and 2 steps.
import {
  BufferAttribute, BufferGeometry, DoubleSide, DynamicDrawUsage, Group, Line, LineBasicMaterial, LineSegments, Mesh, MeshBasicMaterial,
  Vector3,
} from 'three';
import {apart, Footprints, PLANNED, REGIONS, plannedAt, plannedSignals, regionsAt} from './footsteps.js';
import {LABEL, Label, Outline} from './picture/markers.js';
import {isDark} from './palette.js';
import {Samples, vector} from './samples.js';
import {FOOT_COLORS} from './robot_view.js';
import {transform} from './spatial.js';

const SHOWN = 60;     // footprints, the last ones
const LABELLED = 8;   // of them
const LIFT = 0.002;   // m above the ground
export const TRACE = 3;  // s
const TRACE_POINTS = 400;
const AHEAD = [1, 0.55, 0.35];        // opacity of the step under way and of those after it
const WITHIN = [1, 0.75, 0.5];        // of the regions of 0, 1, 2 steps

/** A point's place that changes in every frame. */
const growing = (count) => new BufferAttribute(new Float32Array(3 * count), 3).setUsage(DynamicDrawUsage);

/** A corner of a sole on the ground, in the world. */
const lifted = (pose, [x, y]) => {
  const at = transform(pose, [x, y, 0]);
  return [at[0], at[1], at[2] + LIFT];
};

/** The soles of one foot on the ground: filled, with their edges. */
class Prints {
  constructor(color, corners) {
    this.corners = corners;
    this.fill = growing(SHOWN * 3 * (corners.length - 2));
    this.edge = growing(SHOWN * 2 * corners.length);
    const geometry = (positions) => new BufferGeometry().setAttribute('position', positions);
    this.faces = new Mesh(geometry(this.fill), new MeshBasicMaterial({color, transparent: true, opacity: 0.22, depthWrite: false,
      side: DoubleSide}));
    this.edges = new LineSegments(geometry(this.edge), new LineBasicMaterial({color}));
    this.object = new Group();
    this.object.add(this.faces, this.edges);
    for (const part of this.object.children) part.frustumCulled = false;
  }

  set(prints) {
    let face = 0, edge = 0;
    for (const {pose} of prints) {
      const at = this.corners.map((corner) => lifted(pose, corner));
      at.forEach((point, i) => {
        this.edge.setXYZ(edge++, ...point);
        this.edge.setXYZ(edge++, ...at[(i + 1) % at.length]);
        if (i < 2) return;
        for (const corner of [at[0], at[i - 1], point]) this.fill.setXYZ(face++, ...corner);
      });
    }
    this.fill.needsUpdate = this.edge.needsUpdate = true;
    this.faces.geometry.setDrawRange(0, face);
    this.edges.geometry.setDrawRange(0, edge);
  }
}

const place = new Vector3();

export class StepsView {
  /** `colored(object, name)` gives what is drawn with one material its colour of the theme. */
  constructor(run, colored) {
    this.run = run;
    this.footprints = new Footprints(run);
    this.samples = new Samples();
    this.shown = true;
    const {feet} = run.robot;
    this.prints = feet.map((foot, f) => new Prints(FOOT_COLORS[f], foot.corners));
    this.labels = Array.from({length: LABELLED}, () => new Label());
    const outline = (opacity, ...more) => {
      const result = new Outline(0, ...more);
      result.material.opacity = opacity;
      return result;
    };
    const mostCorners = Math.max(...feet.map((foot) => foot.corners.length));
    this.planned = AHEAD.map((opacity) => outline(opacity, mostCorners + 1, true));
    this.regions = WITHIN.map((opacity, steps) => colored(outline(opacity, 17, steps > 0), 'reach'));
    this.trail = growing(TRACE_POINTS);
    this.trace = colored(new Line(new BufferGeometry().setAttribute('position', this.trail),
      new LineBasicMaterial({depthTest: false, transparent: true, opacity: 0.8})), 'capture');
    this.trace.frustumCulled = false;
    this.trace.renderOrder = 10;
    this.object = new Group();
    this.flat = [...[...this.prints, ...this.planned, ...this.regions].map(({object}) => object), this.trace];
    this.object.add(...this.flat, ...this.labels.map(({object}) => object));
  }

  async load() {
    await Promise.all([this.footprints.load(),
      this.samples.load(this.run, {...plannedSignals(), ...vector('capture', 'planner_status_t', 'capture_point')})]);
  }

  /** What is known at a row, whatever comes after it. */
  setRow(row) {
    this.object.visible = this.shown;
    if (!this.shown) return;
    const {run, samples} = this;
    this.footprints.update();
    const prints = apart(this.footprints.until(run.timeAt(row), SHOWN));
    this.prints.forEach((view, f) => view.set(prints.filter((print) => print.foot === f)));
    const dark = isDark();
    this.labels.forEach((label, i) => {
      const print = prints[prints.length - 1 - i];
      label.set(print && `${print.from.toFixed(2)} s`, print?.pose.position, dark);
    });
    const planned = plannedAt(samples, row);
    this.planned.forEach((outline, i) => {
      const step = planned[i];
      const known = step && run.robot.feet[step.foot] && [...step.position, step.yaw].every(Number.isFinite);
      outline.set(known ? this.#sole(step) : []);
      if (known) outline.material.color.set(FOOT_COLORS[step.foot]);
    });
    const regions = regionsAt(samples, row);
    this.regions.forEach((outline, i) => {
      outline.set(regions[i].flat().every(Number.isFinite) ? regions[i].map(([x, y, z]) => [x, y, z + LIFT]) : []);
    });
    this.#setTrace(row);
  }

  /** Hides times that others would be drawn over, the latest staying; `width`, `height`: px of the picture. */
  clear(camera, width, height) {
    const taken = [];
    const pixels = height / 2 / Math.tan(camera.fov * Math.PI / 360);
    for (const {object, shown} of this.labels) {
      if (!shown) continue;
      place.copy(object.position).applyMatrix4(camera.matrixWorldInverse);
      const [w, h] = [LABEL.width, LABEL.height].map((length) => length * LABEL.size * pixels / -place.z);
      place.applyMatrix4(camera.projectionMatrix);
      const x = (place.x + 1) / 2 * width, y = (1 - place.y) / 2 * height;
      object.visible = !taken.some((t) => Math.abs(t.x - x) < (t.w + w) / 2 && Math.abs(t.y - y) < (t.h + h) / 2);
      if (object.visible) taken.push({x, y, w, h});
    }
  }

  #sole({foot, position, yaw}) {
    const pose = {position, orientation: [Math.cos(yaw / 2), 0, 0, Math.sin(yaw / 2)]};
    return this.run.robot.feet[foot].corners.map((corner) => lifted(pose, corner));
  }

  #setTrace(row) {
    const {run, samples} = this;
    const first = run.rowAt(run.timeAt(row) - TRACE);
    const stride = Math.max(1, Math.ceil((row - first + 1) / TRACE_POINTS));
    let count = 0;
    for (let r = row; r >= first; r -= stride) {
      const [x, y, z] = samples.vector('capture', r);
      if (Number.isFinite(x + y + z)) this.trail.setXYZ(count++, x, y, z + LIFT);
    }
    this.trail.needsUpdate = true;
    this.trace.geometry.setDrawRange(0, count);
    this.trace.visible = count > 1;
  }
}

if (PLANNED !== AHEAD.length || REGIONS !== WITHIN.length) throw new Error('a look for each foothold and region');
