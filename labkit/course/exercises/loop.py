"""Chapter 4: the cost of the loop, its order, its stops, gates that close, wrong headings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from labkit import IcpParameters, Target, align, apply, icp, to_xytheta, transform, wrap
from labkit.arrays import FloatArray
from labkit.correspondences import huber_loss
from labkit.course.exercises.exercise import Case, exercise
from labkit.simulation import Lidar, cast, room


@exercise("The cost that cannot rise")
def cost_of() -> Iterator[Case]:
    """For distances on both sides of δ, of the gate and of the overlap."""
    r = np.array([0.9, 0.02, 0.3, 0.05, 2.0, 0.6, 0.15, 0.01, 0.4, 0.08, 0.7])
    d_max, ratio, delta = 0.5, 0.8, 0.1
    closest = sorted(r)[:8]  # ⌊0.8 · 11⌋
    charged = huber_loss(np.minimum(closest, d_max), delta)
    inside = huber_loss([each for each in closest if each <= d_max], delta)
    yield Case(
        "eleven pairs, of which the overlap keeps eight and the gate seven",
        (r, d_max, ratio, delta),
        float(charged.sum() / 11),
        {
            "The sum is divided by the number of kept pairs. That number changes, and then the "
            "cost can rise; divide by all N.": float(charged.sum() / 8),
            "Pairs outside the gate are charged nothing, so the scan could lower its cost by "
            "losing pairs; charge them as if they stood on the gate.": float(inside.sum() / 11),
            "These are plain squares; Huber's loss grows linearly beyond δ.": float(
                (np.minimum(closest, d_max) ** 2).sum() / 11
            ),
            "All pairs are in the sum; only the closest ⌊ρN⌋ are.": float(
                huber_loss(np.minimum(r, d_max), delta).sum() / 11
            ),
        },
        tolerance=1e-9,
    )


@exercise("Find the bug")
def colleagues_icp() -> Iterator[Case]:
    """For robots that turned by so much that the order of the steps matters."""
    for degrees in (10.0, 25.0):
        T = transform(0.3, 0.2, np.radians(degrees))
        older, newer = _look(np.eye(3)), _look(T)
        yield Case(
            f"a robot that turned by {degrees:g}°",
            (newer, older),
            _steps(newer, older, left=True),
            {
                "The steps are multiplied in the wrong order: each `dT` acts after all before it, "
                "so it stands on the left.": _steps(newer, older, left=False),
                "This is the last step alone; the answer is the product of all.": _steps(
                    newer, older, left=True, last=True
                ),
            },
        )


@exercise("Any, or both")
def first_stops() -> Iterator[Case]:
    """For steps of which one kind is small long before the other."""
    translation = np.array([0.1, 0.02, 0.0005, 0.004, 0.002, 0.0008, 0.0004, 0.0])
    rotation = np.array([0.2, 0.1, 0.05, 0.02, 0.0009, 0.003, 0.0002, 0.0])
    yield Case(
        "a run whose translation is small once by chance",
        (translation, rotation, 1e-3),
        (2, 6),
        {
            "The two are exchanged: any holds first, both later.": (6, 2),
            "These are the first small steps of each kind; both have to be small in the *same* "
            "iteration.": (2, 4),
            "These count from 1; an index counts from 0.": (3, 7),
        },
    )


@exercise("Start wide, end narrow")
def match_through_gates() -> Iterator[Case]:
    """In a room, from a guess that the narrow gate alone cannot mend."""
    T = transform(0.5, 0.2, 0.1)
    older, newer = _look(np.eye(3)), _look(T)
    guess, gates = transform(-0.1, 0.0, 0.0), (1.0, 0.1)
    yield Case(
        "gates of 1 m and 0.1 m",
        (newer, older, guess, gates),
        _through(newer, older, guess, gates),
        {
            "Each run starts from the first guess again; start it from where the last one "
            "ended.": _through(newer, older, guess, gates[1:]),
            "The narrow gate comes first; take the gates in their order.": _through(
                newer, older, guess, gates[::-1]
            ),
        },
        tolerance=1e-7,
    )


@exercise("How far the heading may be off")
def headings_that_work() -> Iterator[Case]:
    """In a room, from headings of which some lead home and some do not."""
    T = transform(0.8, -0.6, 0.5)
    older, newer = _look(np.eye(3)), _look(T)
    told = IcpParameters(max_correspondence_distance=0.5)
    errors = np.radians([-120.0, -8.0, 0.0, 8.0, 120.0])
    turned = _headings(newer, older, [T @ transform(0.0, 0.0, each) for each in errors], told)
    off = np.abs(wrap(turned - 0.5))
    yield Case(
        "guesses that are turned by −120°, −8°, 0°, 8° and 120°",
        (newer, older, T, errors, told),
        off < np.radians(2.0),
        {
            "This asks how far a run went from its guess; ask how far its end is from the "
            "truth.": np.abs(wrap(turned - 0.5 - errors)) < np.radians(2.0),
            "A heading is compared with 2 as if it were in degrees; it is in radians.": off < 2.0,
            "These are the runs that end at a wrong heading.": off >= np.radians(2.0),
        },
    )


@exercise("The price of a lost pair")
def change_of_both() -> Iterator[Case]:
    """For a pair that leaves the gate, and for one that comes in."""
    for where, before, after in (
        ("a pair that leaves the gate", [0.1, 0.2, 0.4], [0.1, 0.2, 0.9]),
        ("a pair that comes in through the gate", [0.3, 0.1, 0.8, 0.6], [0.2, 0.1, 0.4, 0.7]),
    ):
        d = np.array([before, after])
        charged = np.minimum(d, 0.5) ** 2
        kept = np.array([np.mean(row[row <= 0.5] ** 2) for row in d])
        inside = np.where(d <= 0.5, d**2, 0.0)
        yield Case(
            where,
            (d[0], d[1], 0.5),
            (float(np.diff(kept)[0]), float(np.diff(charged.mean(axis=1))[0])),
            {
                "The signs are wrong: a change is the value after the step minus the value "
                "before.": (float(-np.diff(kept)[0]), float(-np.diff(charged.mean(axis=1))[0])),
                "The cost charges nothing for a pair outside the gate; charge it as if it stood "
                "on the gate.": (float(np.diff(kept)[0]), float(np.diff(inside.mean(axis=1))[0])),
                "The mean square is divided by all pairs; divide it by the pairs within the "
                "gate.": (
                    float(np.diff(inside.mean(axis=1))[0]),
                    float(np.diff(charged.mean(axis=1))[0]),
                ),
            },
            tolerance=1e-9,
        )


def _headings(
    p: FloatArray, q: FloatArray, guesses: Sequence[FloatArray], told: IcpParameters
) -> FloatArray:
    ends = [icp(p, q, guess, told).T_target_source for guess in guesses]
    return to_xytheta(np.array(ends))[:, 2]


def _through(p: FloatArray, q: FloatArray, T: FloatArray, gates: Sequence[float]) -> FloatArray:
    for gate in gates:
        T = icp(p, q, T, IcpParameters(max_correspondence_distance=gate)).T_target_source
    return T


def _steps(p: FloatArray, q: FloatArray, *, left: bool, last: bool = False) -> FloatArray:
    """The product of thirty steps, in the right order or the wrong one, or the last step."""
    target, total = Target(q), np.eye(3)
    for _ in range(30):
        dT = align(p, target.points[target.search.query(p)[0]])
        p = apply(dT, p)
        total = dT @ total if left else total @ dT
    return dT if last else total


def _look(T_first_scanner: FloatArray) -> FloatArray:
    scanner = Lidar(beam_count=361, field_of_view=2 * np.pi)
    return cast(room(), transform(1.0, -0.5, 0.3) @ T_first_scanner, scanner, rng=8).points
