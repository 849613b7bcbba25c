"""Chapter 4: the cost of the loop, its order, its stops, gates that close, wrong headings."""

import numpy as np

from labkit import IcpParameters, Target, align, apply, icp, transform
from labkit.correspondences import huber_loss
from labkit.course.exercises import exercise
from labkit.course.exercises.se2 import look

R = np.array([0.9, 0.02, 0.3, 0.05, 2.0, 0.6, 0.15, 0.01, 0.4, 0.08, 0.7])


# fmt: off
@exercise("The cost that cannot rise", {
    "eleven pairs, of which the overlap keeps eight and the gate seven": (R, 0.5, 0.8, 0.1),
    "eleven pairs, of which the overlap keeps seven": (R, 0.35, 0.68, 0.1),
    "eleven pairs, of which the overlap keeps nine": (R, 0.65, 0.85, 0.2),
}, {
    "The sum is divided by the number of kept pairs. That number changes, and then the cost can "
    "rise; divide by all N.": {"/ len(distances)": "/ len(kept)"},
    "Pairs outside the gate are charged nothing, so the scan could lower its cost by losing pairs; "
    "charge them as if they stood on the gate.": {"np.minimum(kept, d_max)": "kept[kept <= d_max]"},
    "ρN is rounded up; round down.": {"[:int(": "[:1 + int("},
    "ρN is rounded to the nearest number; round down.": {"[:int(": "[:round("},
    "The trimming comes after the gate: ⌊ρN⌋ of *all* N pairs are in the sum.":
        lambda r, d, o, h: cost_of(r[r <= d], d, o, h) * (r <= d).mean(),
}, tolerance=1e-9)
def cost_of(distances, d_max, overlap_ratio, delta):
    """Trimmed, charged at most what stands on the gate, summed, divided by N."""
    kept = np.sort(distances)[:int(overlap_ratio * len(distances))]
    charged = np.minimum(kept, d_max)
    return huber_loss(charged, delta).sum() / len(distances)


def _turns():
    motions = {degrees: transform(0.3, 0.2, np.radians(degrees)) for degrees in (10.0, 25.0)}
    older = look(np.eye(3))
    return {f"a robot that turned by {d:g}°": (look(T), older) for d, T in motions.items()}


@exercise("Find the bug", _turns, {
    "The steps are in the wrong order: which one acts first?": {"dT @ T": "T @ dT"},
    "This is the last step alone; the answer is the product of all.": {"dT @ T": "dT"},
    "Each step is inverted; it maps source onto target.": {"dT @ T": "np.linalg.inv(dT) @ T"},
})
def colleagues_icp(source, target):
    """Each step acts after all before it."""
    p, T, search = source, np.eye(3), Target(target).search
    for _ in range(30):
        dT = align(p, target[search.query(p)[0]])
        p, T = apply(dT, p), dT @ T
    return T


@exercise("Any, or both", {
    "a run whose translation is small once by chance": (
        np.array([0.1, 0.02, 0.0005, 0.004, 0.002, 0.0008, 0.0004, 0.0]),
        np.array([0.2, 0.1, 0.05, 0.02, 0.0009, 0.003, 0.0002, 0.0]), 1e-3),
    "a run whose rotation is small first, and once exactly at the tolerance": (
        np.array([0.5, 0.25, 0.25, 0.25, 0.1, 0.1, 0.3, 0.1]),
        np.array([0.5, 0.5, 0.25, 0.1, 0.3, 0.2, 0.1, 0.1]), 0.25),
    "a run in which both are small at once, and only just": (
        np.array([0.5, 0.3, 0.9e-3, 0.1e-3]), np.array([0.4, 0.8e-3, 0.9e-3, 0.1e-3]), 1e-3),
}, {
    "They are exchanged: any holds first, both later.": lambda t, r, e: first_stops(t, r, e)[::-1],
    "These are the first of each kind; both have to be small at once.":
        {"smaller <": "translation_steps <", "larger <": "rotation_steps <"},
    "A step exactly at the limit is not small.": lambda t, r, e: first_stops(t, r, e * (1 + 1e-9)),
    "`argmin` finds the first False of a mask; `argmax` finds its first True.":
        {"argmax(smaller <": "argmin(translation_steps <",
         "argmax(larger <": "argmin(rotation_steps <"},
})
def first_stops(translation_steps, rotation_steps, tolerance):
    """First iterations at which the smaller of the two, and the larger, is small."""
    smaller = np.minimum(translation_steps, rotation_steps)
    larger = np.maximum(translation_steps, rotation_steps)
    return np.argmax(smaller < tolerance), np.argmax(larger < tolerance)


def _two_gates():
    T = transform(0.5, 0.2, 1.2)
    older, newer = look(np.eye(3)), look(T).copy()
    newer[::5] += (0.6, 0.3)  # what has moved between the scans
    T_guess = T @ transform(-0.3, -0.2, -0.1)
    return {
        f"gates of {a:g} m and {b:g} m": (newer, older, T_guess, (a, b))
        for a, b in ((1.0, 0.1), (0.8, 0.15), (0.15, 0.8))
    }


def _end(p, q, T, gate):
    return icp(p, q, T, IcpParameters(max_correspondence_distance=gate)).T_target_source


@exercise("Start wide, end narrow", _two_gates, {
    "Each run starts from the first guess again; start it from where the last one ended.":
        {"target, T, gate": "target, T_init, gate"},
    "The gates are sorted; take them in the order in which they are given.":
        {"in gates": "in sorted(gates, reverse=True)"},
    "The gates do not reach the runs: pass `IcpParameters(max_correspondence_distance=gate)`.":
        {"_end(source, target, T, gate)": "icp(source, target, T).T_target_source"},
    "The ends are multiplied; a run returns the whole motion, guess included.":
        {"T, gate)": "T, gate) @ T"},
}, tolerance=1e-9)
def match_through_gates(source, target, T_init, gates):
    """Each run from where the last one ended."""
    T = T_init
    for gate in gates:
        T = _end(source, target, T, gate)
    return T
