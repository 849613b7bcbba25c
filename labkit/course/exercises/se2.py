"""Chapter 1: motions of the plane, and the order in which they chain."""

import numpy as np

from labkit import IcpParameters, Target, align, apply, icp, invert, transform
from labkit.course.exercises import exercise
from labkit.se2 import rotation
from labkit.simulation import Lidar, cast, room


# fmt: off
@exercise("Motion between two poses", {
    "a robot that bends left": (transform(2.0, 1.0, 0.5), transform(2.4, 1.3, 0.9)),
    "a robot that bends right": (transform(1.0, 0.0, 1.6), transform(1.1, 1.0, 1.4)),
}, {
    "This is the motion seen from the world: let equal letters meet.": lambda k, k1: k1 @ invert(k),
    "The inverse is missing: in `T_w_k @ T_w_k1` letters `k` and `w` meet.": lambda k, k1: k @ k1,
    "The (3, 3) is transposed; that inverts a rotation, not a transform.": lambda k, k1: k.T @ k1,
    "The translation is along the *world's* axes, not the robot's.": {"R.T @ moved": "moved"},
    "The matrices are multiplied entry by entry (`*`); the product is `@`.":
        lambda k, k1: invert(k) * k1,
    "The headings are subtracted the wrong way round: it is the newer one minus the older one.":
        {"R.T @ T_w_k1[:2, :2]": "T_w_k1[:2, :2].T @ R"},
})
def motion_between(T_w_k, T_w_k1):
    """Positions are turned into the older frame, headings subtracted: as (R, t)."""
    R, moved = T_w_k[:2, :2], T_w_k1[:2, 2] - T_w_k[:2, 2]
    return R.T @ T_w_k1[:2, :2], R.T @ moved


@exercise("Turn about a point", {
    "a turn by 0.7 rad about (2, −1)": (np.array([2.0, -1.0]), 0.7),
    "a turn by −2 rad about (0.5, 3)": (np.array([0.5, 3.0]), -2.0),
}, {
    "This turns about the origin; bring `c` there first.": lambda c, a: turn_about(0 * c, a),
    "The plane is turned about the origin, then moved by `c`.": lambda c, a: transform(*c, a),
    "`c` is brought to the origin and the plane turned, but `c` is not brought back.":
        lambda c, a: transform(0, 0, a) @ transform(*-c, 0),
    "Both sines have the same sign; above the diagonal of R it is −sin θ.":
        lambda c, a: _about(c, np.cos(a), np.sin(a), np.sin(a)),
    "Sine and cosine are swapped: at angle 0, R is the identity.":
        lambda c, a: _about(c, np.sin(a), -np.cos(a), np.cos(a)),
})
def turn_about(c, theta):
    """The point c stays where it is."""
    return transform(*(c - rotation(theta) @ c), theta)


def _about(c, diagonal, above, below):
    """The motion by a matrix with these entries that keeps the point c."""
    R = np.array([[diagonal, above], [below, diagonal]])
    return np.block([[R, (c - R @ c)[:, None]], [np.array([0.0, 0.0, 1.0])]])


def look(T_first_scanner, beams=361, seed=8):
    """Points [m] that a scanner which sees all round finds in a room."""
    scanner = Lidar(beam_count=beams, field_of_view=2 * np.pi)
    return cast(room(), transform(1.0, -0.5, 0.3) @ T_first_scanner, scanner, rng=seed).points


def _two_looks():
    older = look(np.eye(3), 181, 0)
    newer = look(transform(0.1, 0.05, 0.05), 181, 1)
    return {f"a gate of {gate:g} m": (newer, older, gate) for gate in (0.05, 2.0)}


@exercise("A gate and what it reports", _two_looks, {
    "The gate does not reach the run: it is `max_correspondence_distance` of "
    "`labkit.IcpParameters`, and these are the `parameters=`.":
        {"max_correspondence_distance=gate": ""},
    "The first number is `fitness`, the share that was kept; the count is `inlier_count`.":
        {"run.inlier_count": "run.fitness"},
    "The first number counts all points; asked for are those that were kept.":
        {"run.inlier_count": "len(source)"},
})
def match_and_count(source, target, gate):
    """Both numbers stand in the result."""
    run = icp(source, target, parameters=IcpParameters(max_correspondence_distance=gate))
    return run.inlier_count, run.inlier_rmse


def _three_turns():
    cases, older = {}, look(np.eye(3), 361, 0)
    for degrees in (0.0, 90.0, 180.0):
        T = transform(0.35, 0.10, np.radians(degrees))
        guess = transform(0.0, 0.0, np.radians(8.0)) @ T
        cases[f"a robot that turns by {degrees:g}°"] = (look(T, 361, 1), older, guess, 15)
    far = transform(5.0, -3.0, 0.2)
    return cases | {"one round, far from the origin": (look(T), apply(far, older), far @ guess, 1)}


@exercise("Your first loop", _three_turns, {
    "The step is composed on the wrong side, `T @ dT`. It was estimated in the target's frame, so "
    "it acts after `T`: `dT @ T`.": {"dT @ T": "T @ dT"},
    "The pairs are those of the unmoved points: move them by `T` first.":
        {"apply(T, source)": "source"},
    "This is the last step alone, `T = dT`; chain them, `dT @ T`.": {"dT @ T": "dT"},
    "Source and target are swapped in `align`: it maps its first points onto its second.":
        {"dT @ T": "invert(dT) @ T"},
    "This is the motion since the guess alone.": {"return T": "return T @ invert(T_init)"},
    "The loop begins without the guess: begin with `T = T_init`.":
        {"T, search = T_init,": "T, search = np.eye(3),"},
}, tolerance=lambda p, q, T, rounds: 0.02 if rounds > 1 else 1e-6)
def icp_by_hand(source, target, T_init, rounds=15):
    """Each loop that converges ends within the tolerance of this one."""
    T, search = T_init, Target(target).search
    for _ in range(rounds):
        moved = apply(T, source)
        dT = align(moved, target[search.query(moved)[0]])
        T = dT @ T
    return T
