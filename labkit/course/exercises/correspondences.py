"""Chapter 3: which points make a pair, and how much a pair may pull."""

import numpy as np

from labkit import Target, align, apply, invert, transform
from labkit.course.exercises import exercise
from labkit.simulation import Lidar, cast, room


# fmt: off
@exercise("The gate as a loss", {
    "a gate of 0.5 m": (np.array([0.0, 0.1, 0.3, 0.5, 0.8, 3.0]), 0.5),
    "a gate of 2 m": (np.array([1.5, 4.0, 2.0, 0.3]), 2.0),
}, {
    "A pair beyond the gate is charged nothing. Then the scan could lower its cost by losing "
    "pairs; charge d_max² instead.": {"np.minimum(r, d_max) ** 2": "r**2 * (r <= d_max)"},
    "These are Huber's weights; beyond the gate the slope is 0.":
        {"r <= d_max": "d_max / np.maximum(r, d_max)"},
    "The square is held against d_max; both are squares, d_max² is the limit.":
        {"(r, d_max) ** 2": "(r**2, d_max)"},
    "The weights are the losses' slope in r; asked for is the slope in s = r².":
        {"r <= d_max": "2 * r * (r <= d_max)"},
    "A pair right on the gate has lost its weight; the gate is r ≤ d_max.":
        {"r <= d_max": "r < d_max"},
})
def truncated_square(r, d_max):
    """Two lines."""
    loss, weight = np.minimum(r, d_max) ** 2, r <= d_max
    return loss, weight * 1.0


def _sharing():
    rng = np.random.default_rng(6)
    q = rng.uniform(0.0, 5.0, (30, 2))
    p = np.vstack([q[:20] + rng.normal(0.0, 0.2, (20, 2)), rng.uniform(6.0, 8.0, (10, 2))])
    return {"30 points, ten of them without a partner": (p, q)}


@exercise("Mutual pairs", _sharing, {
    "This asks whether a partner is nobody else's. A far point can have one, too; search back.":
        {"rows == back[there]": "(there[:, None] == there).sum(1) == 1"},
    "`back[there]` is a source point: compare it with the one that it began with, not its partner.":
        {"rows == back": "there == back"},
    "`there` and `back` are compared entry by entry; they count different points.":
        {"rows == back[there]": "there == back"},
})
def mutual_pairs(p, q):
    """From the table of all distances."""
    gaps = np.hypot(*(p[:, None] - q).transpose(2, 0, 1))
    there, back = gaps.argmin(axis=1), gaps.argmin(axis=0)
    rows = np.arange(len(p))
    return rows == back[there]


def _two_guesses():
    older, newer = (
        cast(room(), transform(1.0, -0.5, 0.3) @ T, Lidar(beam_count=181), rng=seed).points
        for seed, T in enumerate((np.eye(3), transform(0.3, 0.1, 0.15)))
    )
    back = apply(invert(transform(0.4, -0.2, 1.0)), newer)
    spoiled = newer.copy()
    spoiled[::2] += np.linspace(0.05, 0.6, len(spoiled[::2]))[:, None]  # what moved in between
    return {
        "no guess": (newer, older, np.eye(3)),
        "a guess": (newer, older, transform(0.2, 0.0, 0.1)),
        "half of the points moved": (spoiled, older, transform(0.2, 0.0, 0.1)),
        "a robot that has turned far": (back, older, transform(0.3, -0.2, 0.95)),
    }


@exercise("A gate that follows the data", _two_guesses, {
    "The gate is thrice the *mean*, which far points pull up.": {"np.median(d)": "d.mean()"},
    "No pair is rejected: align only those within the gate.": {"3 * np.median(d)": "np.inf"},
    "The step is on the wrong side: it acts after `T`, `dT @ T`.": {"dT @ T": "T @ dT"},
    "The gate is three times the median of the *squares*; distances are in metres.":
        {"np.median(d)": "np.median(d**2)"},
    "The gate is found once, at the guess; it follows the distances in each round.":
        {"(target).search": "(target).search\n    first = search.query(apply(T, source))[1]",
         "np.median(d)": "np.median(first)"},
})
def match_by_median_gate(source, target, T_init):
    """Sixty rounds."""
    T, search = T_init, Target(target).search
    for _ in range(60):
        moved = apply(T, source)
        index, d = search.query(moved)
        near = d <= 3 * np.median(d)
        dT = align(moved[near], target[index[near]])
        T = dT @ T
    return T
