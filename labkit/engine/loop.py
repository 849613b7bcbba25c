"""The robust ICP loop of `labkit.icp`, compiled: one pair of scans, or many."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from labkit.approach import FEW, LONG
from labkit.arrays import BoolArray, FloatArray, IntArray
from labkit.correspondences import MIN_PAIRS
from labkit.engine.index import Index, Queries
from labkit.engine.jit import compiled, entry
from labkit.engine.nearest import build, find_nearest, no_partners
from labkit.engine.normals import normals_along_sweep, normals_in_space
from labkit.engine.pairs import (
    Pairs,
    Settings,
    associate,
    cost,
    empty_pairs,
    inliers,
    measure,
    near_gate,
    reject,
    weigh,
)
from labkit.engine.solve import (
    Step,
    align,
    align_to_lines,
    center_and_length,
    eigen,
    line_equations,
)

# How a run ended: the place of its `labkit.Termination` among these.
CONVERGED_POSE, CONVERGED_COST, BUDGET_SPENT, TOO_FEW_CORRESPONDENCES, DEGENERATE = range(5)
GOES_ON = -1


class Told(NamedTuple):
    """`labkit.IcpParameters`, as the loop reads them."""

    on_lines: bool
    approach: bool
    gate: float
    overlap_ratio: float
    huber_delta: float
    max_iterations: int
    translation_tolerance: float
    rotation_tolerance: float
    cost_tolerance: float
    step_fraction: float


class Prepared(NamedTuple):
    """A target: its points [m], its normals (none under point-to-point), and its index."""

    points: FloatArray
    normals: FloatArray
    search: Index


@entry
def prepare(points: FloatArray, in_order: bool, on_lines: bool) -> Prepared:
    """A target from the points of a scan, in beam order or not."""
    index = build(points)
    if not on_lines:
        return Prepared(points, np.empty((0, 2)), index)
    normals = normals_along_sweep(points) if in_order else normals_in_space(points, index)
    return Prepared(points, normals, index)


@entry
def prepare_with_normals(points: FloatArray, normals: FloatArray) -> Prepared:
    """A target whose normals are given."""
    return Prepared(points, normals, build(points))


@compiled
def told_by(numbers: FloatArray) -> Told:
    """The parameters from their numbers, in the order of `Told`: an array is handed over fast."""
    return Told(
        numbers[0] > 0.0,
        numbers[1] > 0.0,
        numbers[2],
        numbers[3],
        numbers[4],
        int(numbers[5]),
        numbers[6],
        numbers[7],
        numbers[8],
        numbers[9],
    )


@entry
def run(
    source: FloatArray,
    target: Prepared,
    parameters: FloatArray,
    poses: FloatArray,
    far_at: BoolArray,
    outcome: FloatArray,
    information: FloatArray,
) -> None:
    """Match with a target that was prepared; see `iterate`."""
    iterate(source, target, told_by(parameters), poses, far_at, outcome, information)


@entry
def prepare_and_run(
    source: FloatArray,
    points: FloatArray,
    in_order: bool,
    parameters: FloatArray,
    poses: FloatArray,
    far_at: BoolArray,
    outcome: FloatArray,
    information: FloatArray,
) -> None:
    """The same with a target that is matched once."""
    told = told_by(parameters)
    target = prepare(points, in_order, told.on_lines)
    iterate(source, target, told, poses, far_at, outcome, information)


@compiled
def iterate(
    source: FloatArray,
    target: Prepared,
    told: Told,
    poses: FloatArray,
    far_at: BoolArray,
    outcome: FloatArray,
    information: FloatArray,
) -> int:
    """The loop; the letters are the boxes of the flow chart, as in `labkit.icp.run`.

    ``poses[0]`` is the guess. The poses of all iterations go to `poses`, whether each was far
    to `far_at`. To `outcome`, shape (6,), go how the run ended and the steps it took, and of
    the last association the inliers, the fitness, the inlier RMSE [m] and the cost [m²]; to
    `information`, shape (5, 3), its eigenvalues, eigenvectors and (cx, cy, ℓ). Returns the steps.
    """
    whole, found = empty_pairs(len(source)), no_partners(target.search, source, poses[0])
    room = np.empty(len(source))
    k, far, before, motion_before = 0, told.approach, math.nan, 0.0
    while True:
        T, far_at[k] = poses[k], far
        settings = settings_of(told, far)
        every = max(1, len(source) // FEW) if far else 1
        pairs = first_pairs(whole, (len(source) - 1) // every + 1)
        associate(source, every, T, target.points, target.search, settings.gate, found, pairs)  # D
        measure(target.points, target.normals, told.on_lines, pairs)
        kept = reject(pairs, settings, room)  # E (A) (B)
        delta, share = weigh(pairs, settings, kept, room)  # E (C)
        now = cost(pairs, settings.gate, delta) if told.cost_tolerance > 0.0 else math.nan
        ending = check(poses, far_at, k, kept, before, now, told)  # H
        if ending == TOO_FEW_CORRESPONDENCES and matched(pairs, settings) >= MIN_PAIRS:
            ending = DEGENERATE  # matched, but to points that lie on no surface
        if ending == GOES_ON:
            step = minimise(pairs, target, told, share)  # F
            if step.solved:
                compose(step, T, poses[k + 1])  # G
            else:
                ending = DEGENERATE
        if ending != GOES_ON:
            break
        motion = displacement(source, T, poses[k + 1]) if far else 0.0
        far = far and is_far(motion, motion_before, told.huber_delta)
        k, before, motion_before = k + 1, now, motion
    outcome[0], outcome[1] = ending, k
    outcome[2], outcome[4] = inliers(pairs)
    outcome[3] = outcome[2] / len(pairs.x)
    outcome[5] = cost(pairs, settings.gate, delta)
    inform(pairs, target, told, information)
    return k


@compiled
def settings_of(told: Told, far: bool) -> Settings:
    """The settings of an iteration; see `labkit.approach.settings_of`."""
    gate = told.gate
    if told.approach and not far:
        gate = near_gate(gate, told.huber_delta)
    return Settings(told.on_lines, far, gate, told.overlap_ratio, told.huber_delta)


@compiled
def first_pairs(pairs: Pairs, count: int) -> Pairs:
    """Room for `count` pairs within that of `pairs`."""
    x, y, row, distance, residual, closest, weight = pairs
    return Pairs(
        x[:count],
        y[:count],
        row[:count],
        distance[:count],
        residual[:count],
        closest[:count],
        weight[:count],
    )


@compiled
def check(
    poses: FloatArray,
    far_at: BoolArray,
    k: int,
    kept: int,
    cost_before: float,
    cost_now: float,
    told: Told,
) -> int:
    """(H) Whether to stop after step k, and why; see `labkit.icp.check`."""
    ending = GOES_ON if k < told.max_iterations else BUDGET_SPENT
    if k > 0 and not far_at[k - 1]:
        moved, turned = step_length(poses[k - 1], poses[k])
        if moved < told.translation_tolerance and turned < told.rotation_tolerance:
            return CONVERGED_POSE
        if abs(cost_now - cost_before) < told.cost_tolerance:
            ending = CONVERGED_COST
    return ending if kept >= MIN_PAIRS else TOO_FEW_CORRESPONDENCES


@compiled
def step_length(T_before: FloatArray, T: FloatArray) -> tuple[float, float]:
    """How far a pose moved, |Δt| [m], and turned, |Δψ| [rad]."""
    moved = math.hypot(T[0, 2] - T_before[0, 2], T[1, 2] - T_before[1, 2])
    c = T_before[0, 0] * T[0, 0] + T_before[1, 0] * T[1, 0]
    s = T_before[0, 1] * T[0, 0] + T_before[1, 1] * T[1, 0]
    return moved, abs(math.atan2(s, c))


@compiled
def matched(pairs: Pairs, settings: Settings) -> int:
    """How many pairs pass gate and overlap, with a residual or without."""
    x, y, row, distance, _, closest, _ = pairs
    weight, room = np.empty(len(x)), np.empty(len(x))
    return reject(Pairs(x, y, row, distance, distance, closest, weight), settings, room)


@compiled
def minimise(pairs: Pairs, target: Prepared, told: Told, share: float) -> Step:
    """(F) The step that best moves the kept pairs together under their metric."""
    if told.on_lines:
        step = align_to_lines(pairs, target.points, target.normals, share)
    else:
        step = align(pairs, target.points)
    return shorten(step, pairs, told.step_fraction) if told.step_fraction < 1.0 else step


@compiled
def shorten(step: Step, pairs: Pairs, fraction: float) -> Step:
    """The same motion, seen from the kept points' centroid, but less far."""
    count, x, y = 0, 0.0, 0.0
    for i in range(len(pairs.x)):
        if pairs.weight[i] > 0.0:
            count, x, y = count + 1, x + pairs.x[i], y + pairs.y[i]
    x, y = x / count, y / count
    c, s = math.cos(step.turn), math.sin(step.turn)
    dx, dy = fraction * (c * x - s * y + step.x - x), fraction * (s * x + c * y + step.y - y)
    turn = fraction * step.turn
    c, s = math.cos(turn), math.sin(turn)
    return Step(turn, x + dx - (c * x - s * y), y + dy - (s * x + c * y), step.solved)


@compiled
def compose(step: Step, T: FloatArray, T_next: FloatArray) -> None:
    """(G) T_next = dT @ T: the update composes on the left."""
    c, s = math.cos(step.turn), math.sin(step.turn)
    for k in range(3):
        T_next[0, k] = c * T[0, k] - s * T[1, k]
        T_next[1, k] = s * T[0, k] + c * T[1, k]
        T_next[2, k] = T[2, k]
    T_next[0, 2] += step.x
    T_next[1, 2] += step.y


@compiled
def displacement(points: FloatArray, T_before: FloatArray, T: FloatArray) -> float:
    """How far a step moved the points, root mean square [m]."""
    a, b, x = T[0, 0] - T_before[0, 0], T[0, 1] - T_before[0, 1], T[0, 2] - T_before[0, 2]
    c, d, y = T[1, 0] - T_before[1, 0], T[1, 1] - T_before[1, 1], T[1, 2] - T_before[1, 2]
    total = 0.0
    for i in range(len(points)):
        u = a * points[i, 0] + b * points[i, 1] + x
        v = c * points[i, 0] + d * points[i, 1] + y
        total += u * u + v * v
    return math.sqrt(total / len(points))


@compiled
def is_far(motion: float, motion_before: float, huber_delta: float) -> bool:
    """Whether the next step is likely to be long; see `labkit.approach.is_far`."""
    shrinks = motion / motion_before if motion < motion_before else 1.0
    return shrinks * motion > LONG * huber_delta


@compiled
def inform(pairs: Pairs, target: Prepared, told: Told, information: FloatArray) -> None:
    """Eigenvalues and eigenvectors of A per unit of weight, and (cx, cy, ℓ) that it is about.

    NaN where nothing can be said.
    """
    for i in range(5):
        for j in range(3):
            information[i, j] = math.nan
    if told.on_lines:
        total, cx, cy, length = center_and_length(pairs)
        if length > 0.0:
            equations = line_equations(pairs, target.points, target.normals, cx, cy, length)
            values, vectors = eigen(equations)
            for i in range(3):
                information[0, i] = values[i, i] / total
                for j in range(3):
                    information[1 + i, j] = vectors[i, j]
            information[4, 0], information[4, 1], information[4, 2] = cx, cy, length


# ---------------------------------------------------------------- many pairs


@entry
def run_stretch(
    points: FloatArray,
    begin: IntArray,
    in_order: BoolArray,
    pairs: IntArray,
    guesses: FloatArray,
    parameters: FloatArray,
    poses: FloatArray,
    outcomes: FloatArray,
    information: FloatArray,
) -> None:
    """Match scan ``pairs[k, 0]`` against scan ``pairs[k, 1]`` for each k; see `iterate`.

    Scan j is ``points[begin[j] : begin[j + 1]]``. Of each match, the final pose goes to
    `poses`, shape (K, 3, 3), the rest to `outcomes` and `information`.
    """
    told = told_by(parameters)
    way = np.empty((told.max_iterations + 1, 3, 3))
    far_at = np.empty(told.max_iterations + 1, np.bool_)
    for k in range(len(pairs)):
        newer, older = pairs[k]
        source = points[begin[newer] : begin[newer + 1]]
        scan = points[begin[older] : begin[older + 1]]
        target = prepare(scan, in_order[older], told.on_lines)
        put(guesses[k], way[0])
        steps = iterate(source, target, told, way, far_at, outcomes[k], information[k])
        put(way[steps], poses[k])


@compiled
def put(T: FloatArray, place: FloatArray) -> None:
    """``place[:] = T``, which takes numba seconds longer to compile."""
    for i in range(3):
        for j in range(3):
            place[i, j] = T[i, j]


@entry
def nearest_rows(points: FloatArray, target: FloatArray) -> IntArray:
    """The row of the nearest target point of each point."""
    count = len(points)
    asked, row = np.empty(count, np.intp), np.empty(count, np.intp)
    for i in range(count):
        asked[i], row[i] = i, -1
    x, y = points[:, 0].copy(), points[:, 1].copy()
    queries = Queries(x, y, math.inf, asked, row, np.empty(count), np.empty(count))
    find_nearest(build(target), target, queries)
    return row
