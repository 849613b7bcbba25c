"""A planar laser scanner that looks into a simulated world, beam by beam."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from labkit.scan import Scan
from labkit.se2 import from_xytheta, to_xytheta
from labkit.simulation.world import World
from labkit.support.arrays import (
    FloatArray,
    as_poses,
    as_stamps,
    as_transform,
    check_count,
    check_range,
)

SWEEP_PERIOD = 0.1  # s between two scans where the caller gives no stamps


@dataclass(frozen=True, kw_only=True)
class Lidar:
    """The properties of a scanner.

    The defaults are the lesson's: 270° and 10 m with 1 cm of noise. 541 beams make the
    step 0.5°, every second beam of a common 270° scanner.

    Attributes
    ----------
    beam_count : int
        Number of beams of a sweep.
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
        check_count(self.beam_count, "beam_count", at_least=2)
        turn = 2.0 * math.pi
        check_range(self.field_of_view, "field_of_view", above=0.0, at_most=turn, unit="rad")
        check_range(self.range_min, "range_min", at_least=0.0, unit="m")
        check_range(self.range_max, "range_max", above=self.range_min, unit="m")
        check_range(self.noise_std, "noise_std", at_least=0.0, at_most=self.range_max, unit="m")
        check_range(self.dropout_ratio, "dropout_ratio", at_least=0.0, at_most=1.0)

    @property
    def angles(self) -> FloatArray:
        """The beams' directions [rad], counter-clockwise, shape (beam_count,)."""
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
) -> Scan:
    """One sweep, taken in an instant: no beam is older than another.

    Parameters
    ----------
    world, lidar : World, Lidar
        What is seen, and by what.
    T_world_scanner : array_like, shape (3, 3)
        Pose of the scanner.
    rng : numpy.random.Generator or int
        How much is drawn from it depends only on the number of beams, never on the world.
    stamp : float
        The time in seconds; moving objects are where they are then.

    Returns
    -------
    Scan
        With all beams' `ranges` (infinity for a no-return) and `angles`.

    Examples
    --------
    >>> from labkit.simulation import room
    >>> len(cast(room(), np.eye(3), Lidar(), rng=0))
    541
    """
    T = as_transform(T_world_scanner, "T_world_scanner")
    rng = np.random.default_rng(rng)
    ranges = first_hits(world.at(stamp), T, lidar.angles)
    ranges += rng.normal(0.0, lidar.noise_std, size=lidar.beam_count)
    lost = rng.random(lidar.beam_count) < lidar.dropout_ratio
    ranges[lost | (ranges <= lidar.range_min) | (ranges >= lidar.range_max)] = np.inf
    return Scan.from_ranges(ranges, lidar.angles, stamp=stamp)


def scan_along(
    world: World,
    poses: ArrayLike,
    lidar: Lidar,
    *,
    rng: np.random.Generator | int,
    stamps: ArrayLike | None = None,
) -> list[Scan]:
    """One scan from each pose of a trajectory, while moving objects move on.

    Parameters
    ----------
    world, lidar, rng
        As for `cast`.
    poses : array_like, shape (K, 3)
        Rows (x [m], y [m], θ [rad]) of the scanner in the world frame.
    stamps : array_like, shape (K,), optional
        Times in seconds; ten scans per second from 0 on by default.
    """
    checked = as_poses(poses, "poses")
    by_default = SWEEP_PERIOD * np.arange(len(checked))
    times = as_stamps(by_default if stamps is None else stamps, "stamps", len(checked))
    rng = np.random.default_rng(rng)
    moments = zip(from_xytheta(checked), times.tolist(), strict=True)
    return [cast(world, T, lidar, rng=rng, stamp=stamp) for T, stamp in moments]


def first_hits(segments: FloatArray, T_world_scanner: FloatArray, angles: FloatArray) -> FloatArray:
    """Distance [m] along each of B beams to the nearest of M segments; infinite without one.

    Each end point lies `along` the beam and `across` it, to the left. A segment whose ends lie on
    either side of the beam crosses it where `across` has gone linearly to zero. One comparison per
    end point decides the side, so two segments that share an end leave no gap between them. A
    segment that is exactly edge-on is not met.
    """
    x, y, heading = to_xytheta(T_world_scanner)
    beam_x, beam_y = np.cos(heading + angles)[:, None], np.sin(heading + angles)[:, None]
    ends_x, ends_y = (segments[..., 0] - x).T[:, None, :], (segments[..., 1] - y).T[:, None, :]
    along = beam_x * ends_x + beam_y * ends_y  # (2, B, M)
    across = beam_x * ends_y - beam_y * ends_x
    beam, segment = np.nonzero((across[0] < 0.0) != (across[1] < 0.0))
    (along_a, along_b), (across_a, across_b) = along[:, beam, segment], across[:, beam, segment]
    distance = along_a + across_a / (across_a - across_b) * (along_b - along_a)
    ranges = np.full(len(angles), np.inf)
    ahead = distance >= 0.0
    np.minimum.at(ranges, beam[ahead], distance[ahead])
    return ranges
