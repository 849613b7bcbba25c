// SE(2), the rigid motions of the plane; mirrors labkit/se2.py.
//
// A transform T_a_b = {c, s, x, y} is the matrix [[c, -s, x], [s, c, y], [0, 0, 1]].
// Points are flat arrays x0, y0, x1, y1, ... in metres.

export const DEGREE = Math.PI / 180;

export function transform(x, y, theta) {
  return { c: Math.cos(theta), s: Math.sin(theta), x, y };
}

// (x, y, theta) with theta in (-pi, pi].
export function toXYTheta(T) {
  const theta = Math.atan2(T.s, T.c);
  return [T.x, T.y, theta === -Math.PI ? Math.PI : theta];
}

// T_a_c = T_a_b T_b_c
export function compose(A, B) {
  return {
    c: A.c * B.c - A.s * B.s,
    s: A.s * B.c + A.c * B.s,
    x: A.c * B.x - A.s * B.y + A.x,
    y: A.s * B.x + A.c * B.y + A.y,
  };
}

export function invert(T) {
  return { c: T.c, s: -T.s, x: -(T.c * T.x + T.s * T.y), y: T.s * T.x - T.c * T.y };
}

export function apply(T, points) {
  const moved = new Float64Array(points.length);
  for (let i = 0; i < points.length; i += 2) {
    moved[i] = T.c * points[i] - T.s * points[i + 1] + T.x;
    moved[i + 1] = T.s * points[i] + T.c * points[i + 1] + T.y;
  }
  return moved;
}

// How far apart two poses are: metres, and radians in [0, pi].
export const poseDifference = (A, B) => {
  const D = compose(invert(A), B);
  return [Math.hypot(D.x, D.y), Math.abs(Math.atan2(D.s, D.c))];
};

// The pose on the way from one to the next.
export const between = (A, B, share) => {
  const [a, b] = [toXYTheta(A), toXYTheta(B)];
  const turn = Math.atan2(Math.sin(b[2] - a[2]), Math.cos(b[2] - a[2]));
  return transform(a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), a[2] + share * turn);
};
