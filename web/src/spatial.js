// Vectors and quaternions (w, x, y, z) as plain arrays.

export function rotate([w, x, y, z], [a, b, c]) {
  const tx = 2 * (y * c - z * b), ty = 2 * (z * a - x * c), tz = 2 * (x * b - y * a);
  return [a + w * tx + y * tz - z * ty, b + w * ty + z * tx - x * tz, c + w * tz + x * ty - y * tx];
}

export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];

/** Where a point of the frame of a pose {position, orientation} lies in the frame that the pose is of. */
export const transform = ({position, orientation}, point) => add(position, rotate(orientation, point));

/** Convex hull in x and y of points [x, y, ...], anticlockwise. */
export function convexHull(points) {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const turn = (o, a, b) => (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);
  const half = (list) => {
    const chain = [];
    for (const p of list) {
      while (chain.length > 1 && turn(chain.at(-2), chain.at(-1), p) <= 0) chain.pop();
      chain.push(p);
    }
    chain.pop();
    return chain;
  };
  return sorted.length < 3 ? sorted : [...half(sorted), ...half(sorted.reverse())];
}

/**
 * Share of its height, 0..1, that the top of the scenario's soft block has at a time, s: it rises with minimum jerk, as
 * in sim/terrain.cc. undefined before it is there.
 */
export function blockRise(block, time) {
  const elapsed = time - (block.start ?? 0);
  if (!(elapsed >= 0)) return undefined;
  const s = block.rise > 0 ? Math.min(elapsed / block.rise, 1) : 1;
  return s * s * s * (10 + s * (6 * s - 15));
}

/** Of the block, from above, counterclockwise. */
export const BLOCK_CORNERS = [[-1, -1], [1, -1], [1, 1], [-1, 1]];

/** Heights of the top's corners above the ground, m, as in sim/terrain.cc. */
export function blockTop(block, rise) {
  const slope = [-Math.tan(block.tilt_pitch), Math.tan(block.tilt_roll) / Math.cos(block.tilt_pitch)];
  return BLOCK_CORNERS.map(([i, j]) => block.height * rise + slope[0] * i * block.length / 2 + slope[1] * j * block.width / 2);
}
