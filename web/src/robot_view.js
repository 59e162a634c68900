// A robot of boxes, cylinders and spheres; a body that has none gets capsules between its joints.
import {
  BoxGeometry, CapsuleGeometry, CylinderGeometry, ExtrudeGeometry, Group, Mesh, MeshStandardMaterial, Quaternion, Shape,
  SphereGeometry, Vector2, Vector3,
} from 'three';

const LINK_RADIUS = 0.028;  // m, of capsules
const SOLE_THICKNESS = 0.012;  // m
const UP = new Vector3(0, 1, 0);  // axis of three's cylinders

export function place(object, pose) {
  const [w, x, y, z] = pose.orientation;
  object.position.set(...pose.position);
  object.quaternion.set(x, y, z, w);
}

function shapeGeometry(visual) {
  if (visual.shape === 'box') return new BoxGeometry(...visual.size);
  if (visual.shape === 'sphere') return new SphereGeometry(visual.radius, 24, 16);
  return new CylinderGeometry(visual.radius, visual.radius, visual.length, 24).rotateX(Math.PI / 2);  // along z
}

function capsule(from, to, material) {
  const along = new Vector3().subVectors(to, from);
  const length = along.length();
  if (length < 1e-3) return null;
  const mesh = new Mesh(new CapsuleGeometry(LINK_RADIUS, length, 6, 12), material);
  mesh.position.addVectors(from, to).multiplyScalar(0.5);
  mesh.quaternion.setFromUnitVectors(UP, along.divideScalar(length));
  return mesh;
}

/** `object`: to add to a scene; setPose places it. */
export class RobotView {
  constructor(robot, {ghost = false} = {}) {
    this.robot = robot;
    this.object = new Group();
    const look = ghost ? {transparent: true, opacity: 0.3, depthWrite: false} : {roughness: 0.75, metalness: 0.05};
    this.material = new MeshStandardMaterial({color: ghost ? 0x8a6fd0 : 0x8fa3b8, ...look});
    this.soleMaterials = robot.feet.map((_, f) =>
      new MeshStandardMaterial({color: ghost ? 0x8a6fd0 : [0x3f7fd6, 0xe08a2c][f], ...look}));
    this.groups = robot.bodies.map(() => new Group());
    robot.bodies.forEach((body, b) => {
      const parent = body.parent < 0 ? this.object : this.groups[body.parent];
      if (body.origin) place(this.groups[b], body.origin);
      parent.add(this.groups[b]);
    });
    this.origins = robot.bodies.map((_, b) => this.groups[b].quaternion.clone());
    this.axes = robot.bodies.map((body) => body.axis && new Vector3(...body.axis));
    this.#addVisuals();
    this.#addSoles();
  }

  #addVisuals() {
    const {bodies, feet, visuals} = this.robot;
    for (const visual of visuals) {
      const mesh = new Mesh(shapeGeometry(visual), this.material);
      place(mesh, visual.pose);
      this.groups[visual.body].add(mesh);
    }
    const zero = new Vector3();
    bodies.forEach((body, b) => {
      if (visuals.some((v) => v.body === b)) return;
      const ends = [...bodies.filter((child) => child.parent === b).map((child) => child.origin.position),
        ...feet.filter((foot) => foot.body === b).map((foot) => foot.sole.position)];
      for (const end of ends) {
        const mesh = capsule(zero, new Vector3(...end), this.material);
        if (mesh) this.groups[b].add(mesh);
      }
      this.groups[b].add(new Mesh(new SphereGeometry(LINK_RADIUS * 1.25, 16, 12), this.material));
    });
  }

  #addSoles() {
    this.robot.feet.forEach((foot, f) => {
      const sole = new Group();
      place(sole, foot.sole);
      const outline = new Shape(foot.corners.map(([x, y]) => new Vector2(x, y)));
      const plate = new ExtrudeGeometry(outline, {depth: SOLE_THICKNESS, bevelEnabled: false});  // above the sole's plane
      sole.add(new Mesh(plate, this.soleMaterials[f]));
      this.groups[foot.body].add(sole);
    });
  }

  /** Base pose in the world, joint angles in rad. False: not all of it is known, and the pose stays as it was. */
  setPose(pose, joints) {
    if (![...pose.position, ...pose.orientation, ...joints].every(Number.isFinite)) return false;
    place(this.object, pose);
    this.robot.bodies.forEach(({joint}, b) => {
      if (joint < 0) return;
      turn.setFromAxisAngle(this.axes[b], joints[joint]);
      this.groups[b].quaternion.multiplyQuaternions(this.origins[b], turn);
    });
    return true;
  }
}
const turn = new Quaternion();
