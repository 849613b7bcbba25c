"""Chapter 9: what its problems ask for in code, beside the argument on paper."""

import math

import numpy as np

from labkit import IcpParameters, align, apply, icp, transform
from labkit.course.exercises import exercise
from labkit.se2 import rotation
from labkit.simulation import Lidar, World, cast
from labkit.simulation.world import circle


def _pairs():
    rng = np.random.default_rng(9)
    p = rng.uniform([-4.0, -3.0], [4.0, 3.0], (12, 2))
    q = apply(transform(0.6, -0.2, 2.4), p) + rng.normal(0.0, 0.2, p.shape)
    return p, q, rng.uniform(0.1, 1.0, len(p))


P, Q, W = _pairs()


# fmt: off
@exercise("The best translation beside a prior", {
    "a prior as heavy as the pairs": (rotation(0.8), P, Q, W, np.array([2.0, -1.0]), W.sum()),
    "a light prior": (rotation(-2.0), P, Q, W, np.array([-3.0, 4.0]), 0.5),
}, {
    "The pairs weigh 1 against the prior; together they weigh W = Σw.":
        {"W * t_pairs": "t_pairs", "(W + w_prior)": "(1 + w_prior)"},
    "The centroids are those of pairs of equal weight; use the weighted ones.":
        {"w @ p / W": "p.mean(0)", "w @ q / W": "q.mean(0)"},
    "This is the mean of the two; each counts by its weight.":
        lambda R, p, q, w, t, v: (t + translation_with_prior(R, p, q, w, t, 0.0)) / 2,
})
def translation_with_prior(R, p, q, w, t_prior, w_prior):
    """The weighted mean of what the pairs say and of the prior."""
    W = w.sum()
    p_mean = w @ p / W
    q_mean = w @ q / W
    t_pairs = q_mean - R @ p_mean
    return (W * t_pairs + w_prior * t_prior) / (W + w_prior)


@exercise("A turn about a known point", {
    "a turn about the origin": (P, Q, np.zeros(2)),
    "a turn about (3, −1)": (P, Q, np.array([3.0, -1.0])),
}, {
    "The points are centred on their means; a turn about c is seen from c.":
        lambda p, q, c: turn_about_known(p - p.mean(0), q - q.mean(0), 0 * c),
    "The turn is about the origin; subtract c from both.":
        lambda p, q, c: turn_about_known(p, q, 0 * c),
    "`atan` of b / a loses half of the angles: use `atan2(b, a)`.":
        {"np.arctan2(b, a)": "np.arctan(b / a)"},
})
def turn_about_known(p, q, c):
    """The top of the cosine, seen from c."""
    x, y = p - c, q - c
    a = (x * y).sum()
    b = np.linalg.det(np.stack([x, y], axis=1)).sum()
    return np.arctan2(b, a)


def _van():
    rng = np.random.default_rng(5)
    p = rng.uniform([-5.0, -4.0], [5.0, 4.0], (40, 2))
    q = p + rng.normal(0.0, 0.01, p.shape)
    q[:12] += (0.8, 0.0)
    shares = (0.7, 0.95, 0.64, 0.44)
    return {f"{share:.0%} of 40 pairs, 12 on a van": (p, q, share) for share in shares}


@exercise("Trimmed alignment", _van, {
    "The worst pairs are kept: sort from small to large.": {"argsort(r)": "argsort(-r)"},
    "ρN is rounded; round it down.": [
        {"int(ratio * len(p))": "round(ratio * len(p))"},
        {"int(ratio * len(p))": "math.ceil(ratio * len(p))"}],
    "The pairs are sorted by their distance before the motion: move the points first.":
        {"apply(T, p)": "p"},
})
def trimmed_alignment(p, q, ratio):
    """Align, sort, keep; thirty times."""
    order = np.arange(len(p))
    for _ in range(30):
        T = align(p[order], q[order])
        r = np.hypot(*(apply(T, p) - q).T)
        order = np.argsort(r)[:int(ratio * len(p))]
    return T


def _avenue():
    spots = [(x, y) for x in range(-20, 21, 2) for y in (-1.5, 1.5)]
    trees = World(segments=np.concatenate([circle(spot, 0.2) for spot in spots]))
    lidar = Lidar(field_of_view=2 * np.pi, beam_count=720)
    older = cast(trees, np.eye(3), lidar, rng=1)
    newer = cast(trees, transform(0.4, 0.0, 0.0), lidar, rng=2)
    offsets = (0.9, 1.2, -1.5)
    return {f"a guess {offset:g} m off": (newer, older, 0.4, offset) for offset in offsets}


@exercise("Along the avenue", _avenue, {
    "This is where the run ends; asked for is how far that is from the truth.":
        {"T_target_source[0, 2] - x_true": "T_target_source[0, 2]"},
    "The gate is the usual one; give `icp` the gate of 1 m.":
        {"max_correspondence_distance=1.0": ""},
})
def along_the_avenue(source, target, x_true, offset):
    """Error and RMSE from a guess that is off."""
    parameters = IcpParameters(max_correspondence_distance=1.0)
    match = icp(source, target, transform(x_true + offset, 0.0, 0.0), parameters)
    return match.T_target_source[0, 2] - x_true, match.inlier_rmse


@exercise("How fast a heading drifts", {
    "200 steps of 0.5 m": (200, 0.5, math.radians(0.3)), "3 steps of 2 m": (3, 2.0, 0.01),
}, {
    "The errors are counted as if each turned all of the path: s σ n^{3/2}, without the 3.":
        lambda n, s, sigma: s * sigma * n**1.5,
    "This is the sum of the standard deviations; independent errors add as squares.":
        {"math.sqrt(sum(squares))": "sum(range(n))"},
    "This is the error of the heading's own sum; each error is counted once for each later step.":
        {"m**2": "1"},
})
def sideways_std(n, s, sigma):
    """Each error as often as there are steps after it."""
    squares = [m**2 for m in range(n)]
    return s * sigma * math.sqrt(sum(squares))


@exercise("How narrow a wedge may be", {
    "an angle of 10°": (math.radians(10),), "an angle of 90°": (math.pi / 2,),
    "an angle of 150°": (math.radians(150),),
}, {
    "This is the larger eigenvalue.": {")[0]": ")[1]"},
    "Beyond 90° the walls get narrower again: take the size of the cosine.":
        lambda alpha: (1 - math.cos(alpha)) / 2,
    "This is α²/4, the first term alone.": lambda alpha: alpha**2 / 4,
    "This is the determinant, the product of both eigenvalues.": lambda a: math.sin(a) ** 2 / 4,
})
def weakest_information(alpha):
    """From the matrix."""
    c, s = math.cos(alpha), math.sin(alpha)
    n = np.array([[0.0, 1.0], [-s, c]])
    return np.linalg.eigvalsh(n.T @ n / 2)[0]


@exercise("The error that is left", {"3 pairs": (3, 0.01), "200 pairs": (200, 0.02)}, {
    "This is the RMSE at the true motion: the fit takes 3 of the 2N numbers.": {"* N - 3": "* N"},
    "Each pair has two numbers, not one: 2N − 3 are left.": {"2 * N": "N"},
    "The motion has three numbers, not two.": {"- 3": "- 2"},
    "This divides by 2N numbers; the RMSE is over N pairs.": {" / N": " / (2 * N)"},
})
def expected_rmse(N, sigma):
    """Of 2N numbers three are fitted."""
    free = 2 * N - 3
    return sigma * math.sqrt(free / N)


@exercise("The way back", {
    "a turn of 2.2 rad": (-3.0, 4.0, np.array([1.0, 2.0]), np.array([-0.5, 0.3])),
    "a turn of −0.6 rad": (8.0, -5.5, np.array([0.0, -1.0]), np.array([2.0, 1.0])),
}, {
    "This is the alignment of p onto q; asked for is that of q onto p.":
        lambda a, b, p, q: transform(*(q - rotation(math.atan2(b, a)) @ p), math.atan2(b, a)),
    "The target's centroid is not turned: t = p̄ − R q̄.": {"R @ q_mean": "q_mean"},
})
def backward_alignment(a, b, p_mean, q_mean):
    """Of the sums, b changes its sign."""
    angle = math.atan2(-b, a)
    R = rotation(angle)
    return transform(*(p_mean - R @ q_mean), angle)


@exercise("A gate from first principles", {
    "the numbers of the problem": (0.01, 0.05, 0.1, math.radians(3.0), 6.0),
    "noise alone": (0.02, 0.0, 0.0, 0.0, 6.0), "a turn alone": (0.0, 0.0, 0.0, 1.2, 6.0),
}, {
    "The noise is that of one scan; both scans have it, so it is √2 σ.": {"math.sqrt(2.0)": "1.0"},
    "The turn is the arc; a point moves along the chord.":
        {"2.0 * reach * math.sin(angle / 2.0)": "reach * angle"},
    "Noise and spacing stand at right angles on a wall that faces the beam; elsewhere they add up.":
        {"noise + spacing / 2.0": "math.hypot(noise, spacing / 2.0)"},
    "This adds the noise of the two scans; the variances of independent errors add: √2 σ.":
        {"math.sqrt(2.0)": "2.0"},
    "The spacing counts half: a point between two others is at most half of it away.":
        {"spacing / 2.0": "spacing"},
})
def first_gate(sigma, spacing, offset, angle, reach):
    """Sum of the error that the guess may have and of what the scans add."""
    noise = 3.0 * math.sqrt(2.0) * sigma
    chord = 2.0 * reach * math.sin(angle / 2.0)
    return offset + chord + noise + spacing / 2.0
