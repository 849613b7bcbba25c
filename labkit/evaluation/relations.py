"""Surveyed relations: how to judge a trajectory without a reference trajectory.

Somebody matched chosen pairs of scans by hand and wrote down the pose of one in the frame of
the other. These relations do not depend on the frame of the map, and for most of the classic
logs nothing else is known [1]_. A file has one of two forms. The SLAM benchmark's own has one
relation per line, with blanks between the fields::

    t1 t2 x y z roll pitch yaw

with two times in seconds. The other is a table of scan indices, with commas between the
fields, with or without its header::

    i,j,dx,dy,dtheta

In both, what follows a `#` is a comment, lengths are metres and angles radians.

References
----------
.. [1] Kümmerle, Steder, Dornhege, Ruhnke, Grisetti, Stachniss, Kleiner, "On measuring
       the accuracy of SLAM algorithms", Autonomous Robots 27(4), 2009.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from labkit.arrays import (
    FARTHEST,
    BoolArray,
    FloatArray,
    IntArray,
    as_floats,
    as_poses,
    check_range,
)
from labkit.errors import InvalidPointsError, LogError
from labkit.evaluation.association import as_stamps, nearest
from labkit.evaluation.pose_errors import PoseErrors, pose_differences
from labkit.se2 import from_xytheta, relative


@dataclass(frozen=True, eq=False, kw_only=True)
class Relations:
    """Surveyed poses of one scan in the frame of another.

    Attributes
    ----------
    ends : ndarray, shape (N, 2)
        The two scans of each relation, by their 0-based index, or by their time in seconds.
    by_stamp : bool
        Whether `ends` are times.
    increments : ndarray, shape (N, 3)
        Rows (x [m], y [m], θ [rad]) of the second scan in the frame of the first.
    """

    ends: FloatArray
    by_stamp: bool
    increments: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "increments", as_poses(self.increments, "increments"))
        ends = as_floats(self.ends, "ends")
        if ends.shape != (len(self.increments), 2) or not np.isfinite(ends).all():
            raise InvalidPointsError(
                f"`ends` must be finite and of shape ({len(self.increments)}, 2), one row per "
                f"increment, got shape {ends.shape}"
            )
        if not self.by_stamp and ((ends < 0.0) | (ends != np.floor(ends))).any():
            raise InvalidPointsError(
                "`ends` must be 0-based scan indices; give by_stamp=True if they are times"
            )
        object.__setattr__(self, "ends", ends)

    def __len__(self) -> int:
        """How many relations there are."""
        return len(self.ends)


@dataclass(frozen=True, eq=False, kw_only=True)
class RelationErrors(PoseErrors):
    """The errors of a trajectory against the relations that it covers.

    Attributes
    ----------
    translation_errors, rotation_errors : ndarray, shape (M,)
        Metres and radians, one per relation that was found.
    pairs : ndarray of int, shape (M, 2)
        The poses that each of them compared.
    found : ndarray of bool, shape (N,)
        Which of all N relations those are; the others have no pose at one end or both.
    """

    pairs: IntArray
    found: BoolArray

    @property
    def unmatched(self) -> int:
        """How many relations the trajectory does not cover."""
        return int(np.count_nonzero(~self.found))


def relation_errors(
    relations: Relations,
    poses: ArrayLike,
    stamps: ArrayLike | None = None,
    *,
    tolerance: float = 0.05,
) -> RelationErrors:
    """The error of each relation: ``invert(relation) @ (invert(x_i) @ x_j)``.

    Translations and rotations are kept apart, because no weight between metres and radians
    suits every task.

    Parameters
    ----------
    relations : Relations
        From `read_relations`.
    poses : array_like, shape (K, 3)
        The estimate's rows (x [m], y [m], θ [rad]), in any frame.
    stamps : array_like, shape (K,), optional
        The poses' times in seconds; needed where relations name times.
    tolerance : float
        How far in seconds a pose may lie from the time that a relation names.

    Returns
    -------
    RelationErrors
        Its summaries are NaN where the poses cover no relation.

    Raises
    ------
    InvalidPointsError
        For rows that are not three finite numbers, or for stamps that are missing, not
        finite, or not one per pose.
    InvalidParameterError
        For a negative tolerance.

    Examples
    --------
    >>> survey = Relations(ends=[[0, 1], [1, 9]], by_stamp=False,
    ...                    increments=[[1, 0, 0], [1, 0, 0]])
    >>> errors = relation_errors(survey, [[0, 0, 0], [1.5, 0, 0]])
    >>> errors.translation.mean, errors.unmatched
    (0.5, 1)
    """
    x = as_poses(poses, "poses")
    check_range(tolerance, "tolerance", at_least=0.0, unit="s")
    if relations.by_stamp:
        times = _stamps_of(x, stamps)
        index = nearest(times, relations.ends.reshape(-1)).reshape(-1, 2)
        covered = np.abs(times[index] - relations.ends) <= tolerance
    else:
        covered = relations.ends < len(x)
        index = np.where(covered, relations.ends, 0.0).astype(np.intp)
    found = np.logical_and(covered[:, 0], covered[:, 1])
    pairs = index[found]
    T = from_xytheta(x)
    i, j = pairs.T
    translation, rotation = pose_differences(
        from_xytheta(relations.increments[found]), relative(T[i], T[j])
    )
    return RelationErrors(
        translation_errors=translation, rotation_errors=rotation, pairs=pairs, found=found
    )


def _stamps_of(poses: FloatArray, stamps: ArrayLike | None) -> FloatArray:
    if stamps is None:
        raise InvalidPointsError("these relations name times; give the `stamps` of the poses")
    times = as_stamps(stamps, "stamps")
    if len(times) != len(poses):
        raise InvalidPointsError(
            f"`stamps` must have shape ({len(poses)},), one per pose, got {times.shape}"
        )
    return times


HEADER = ["i", "j", "dx", "dy", "dtheta"]
LAST_INDEX = 999_999_999  # no log has more scans; a number beyond it is a damaged one
OUT_OF_PLANE = 1e-3  # m or rad; more of it is a relation in space, not in the plane


def read_relations(path: str | Path) -> Relations:
    """Read a file of relations; its first line with content tells which form it has.

    Parameters
    ----------
    path : str or Path
        A text file.

    Returns
    -------
    Relations
        In the order of the file.

    Raises
    ------
    LogError
        For a file that cannot be read or holds no relation, and for a damaged line, as
        "FILE:LINE: what is wrong".
    """
    lines = _content(path)
    if lines and _fields(lines[0][1], ",") == HEADER:
        lines = lines[1:]
    if not lines:
        raise LogError(f"{path}: holds no relations")
    if "," in lines[0][1]:
        rows = [_indexed(text, f"{path}:{number}") for number, text in lines]
    else:
        rows = [_timed(text, f"{path}:{number}") for number, text in lines]
    table = np.array(rows)
    return Relations(ends=table[:, :2], by_stamp="," not in lines[0][1], increments=table[:, 2:])


def _content(path: str | Path) -> list[tuple[int, str]]:
    """The lines that say something, each with its number."""
    try:
        text = Path(path).read_text(encoding="utf-8-sig", errors="replace")
    except OSError as error:
        raise LogError(f"{path}: cannot be read: {error.strerror}") from error
    bare = ((number, line.split("#")[0].strip()) for number, line in enumerate(text.split("\n"), 1))
    return [(number, line) for number, line in bare if line]


def _indexed(text: str, place: str) -> list[float]:
    """One line of the table: i, j, dx, dy, dtheta."""
    row = _numbers(_fields(text, ","), len(HEADER), place)
    if any(not 0.0 <= end <= LAST_INDEX or end != int(end) for end in row[:2]):
        raise LogError(
            f"{place}: scan indices must be whole numbers from 0 to {LAST_INDEX}, got {text!r}"
        )
    return _near(row, text, place)


def _timed(text: str, place: str) -> list[float]:
    """One line of the benchmark: t1 t2 x y z roll pitch yaw, without what leaves the plane."""
    t1, t2, x, y, z, roll, pitch, yaw = _numbers(_fields(text), 8, place)
    if max(abs(z), abs(roll), abs(pitch)) > OUT_OF_PLANE:
        raise LogError(f"{place}: z, roll and pitch must be 0 in the plane, got {text!r}")
    return _near([t1, t2, x, y, yaw], text, place)


def _near(row: list[float], text: str, place: str) -> list[float]:
    if max(map(abs, row[2:])) > FARTHEST:
        raise LogError(f"{place}: relations must lie within {FARTHEST:g} m and rad, got {text!r}")
    return row


def _fields(text: str, separator: str | None = None) -> list[str]:
    return [field.strip() for field in text.split(separator)]


def _numbers(fields: list[str], expected: int, place: str) -> list[float]:
    if len(fields) != expected:
        raise LogError(f"{place}: expected {expected} fields, got {len(fields)}: {fields}")
    try:
        row = [float(field) for field in fields]
    except ValueError as error:
        raise LogError(f"{place}: {error}") from None
    if not all(math.isfinite(value) for value in row):
        raise LogError(f"{place}: numbers must be finite, got {fields}")
    return row
