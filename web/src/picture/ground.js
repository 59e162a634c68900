// Blocks of a field, as the simulator has them while nothing stands on them.
import {Color, Float32BufferAttribute, LineBasicMaterial, LineSegments, Group, Mesh, MeshStandardMaterial} from 'three';
import {geometryOf, prism} from './markers.js';

const SOFT = new Color(0xd9b98a), STIFF = new Color(0x7b7f88);
const DEPTH = 0.05;  // m, of the walls of a block that lies below the ground

/** Share 0..1 of the way from the softest to the stiffest block, by the logarithm; 1 where all are alike. */
function stiffnessShare(blocks, stiffness) {
  const all = blocks.map((block) => Math.log(block.stiffness));
  const least = Math.min(...all), most = Math.max(...all);
  return most - least < 1e-9 ? 1 : (Math.log(stiffness) - least) / (most - least);
}

/** The four corners of a block's top, anticlockwise from above. */
function topCorners({x: [x0, x1], y: [y0, y1], top}) {
  return [[x0, y0, top[0]], [x1, y0, top[1]], [x1, y1, top[2]], [x0, y1, top[3]]];
}

function blockTriangles(block) {
  const low = Math.min(...block.top);
  return prism(topCorners(block), low > 0 ? 0 : low - DEPTH);
}

/** {object}: all of a page's `ground`. */
export class GroundBlocks {
  constructor(blocks) {
    this.object = new Group();
    const points = [], colors = [], edges = [];
    for (const block of blocks) {
      const color = SOFT.clone().lerp(STIFF, stiffnessShare(blocks, block.stiffness));
      for (const point of blockTriangles(block)) {
        points.push(...point);
        colors.push(color.r, color.g, color.b);
      }
      topCorners(block).forEach((a, i, top) => edges.push(...a, ...top[(i + 1) % 4]));
    }
    const geometry = geometryOf(points).setAttribute('color', new Float32BufferAttribute(colors, 3));
    geometry.computeVertexNormals();
    this.mesh = new Mesh(geometry, new MeshStandardMaterial({vertexColors: true, roughness: 1, flatShading: true,
      polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1}));  // edges and soles lie on it
    this.edges = new LineSegments(geometryOf(edges), new LineBasicMaterial({color: 0x5a5048}));
    this.object.add(this.mesh, this.edges);
  }
}
