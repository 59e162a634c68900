// What is drawn beside the robot: arrows, points on the ground, outlines, the soft block.
import {
  BufferAttribute, BufferGeometry, CanvasTexture, CircleGeometry, ConeGeometry, CylinderGeometry, DoubleSide, Float32BufferAttribute, Group,
  Line, LineDashedMaterial, LineLoop, LineBasicMaterial, Mesh, MeshBasicMaterial, MeshStandardMaterial, RingGeometry, SRGBColorSpace,
  Sprite, SpriteMaterial, Vector3,
} from 'three';
import {BLOCK_CORNERS, blockTop} from '../spatial.js';

const UP = new Vector3(0, 1, 0);
const OVERLAY_ORDER = 10;
const LEAST_ARROW = 0.005;  // m: a shorter one is hidden

/** Geometry of points, three `numbers` each. */
export const geometryOf = (numbers) =>
  new BufferGeometry().setAttribute('position', new Float32BufferAttribute(numbers, 3));

/** Triangles, three points each, of a top of four corners, anticlockwise from above, and of walls down to `bottom`. */
export function prism(top, bottom) {
  const quad = (a, b, c, d) => [a, b, c, a, c, d];
  return [...quad(...top), ...top.flatMap((a, i) => {
    const b = top[(i + 1) % 4];
    return quad([a[0], a[1], bottom], [b[0], b[1], bottom], b, a);
  })];
}

/** Drawn over what lies before it: points under a sole stay in sight. */
const overlay = (color, more = {}) =>
  new MeshBasicMaterial({color, depthTest: false, transparent: true, side: DoubleSide, ...more});

/** An arrow from a point along a vector. */
export class Arrow {
  constructor(color, radius) {
    this.object = new Group();
    this.material = overlay(color);
    this.radius = radius;
    this.shaft = new Mesh(new CylinderGeometry(1, 1, 1, 12).translate(0, 0.5, 0), this.material);
    this.head = new Mesh(new ConeGeometry(1, 1, 16).translate(0, -0.5, 0), this.material);
    this.object.add(this.shaft, this.head);
    this.object.children.forEach((mesh) => { mesh.renderOrder = OVERLAY_ORDER; });
  }

  set(from, vector) {
    direction.set(...vector);
    const length = direction.length();
    this.object.visible = length > LEAST_ARROW && Number.isFinite(length);
    if (!this.object.visible) return;
    this.object.position.set(...from);
    this.object.quaternion.setFromUnitVectors(UP, direction.divideScalar(length));
    const head = Math.min(0.4 * length, 5 * this.radius);
    this.shaft.scale.set(this.radius, length - head, this.radius);
    this.head.scale.set(2.2 * this.radius, head, 2.2 * this.radius);
    this.head.position.y = length;
  }
}
const direction = new Vector3();

/** A flat mark: 'disc', 'ring', 'cross' or 'diamond'; lies in the x-y plane of its frame. */
export function mark(kind, color, size) {
  const geometry = kind === 'disc' ? new CircleGeometry(size, 24)
    : kind === 'ring' ? new RingGeometry(0.62 * size, size, 28)
      : kind === 'diamond' ? new RingGeometry(0.72 * size, size, 4) : crossGeometry(size);
  const mesh = new Mesh(geometry, overlay(color));
  mesh.renderOrder = OVERLAY_ORDER + 1;
  return mesh;
}

function crossGeometry(size) {
  const t = 0.22 * size;
  const quad = (a, b) => [-a, -b, 0, a, -b, 0, a, b, 0, -a, -b, 0, a, b, 0, -a, b, 0];
  return geometryOf([...quad(size, t), ...quad(t, size)]);
}

export const LABEL = {width: 128, height: 36, size: 0.00125};  // pixels, pixels, m a pixel

/** A word or two over a place; `width`: pixels, `size`: m a pixel. */
export class Label {
  constructor(width = LABEL.width, size = LABEL.size) {
    this.canvas = Object.assign(document.createElement('canvas'), {width, height: LABEL.height});
    this.texture = new CanvasTexture(this.canvas);
    this.texture.colorSpace = SRGBColorSpace;
    this.object = new Sprite(new SpriteMaterial({map: this.texture, transparent: true, depthTest: false}));
    this.object.scale.set(size * width, size * LABEL.height, 1);
    this.object.renderOrder = OVERLAY_ORDER + 2;
  }

  /** Without a text it is hidden. */
  set(text, [x, y, z] = [0, 0, 0], dark = false) {
    this.object.visible = Boolean(text);
    this.object.position.set(x, y, z + 0.03);
    if (this.shown === text && this.dark === dark) return;
    Object.assign(this, {shown: text, dark});
    if (!text) return;
    const pen = this.canvas.getContext('2d');
    const {width} = this.canvas;
    pen.clearRect(0, 0, width, LABEL.height);
    pen.font = 'bold 28px system-ui, sans-serif';
    pen.textAlign = 'center';
    pen.textBaseline = 'middle';
    pen.lineWidth = 3;
    pen.strokeStyle = dark ? '#14171c' : '#ffffff';
    pen.fillStyle = dark ? '#f2f2f2' : '#1d1d1f';
    pen.strokeText(text, width / 2, LABEL.height / 2);
    pen.fillText(text, width / 2, LABEL.height / 2);
    this.texture.needsUpdate = true;
  }
}

/** A closed outline of up to `capacity` points. */
export class Outline {
  constructor(color, capacity, dashed = false) {
    this.positions = new BufferAttribute(new Float32Array(3 * (capacity + 1)), 3);
    const geometry = new BufferGeometry().setAttribute('position', this.positions);
    const look = {color, depthTest: false, transparent: true};
    this.material = dashed ? new LineDashedMaterial({...look, dashSize: 0.02, gapSize: 0.012})
      : new LineBasicMaterial(look);
    this.object = dashed ? new Line(geometry, this.material) : new LineLoop(geometry, this.material);
    this.dashed = dashed;
    this.object.renderOrder = OVERLAY_ORDER;
    this.object.frustumCulled = false;
  }

  set(points) {
    const list = this.dashed && points.length ? [...points, points[0]] : points;
    list.forEach((p, i) => this.positions.setXYZ(i, p[0], p[1], p[2]));
    this.positions.needsUpdate = true;
    this.object.geometry.setDrawRange(0, list.length);
    this.object.visible = list.length > 1;
    if (this.dashed) this.object.computeLineDistances();
  }
}

/** The scenario's soft block, undeformed, without its irregularity; setRise sets the height of its tilted top. */
export class Block {
  constructor(block) {
    this.block = block;
    this.object = new Mesh(new BufferGeometry(), new MeshStandardMaterial({color: 0x9c8458, roughness: 1, side: DoubleSide}));
    this.object.position.set(block.x, block.y, 0.001);
    this.object.visible = false;
  }

  /** What blockRise gives. */
  setRise(rise) {
    if (rise === this.rise) return;
    this.rise = rise;
    this.object.visible = rise !== undefined;
    if (rise === undefined) return;
    const {length, width} = this.block, heights = blockTop(this.block, rise);
    const top = BLOCK_CORNERS.map(([i, j], corner) => [i * length / 2, j * width / 2, heights[corner]]);
    this.object.geometry.dispose();
    this.object.geometry = geometryOf(prism(top, 0).flat());
    this.object.geometry.computeVertexNormals();
  }
}
