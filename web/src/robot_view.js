// A robot of its file's solids and meshes; a body that lacks some gets capsules between its joints.
import {
  BoxGeometry, CapsuleGeometry, CylinderGeometry, DoubleSide, ExtrudeGeometry, Group, Mesh, MeshStandardMaterial, Quaternion, Shape,
  SphereGeometry, Vector2, Vector3,
} from 'three';
import {geometryOf} from './picture/markers.js';

const LINK_RADIUS = 0.028;  // m, of capsules
const SOLE_THICKNESS = 0.012;  // m
export const FOOT_COLORS = [0x3f7fd6, 0xe08a2c];  // right, left
const UP = new Vector3(0, 1, 0);  // axis of three's cylinders

export function place(object, pose) {
  const [w, x, y, z] = pose.orientation;
  object.position.set(...pose.position);
  object.quaternion.set(x, y, z, w);
}

/** Corners are whole steps within the mesh's box. */
function meshGeometry({low, size, steps, vertices, indices}) {
  const geometry = geometryOf(vertices.map((v, i) => low[i % 3] + v * size[i % 3] / steps));
  geometry.setIndex(indices);
  geometry.computeVertexNormals();
  return geometry;
}

function shapeGeometry(visual, meshes) {
  if (visual.shape === 'box') return new BoxGeometry(...visual.size);
  if (visual.shape === 'sphere') return new SphereGeometry(visual.radius, 24, 16);
  if (visual.shape === 'mesh') return meshes[visual.mesh];
  if (visual.shape === 'capsule') return new CapsuleGeometry(visual.radius, visual.length, 8, 20).rotateX(Math.PI / 2);
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
    const material = (color, more) => new MeshStandardMaterial({color: ghost ? 0x8a6fd0 : color, ...look, ...more});
    this.material = material(0x8fa3b8);
    this.meshMaterial = material(0x8fa3b8, {flatShading: true, side: DoubleSide});
    this.soleMaterials = robot.feet.map((_, f) => material(FOOT_COLORS[f]));
    this.groups = robot.bodies.map(() => new Group());
    robot.bodies.forEach((body, b) => {
      const parent = body.parent < 0 ? this.object : this.groups[body.parent];
      if (body.origin) place(this.groups[b], body.origin);
      parent.add(this.groups[b]);
    });
    this.origins = this.groups.map((group) => group.quaternion.clone());
    this.axes = robot.bodies.map((body) => body.axis && new Vector3(...body.axis));
    this.#addVisuals();
    this.#addSoles();
  }

  #addVisuals() {
    const {bodies, feet, visuals, capsules} = this.robot;
    const meshes = this.robot.meshes.map(meshGeometry);
    for (const visual of visuals) {
      const mesh = new Mesh(shapeGeometry(visual, meshes), visual.shape === 'mesh' ? this.meshMaterial : this.material);
      place(mesh, visual.pose);
      if (visual.scale) mesh.scale.set(...visual.scale);
      this.groups[visual.body].add(mesh);
    }
    const zero = new Vector3();
    for (const b of capsules) {
      const ends = [...bodies.filter((child) => child.parent === b).map((child) => child.origin.position),
        ...feet.filter((foot) => foot.body === b).map((foot) => foot.sole.position)];
      for (const end of ends) {
        const mesh = capsule(zero, new Vector3(...end), this.material);
        if (mesh) this.groups[b].add(mesh);
      }
      this.groups[b].add(new Mesh(new SphereGeometry(LINK_RADIUS * 1.25, 16, 12), this.material));
    }
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
