"""The solution without numpy: loops, lists and `math`; ρ of the pairs that pass the gate."""

import math


def rotation(theta):
    c, s = math.cos(theta), math.sin(theta)
    return [[c, -s], [s, c]]


def compose(T_a_b, T_b_c):
    rows = range(3)
    T_a_c = [[0.0] * 3 for _ in rows]
    for i in rows:
        for j in rows:
            T_a_c[i][j] = sum(T_a_b[i][k] * T_b_c[k][j] for k in rows)
    return T_a_c


def invert(T_a_b):
    (a, b, x), (c, d, y), _ = T_a_b
    return [[a, c, -(a * x + c * y)], [b, d, -(b * x + d * y)], [0, 0, 1]]


def wrap(angle):
    while angle > math.pi:
        angle -= 2 * math.pi
    while angle <= -math.pi:
        angle += 2 * math.pi
    return angle


def centroid(points, weights):
    total = sum(weights)
    x = sum(w * p[0] for w, p in zip(weights, points, strict=True)) / total
    y = sum(w * p[1] for w, p in zip(weights, points, strict=True)) / total
    return x, y


def align(source, target):
    return align_weighted(source, target, [1] * len(source))


def align_weighted(source, target, weights):
    px, py = centroid(source, weights)
    qx, qy = centroid(target, weights)
    a = b = 0.0
    for (sx, sy), (tx, ty), w in zip(source, target, weights, strict=True):
        x, y, u, v = sx - px, sy - py, tx - qx, ty - qy
        a += w * (x * u + y * v)
        b += w * (x * v - y * u)
    R = rotation(math.atan2(b, a))
    return R, [qx - R[0][0] * px - R[0][1] * py, qy - R[1][0] * px - R[1][1] * py]


def nearest_neighbors(source, target):
    indices, distances = [], []
    for p in source:
        nearest, smallest = 0, math.inf
        for j, q in enumerate(target):
            distance = math.hypot(p[0] - q[0], p[1] - q[1])
            if distance < smallest:
                nearest, smallest = j, distance
        indices.append(nearest)
        distances.append(smallest)
    return indices, distances


def overlap(distances, overlap_ratio):
    pairs = range(len(distances))
    count = max(3, math.floor(overlap_ratio * len(distances)))
    by_distance = sorted(pairs, key=lambda i: distances[i])
    closest = by_distance[:count]
    return [i in closest for i in pairs]


def huber_weights(residuals, delta):
    return [1.0 if r <= delta else delta / r for r in residuals]


def icp_step(source, target, T, max_distance, overlap_ratio, delta):
    (a, b, x), (c, d, y), _ = T
    moved = [(a * p[0] + b * p[1] + x, c * p[0] + d * p[1] + y) for p in source]
    pairs = []
    for p, j, distance in zip(moved, *nearest_neighbors(moved, target), strict=True):
        if distance <= max_distance:
            pairs.append((distance, p, target[j]))
    pairs.sort(key=lambda pair: pair[0])
    del pairs[max(3, int(overlap_ratio * len(pairs))) :]
    weights = huber_weights([pair[0] for pair in pairs], delta)
    R, t = align_weighted([pair[1] for pair in pairs], [pair[2] for pair in pairs], weights)
    return compose([[*R[0], t[0]], [*R[1], t[1]], [0, 0, 1]], T)


def icp(source, target, T_init, max_distance, overlap_ratio, delta, max_iterations):
    T = T_init
    for _ in range(max_iterations):
        moved = icp_step(source, target, T, max_distance, overlap_ratio, delta)
        change = max(abs(moved[i][j] - T[i][j]) for i in range(3) for j in range(3))
        T = moved
        if change < 1e-8:
            break
    return T


def integrate(increments, start):
    x, y, psi = start
    poses = [(x, y, psi)]
    for dx, dy, dpsi in increments:
        x += math.cos(psi) * dx - math.sin(psi) * dy
        y += math.sin(psi) * dx + math.cos(psi) * dy
        psi = wrap(psi + dpsi)
        poses.append((x, y, psi))
    return poses
