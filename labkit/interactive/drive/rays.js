// A scanner that looks into a world of walls, beam by beam; mirrors labkit/simulation/lidar.py.
// Segments are flat arrays ax, ay, bx, by, ... in metres.

// One sweep: the points in beam order, and the range of each beam; Infinity for a no-return.
export function cast(segments, T, { angles, range_min, range_max, noise_std }, random) {
  const ranges = firstHits(segments, T, angles).map((range) => range + noise_std * random.normal()), points = [];
  ranges.forEach((range, k) => {
    if (range > range_min && range < range_max) points.push(range * Math.cos(angles[k]), range * Math.sin(angles[k]));
    else ranges[k] = Infinity;
  });
  return { ranges, points: Float64Array.from(points) };
}

// The distance along each beam to the nearest segment that it crosses; of each end point it is
// looked at how far ahead it lies, and how far to the left.
export function firstHits(segments, { c, s, x, y }, angles) {
  const ranges = new Float64Array(angles.length).fill(Infinity);
  angles.forEach((angle, k) => {
    const bx = c * Math.cos(angle) - s * Math.sin(angle), by = s * Math.cos(angle) + c * Math.sin(angle);
    for (let i = 0; i < segments.length; i += 4) {
      const ax = segments[i] - x, ay = segments[i + 1] - y, ex = segments[i + 2] - x, ey = segments[i + 3] - y;
      const acrossA = bx * ay - by * ax, acrossB = bx * ey - by * ex;
      if (acrossA < 0 === acrossB < 0) continue;
      const aheadA = bx * ax + by * ay, aheadB = bx * ex + by * ey;
      const distance = aheadA + (acrossA / (acrossA - acrossB)) * (aheadB - aheadA);
      if (distance >= 0 && distance < ranges[k]) ranges[k] = distance;
    }
  });
  return ranges;
}

// Numbers by chance, the same ones for the same seed: uniform in (0, 1), and normal.
export const generator = (seed) => {
  const uniform = () => {
    seed = (seed + 0x6d2b79f5) | 0;
    let t = Math.imul(seed ^ (seed >>> 15), 1 | seed);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return (((t ^ (t >>> 14)) >>> 0) + 0.5) / 2 ** 32;
  };
  return { uniform, normal: () => Math.sqrt(-2 * Math.log(uniform())) * Math.cos(2 * Math.PI * uniform()) };
};
