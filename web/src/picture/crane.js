// The crane that holds the robot while it starts: its rope, and its force.
import {Group, Line, LineBasicMaterial} from 'three';
import {Arrow, geometryOf} from './markers.js';

const ROPE = 0.9;  // m, of the rope that is drawn, upwards from the robot

/** `metresPerNewton` of the force's arrow. */
export class CraneView {
  constructor(metresPerNewton) {
    this.metresPerNewton = metresPerNewton;
    this.material = new LineBasicMaterial({transparent: true});
    this.arrow = new Arrow(0, 0.008);
    this.rope = new Line(geometryOf([0, 0, 0, 0, 0, ROPE]), this.material);
    this.object = new Group();
    this.object.add(this.rope, this.arrow.object);
  }

  /** `share` of its stiffness that is left: the rope fades with it; 0 or NaN: no crane. */
  set(point, force, share) {
    this.object.visible = share > 0 && point.every(Number.isFinite);
    if (!this.object.visible) return;
    this.rope.position.set(...point);
    this.material.opacity = 0.25 + 0.75 * share;
    this.arrow.set(point, force.map((f) => f * this.metresPerNewton));
  }
}
