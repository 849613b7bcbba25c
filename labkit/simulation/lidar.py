"""A planar laser scanner that looks into a simulated world, beam by beam."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from labkit.scan import Scan
from labkit.se2 import matrices_of, relative, to_xytheta
from labkit.simulation.world import World
from labkit.support.arrays import (
    MAX_DISTANCE,
    FloatArray,
    as_generator,
    as_pose,
    as_poses,
    as_stamps,
    as_transform,
    check_count,
    check_kind,
    check_range,
)

MAX_BEAM_COUNT = 1_000_000
SCAN_PERIOD = 0.1  # [s] between two scans to which the caller gives no stamps


@dataclass(frozen=True, kw_only=True)
class Lidar:
    """The properties of a scanner.

    The defaults are the lesson's: 270° and 10 m with 1 cm of noise. 541 beams make the
    step 0.5°, every second beam of a common 270° scanner.

    Attributes
    ----------
    beam_count : int
        Number of beams of a scan.
    field_of_view : float
        Angle in radians in (0, 2π] from the first beam to the last, half of it to either
        side of straight ahead. At 2π the last beam stops one step short of the first.
    range_min, range_max : float
        Metres. A measurement that is not strictly between them is a no-return; an object
        nearer than `range_min` still hides those behind it.
    noise_std : float
        Standard deviation in metres of the Gaussian noise along the beam.
    dropout_ratio : float
        The fraction in [0, 1] of beams that never come back.

    Examples
    --------
    >>> np.degrees(Lidar(beam_count=3, field_of_view=np.pi).angles).tolist()
    [-90.0, 0.0, 90.0]
    """

    beam_count: int = 541
    field_of_view: float = math.radians(270.0)
    range_min: float = 0.1
    range_max: float = 10.0
    noise_std: float = 0.01
    dropout_ratio: float = 0.0

    def __post_init__(self) -> None:
        check_count(self.beam_count, "beam_count", at_least=2, at_most=MAX_BEAM_COUNT)
        turn = 2.0 * math.pi
        check_range(self.field_of_view, "field_of_view", above=0.0, at_most=turn, unit="rad")
        check_range(self.range_min, "range_min", at_least=0.0, at_most=MAX_DISTANCE, unit="m")
        check_range(self.range_max, "range_max", above=self.range_min, unit="m")
        most_noise = min(self.range_max, MAX_DISTANCE)
        check_range(self.noise_std, "noise_std", at_least=0.0, at_most=most_noise, unit="m")
        check_range(self.dropout_ratio, "dropout_ratio", at_least=0.0, at_most=1.0)

    @property
    def angles(self) -> FloatArray:
        """Directions of the beams [rad], counter-clockwise, shape (beam_count,)."""
        half = self.field_of_view / 2.0
        full_circle = self.field_of_view == 2.0 * math.pi
        return np.linspace(-half, half, self.beam_count, endpoint=not full_circle)


def cast(
    world: World,
    T_world_scanner: ArrayLike,
    lidar: Lidar,
    *,
    rng: np.random.Generator | int,
    stamp: float = 0.0,
    increment: ArrayLike = (0.0, 0.0, 0.0),
    sweep_time: float = 0.0,
) -> Scan:
    """Take one scan, in an instant or while the scanner moves on.

    Parameters
    ----------
    world : World
        The walls and objects around the scanner.
    T_world_scanner : array_like, shape (3, 3)
        Pose of the scanner.
    lidar : Lidar
        Properties of the scanner.
    rng : numpy.random.Generator or int
        Source of noise and dropouts. The number of draws depends on the beams, not on the world.
    stamp : float
        Time of the scan [s], which says where moving objects are.
    increment : array_like, shape (3,)
        Motion of the scanner during the sweep (dx [m], dy [m], dθ [rad]): beam k of B looks from
        k/B of it.
    sweep_time : float
        Time that the sweep takes [s]; it stands in the scan as `time_increment` alone.

    Returns
    -------
    Scan
        With `ranges` (infinity for a no-return) and `angles` of all beams.

    Examples
    --------
    >>> from labkit.simulation import room
    >>> len(cast(room(), np.eye(3), Lidar(), rng=0))
    541
    """
    T = as_transform(T_world_scanner, "T_world_scanner")
    check_kind(world, "world", World)
    check_kind(lidar, "lidar", Lidar)
    sweep_motion = as_pose(increment, "increment")
    check_range(abs(sweep_motion[2]), "increment", at_most=2.0 * math.pi, unit="rad")
    check_range(sweep_time, "sweep_time", at_least=0.0, at_most=lidar.beam_count, unit="s")
    generator = as_generator(rng)
    if sweep_motion.any():
        share_of_sweep = np.arange(lidar.beam_count) / lidar.beam_count
        T = T @ matrices_of(np.outer(share_of_sweep, sweep_motion))
    ranges = first_hits(world.at(stamp), T, lidar.angles)
    ranges += generator.normal(0.0, lidar.noise_std, size=lidar.beam_count)
    dropped_out = generator.random(lidar.beam_count) < lidar.dropout_ratio
    out_of_range = (ranges <= lidar.range_min) | (ranges >= lidar.range_max)
    ranges[dropped_out | out_of_range] = np.inf
    time_increment = sweep_time / lidar.beam_count
    return Scan.from_ranges(ranges, lidar.angles, stamp=stamp, time_increment=time_increment)


def scan_along(
    world: World,
    poses: ArrayLike,
    lidar: Lidar,
    *,
    rng: np.random.Generator | int,
    stamps: ArrayLike | None = None,
    skewed: bool = False,
) -> list[Scan]:
    """Take one scan from each pose of a trajectory, while moving objects move on.

    Parameters
    ----------
    world, lidar, rng
        As for `cast`.
    poses : array_like, shape (K, 3)
        Rows (x [m], y [m], θ [rad]) of the scanner in the world frame.
    stamps : array_like, shape (K,), optional
        Times in seconds; ten scans per second from 0 on by default.
    skewed : bool
        The scanner moves on to the next pose while its beams turn, and each sweep lasts until
        then.
    """
    rows = as_poses(poses, "poses")
    check_kind(skewed, "skewed", bool)
    check_kind(world, "world", World)
    check_kind(lidar, "lidar", Lidar)
    if stamps is None:
        stamps = SCAN_PERIOD * np.arange(len(rows))
    times = as_stamps(stamps, "stamps", len(rows)).tolist()
    generator = as_generator(rng)
    T = matrices_of(rows)
    motions = np.zeros_like(rows)
    durations = np.zeros(len(rows))
    if skewed and len(rows) > 1:  # the last sweep moves on as the one before it
        motions = to_xytheta(relative(T[:-1], T[1:]))[[*range(len(rows) - 1), -1]]
        durations = np.diff(times)[[*range(len(rows) - 1), -1]]
    return [
        cast(
            world,
            T[k],
            lidar,
            rng=generator,
            stamp=times[k],
            increment=motions[k],
            sweep_time=float(durations[k]),
        )
        for k in range(len(rows))
    ]


def first_hits(segments: FloatArray, T_world_scanner: FloatArray, angles: FloatArray) -> FloatArray:
    """Distance [m] along each of B beams to the nearest of M segments; infinite without one.

    A beam hits a segment from a to b if these lie on either side of it. One comparison decides the
    side of an end point, so two segments that share an end leave no gap between them, and a segment
    that is exactly edge-on is not hit.
    """
    x, y, heading = to_xytheta(T_world_scanner).T  # (B,) where each beam has a pose of its own
    scanner = np.stack([x, y], axis=-1)
    directions = heading + angles
    along_a, across_a = _in_beam_axes(segments[:, 0], scanner, directions)
    along_b, across_b = _in_beam_axes(segments[:, 1], scanner, directions)
    beam, segment = np.nonzero((across_a < 0.0) != (across_b < 0.0))

    a, b = across_a[beam, segment], across_b[beam, segment]
    start, end = along_a[beam, segment], along_b[beam, segment]
    distance = start + a / (a - b) * (end - start)  # where `across`, interpolated, is zero
    ranges = np.full(len(angles), np.inf)
    is_ahead = distance >= 0.0
    np.minimum.at(ranges, beam[is_ahead], distance[is_ahead])
    return ranges


def _in_beam_axes(
    points: FloatArray, scanner: FloatArray, directions: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Coordinates of points (M, 2) along each beam and across it, to the left: (B, M) each.

    The scanner stands at (2,), or at (B, 2) where it moves on from beam to beam.
    """
    beam_x = np.cos(directions)[:, None]
    beam_y = np.sin(directions)[:, None]
    x = points[:, 0] - scanner[..., None, 0]
    y = points[:, 1] - scanner[..., None, 1]
    return beam_x * x + beam_y * y, beam_x * y - beam_y * x
