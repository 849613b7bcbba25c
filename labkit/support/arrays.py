"""Checks of what a caller passes in: points, weights, parameters.

Every message names the argument, the value received and the way out. After these checks the
mathematics can rely on clean float64 arrays.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Sequence
from numbers import Real
from typing import Any, Protocol, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from labkit.support.errors import InvalidParameterError, InvalidPointsError

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.intp]
Values = TypeVar("Values", bound=NDArray[Any])
EPSILON = 2.0**-52  # the spacing of doubles at 1
MAX_DISTANCE = 1e9  # [m]: no robot drives or sees farther, so a number beyond it is damaged
MAX_COORDINATE = 1e12  # [m]: beyond it the squares of coordinates hold no centimetre


class PointSet(Protocol):
    """An object that has points [m], shape (N, 2): a scan, a target."""

    @property
    def points(self) -> FloatArray:
        """The points [m], shape (N, 2)."""


def as_floats(
    values: ArrayLike, name: str, hint: str = "", shape: tuple[int | str, ...] | None = None
) -> FloatArray:
    """Return a copy of `values` as float64, or raise an error that says what they are.

    The caller may overwrite the array later. The copy's rows lie one after the other in memory,
    the one layout that the stages are compiled for. A masked entry is refused. A letter in `shape`
    stands for any length, as in ``("N", 2)``.
    """
    advice = f"; {hint}" if hint else ""
    if np.ma.isMaskedArray(values) and np.ma.is_masked(values):
        first = np.argwhere(np.ma.getmaskarray(np.ma.asarray(values)))[0].tolist()
        raise InvalidPointsError(
            f"`{name}` must hold numbers, got a masked array, masked first at {first}; "
            f"drop such rows first"
        )
    try:
        numbers = np.asarray(values)
    except (TypeError, ValueError):
        numbers = np.asarray(None)
    if numbers.dtype.kind not in "biuf":  # text, complex numbers, objects
        received = " ".join(repr(values).split())
        shown = received if len(received) <= 60 else received[:57] + "..."
        raise InvalidPointsError(f"`{name}` must hold numbers, got {shown}{advice}")
    if shape is not None:
        sides = zip(shape, numbers.shape, strict=False)
        fits = [isinstance(expected, str) or expected == side for expected, side in sides]
        if not all(fits) or numbers.ndim != len(shape):
            expected_shape = str(shape).replace("'", "")
            raise InvalidPointsError(
                f"`{name}` must have shape {expected_shape}, got {numbers.shape}{advice}"
            )
    return np.array(numbers, dtype=np.float64, order="C")


def read_only(values: Values) -> Values:
    """Return the same array, made read-only."""
    values.setflags(write=False)
    return values


def as_points(points: PointSet | ArrayLike | None, name: str, minimum: int = 1) -> FloatArray:
    """Check points (N, 2) [m], at least `minimum`, 0 or 1: finite and within `MAX_COORDINATE`.

    An object with `points`, a scan or a target, stands for its points. Every message begins with
    `name`, the caller's word, and names the first bad point by index.
    """
    values: Any = by_titles(getattr(points, "points", points), ("x", "y"))
    checked = as_floats(values, name, "give an (N, 2) array of metres, or a scan")
    if checked.shape == (0,):  # of an empty list
        checked = checked.reshape(0, 2)
    if checked.size == 0 and minimum > 0:
        raise InvalidPointsError(
            f"`{name}` is empty, got shape {checked.shape}; were all ranges dropped?"
        )
    if checked.ndim != 2 or checked.shape[1] != 2:
        if checked.shape[:1] == (2,):
            advice = "transpose it (`.T`)" if checked.ndim == 2 else "one point is `[[x, y]]`"
        elif checked.ndim == 1:
            advice = "ranges go through `labkit.Scan.from_ranges(ranges, angles)`"
        else:
            advice = "keep x and y, `points[:, :2]`"
        raise InvalidPointsError(f"`{name}` must have shape (N, 2), got {checked.shape}; {advice}")
    return _as_near(checked, name)


def _as_near(rows: FloatArray, name: str) -> FloatArray:
    """Return `rows`, or name the first one that is not finite or lies beyond `MAX_COORDINATE`."""
    if not np.abs(rows).max(initial=0.0) <= MAX_COORDINATE:
        as_finite(rows, name, hint="drop such rows first")
        index = int(np.abs(rows).max(axis=1).argmax())
        raise InvalidPointsError(
            f"`{name}` must lie within {MAX_COORDINATE:g} m, got {rows[index].tolist()} at index "
            f"{index}; drop such rows first"
        )
    return rows


def as_pose_rows(poses: ArrayLike, name: str, advice: str = "") -> FloatArray:
    """Check rows (x [m], y [m], θ [rad]), shape (..., 3): finite, and no transforms."""
    rows = as_floats(poses, name, hint="give x [m], y [m], theta [rad]")
    got = ""
    if rows.shape[-1:] != (3,):
        got = str(rows.shape)
    elif rows.shape[-2:] == (3, 3) and rows.size > 0 and _are_rigid(rows):
        got = "transforms: are the poses wanted? `labkit.to_xytheta`"
    if got:
        raise InvalidPointsError(f"`{name}` must be rows (x, y, theta), shape (..., 3), got {got}")
    return as_finite(rows, name, advice)


def by_titles(values: Any, titles: Sequence[str]) -> Any:
    """The columns of a table by their titles, as of a DataFrame that has them in any order."""
    columns = list(getattr(values, "columns", ()))
    return values[list(titles)] if set(titles) <= set(columns) else values


def as_poses(poses: ArrayLike, name: str, minimum: int = 1, *, gaps: bool = False) -> FloatArray:
    """Check poses, rows (K, 3) or transforms (K, 3, 3) or (K, 4, 4): the rows (K, 3).

    Rows are x [m], y [m], θ [rad]. The height of a transform in space is dropped. With `gaps`, a
    row of NaN is allowed, and so are no rows at all.
    """
    hint = "give rows x [m], y [m], theta [rad], `result.poses` of a run"
    rows = as_floats(by_titles(poses, ("x", "y", "theta")), name, hint)
    if rows.ndim == 3:
        rows = _rows_of_transforms(rows, name)
    fewest = 0 if gaps else minimum
    if rows.ndim != 2 or rows.shape[1] != 3 or len(rows) < fewest:
        raise InvalidPointsError(
            f"`{name}` must be {minimum} or more poses, rows (x, y, theta), shape (K, 3), or "
            f"transforms, shape (K, 3, 3), got shape {rows.shape}"
        )
    if not gaps:
        return _as_near(as_pose_rows(rows, name), name)
    is_gap = np.isnan(rows).all(axis=1, keepdims=True)
    advice = "three times NaN says that there is none"
    _as_near(as_pose_rows(np.where(is_gap, 0.0, rows), name, advice), name)
    return rows


def _rows_of_transforms(stack: FloatArray, name: str) -> FloatArray:
    """Rows (x, y, θ) of transforms, (K, 3, 3) in the plane or (K, 4, 4) in space.

    Arrays of another shape come back as they are.
    """
    if stack.shape[1:] == (4, 4):
        kept = [0, 1, 3]  # without the height
        stack = as_transforms(stack[:, kept][:, :, kept], name, "drop roll and pitch first")
    if stack.shape[1:] != (3, 3):
        return stack
    T = as_transforms(stack, name)
    theta = np.arctan2(T[:, 1, 0], T[:, 0, 0])
    theta = np.where(theta == -np.pi, np.pi, theta)  # a sine of −0.0 gives −π
    return np.column_stack([T[:, :2, 2], theta])


def as_pose(pose: ArrayLike, name: str, *, gaps: bool = False) -> FloatArray:
    """Check one pose, (x, y, θ) or a transform (3, 3) or (4, 4), as `as_poses`: the row (3,)."""
    checked = as_floats(pose, name, hint="give three numbers: metres, metres, radians")
    if checked.shape in {(3,), (3, 3), (4, 4)}:
        row: FloatArray = as_poses([checked], name, gaps=gaps)[0]
        return row
    return as_numbers(checked, name)  # raises an error


def as_numbers(values: ArrayLike, name: str, what: str = "x, y, angle") -> FloatArray:
    """Check a pose (3,) or a point (2,): finite numbers, as many as `what` lists."""
    count = what.count(",") + 1
    return as_finite(as_floats(values, name, f"give {what}", (count,)), name)


def as_covariance(values: ArrayLike, name: str, size: int, *, definite: bool = False) -> FloatArray:
    """Check a covariance (size, size): symmetric, positive definite or else semi-definite."""
    C = as_finite(as_floats(values, name, "take a block of a larger one", (size, size)), name)
    rounding = 1e-9 * np.abs(C).max()
    is_symmetric = np.abs(C - C.T).max() <= rounding
    smallest = np.linalg.eigvalsh(C)[0]  # eigenvalue
    is_positive = smallest > 0.0 if definite else smallest >= -rounding
    if not (is_symmetric and is_positive):
        kind = "definite" if definite else "semi-definite"
        raise InvalidPointsError(
            f"`{name}` must be symmetric and positive {kind}, got {C.tolist()}"
        )
    return C


def as_finite(rows: FloatArray, name: str, hint: str = "") -> FloatArray:
    """Return `rows`, or name the first one along axis 0 that is NaN or infinite."""
    finite = np.isfinite(rows)
    if not finite.all():
        index = int(np.argwhere(~finite)[0, 0])
        advice = f"; {hint}" if hint else ""
        raise InvalidPointsError(
            f"`{name}` must be finite, got {rows[index].tolist()} at index {index}{advice}"
        )
    return rows


def as_stamps(stamps: ArrayLike, name: str, count: int | None = None) -> FloatArray:
    """Check finite times [s], shape (K,); one for each of `count` poses, if that is given."""
    shape = ("K" if count is None else count,)
    return as_finite(as_floats(stamps, name, "give seconds, one time per pose", shape), name)


def as_pairs(
    source: ArrayLike, target: ArrayLike, weights: ArrayLike | None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Check matched points and their weights: equal lengths, weights finite and ≥ 0."""
    p = as_points(source, "source")
    q = as_points(target, "target")
    if len(p) != len(q):
        raise InvalidPointsError(
            f"`source` and `target` must be pairs, got {len(p)} and {len(q)} points; "
            f"row i of one belongs to row i of the other"
        )
    if weights is None:
        return p, q, np.ones(len(p))
    w = as_floats(weights, "weights", "give one number per pair", (len(p),))
    refused = ~(np.isfinite(w) & (w >= 0.0))
    if refused.any():
        index = int(refused.argmax())
        raise InvalidPointsError(
            f"`weights` must be finite and not negative, got {w[index]} at index {index}"
        )
    return p, q, w


def as_normals(normals: ArrayLike, name: str, count: int, *, gaps: bool = False) -> FloatArray:
    """Check unit normals, shape (count, 2); with `gaps`, a row of NaN says that there is none."""
    checked = as_floats(normals, name, "give a unit vector per point", (count, 2))
    if not gaps:
        as_finite(checked, name)
    x, y = checked.T
    is_unit = abs(np.hypot(x, y) - 1.0) <= 1e-6
    is_gap = np.isnan(x) & np.isnan(y)
    refused = ~(is_unit | is_gap)
    if refused.any():
        index = int(refused.argmax())
        expected = "unit vectors, or NaN where there is none" if gaps else "unit vectors"
        raise InvalidPointsError(
            f"`{name}` must be {expected}, got {checked[index].tolist()} at index {index}"
        )
    return checked


def as_transform(T: ArrayLike, name: str) -> FloatArray:
    """Check a single rigid transform (3, 3) of finite numbers, as `as_transforms` does."""
    checked = as_transforms(T, name)
    got = ""
    if checked.ndim > 2:
        got = f"a stack of shape {checked.shape}"
    elif np.isnan(checked[0, 0]):
        got = "NaN, of a match that failed; print `result.message`"
    if got:
        raise InvalidPointsError(f"`{name}` must be one (3, 3) transform, got {got}")
    return checked


def as_transforms(
    T: ArrayLike, name: str, build: str = "build one with `labkit.transform(x, y, theta)`"
) -> FloatArray:
    """Check rigid transforms (..., 3, 3): proper rotations, finite, last rows 0 0 1.

    The NaN of a match that failed, or of its inverse, passes and stays NaN.
    """
    checked = as_floats(T, name, f"give `result.T_target_source` of a match, or {build}")
    if checked.shape[-2:] != (3, 3):
        advice = build
        if checked.shape[-1:] == (3,):
            advice = "poses (x, y, theta) go through `labkit.from_xytheta`"
        elif 2 in checked.shape and checked.shape != (2, 2):
            advice = "are these points? `labkit.apply(T, points)` moves them"
        raise InvalidPointsError(
            f"`{name}` must be a (3, 3) transform, got shape {checked.shape}; {advice}"
        )
    for entries in checked.reshape(-1, 9).tolist():  # plain numbers: most stacks are short
        is_failed_match = all(map(math.isnan, entries[:6]))
        if not (is_failed_match or is_rigid(entries)):
            got = np.reshape(entries, (3, 3)).tolist()
            raise InvalidPointsError(
                f"`{name}` must be a proper rigid transform, got {got}; {build}"
            )
    return checked


def _are_rigid(stack: FloatArray) -> bool:
    """Recognise a stack (..., 3, 3) all of whose matrices are rigid transforms."""
    return all(is_rigid(entries) for entries in stack.reshape(-1, 9).tolist())


def is_rigid(entries: Sequence[float]) -> bool:
    """Recognise a rigid transform by its nine entries, row by row."""
    a, b, x, c, d, y, *last_row = entries
    is_rotation = abs(a - d) + abs(b + c) + abs(a * a + c * c - 1.0) <= 1e-6
    return is_rotation and math.isfinite(x) and math.isfinite(y) and last_row == [0.0, 0.0, 1.0]


def check_range(
    value: float,
    name: str,
    *,
    above: float = -math.inf,
    at_least: float = -math.inf,
    at_most: float = math.inf,
    unit: str = "",
) -> float:
    """Return the number as a float if it is > above, ≥ at_least and ≤ at_most.

    ``inf`` passes if there is no upper bound (it means "off"). NaN never passes, nor does a whole
    number that no float can hold. Everything else raises `InvalidParameterError`.
    """
    if is_number(value) and value > above and at_least <= value <= at_most:
        with contextlib.suppress(OverflowError):
            return float(value)
    low = f"({above:g}" if above > at_least else f"[{at_least:g}"
    high = f"{at_most:g}]" if math.isfinite(at_most) else "inf]"
    bounds = f"{low}, {high} {unit}".rstrip()
    raise InvalidParameterError(f"must be in {bounds}, got {value!r:.80}", parameter=name)


def is_number(value: object) -> bool:
    """Recognise a single real number, Python's or numpy's; True and False are none."""
    return isinstance(value, Real) and not isinstance(value, bool)


def check_count(value: float, name: str, at_least: int, at_most: int | None = None) -> None:
    """Raise `InvalidParameterError` unless it is a whole number ≥ `at_least` and ≤ `at_most`."""
    is_whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if is_whole and value >= at_least and (at_most is None or value <= at_most):
        return
    limit = "" if at_most is None else f" and at most {at_most:,}"
    raise InvalidParameterError(
        f"must be a whole number of at least {at_least}{limit}, got {value!r}", parameter=name
    )


def check_kind(value: object, name: str, *kinds: type) -> None:
    """Raise `InvalidParameterError` unless `value` is an object of one of the classes."""
    if not isinstance(value, kinds):
        classes = " or ".join(kind.__name__ for kind in kinds)
        raise InvalidParameterError(
            f"must be of the class {classes}, got {value!r:.80}", parameter=name
        )


def check_function(value: object, name: str) -> None:
    """Raise `InvalidParameterError` unless `value` can be called."""
    if not callable(value):
        raise InvalidParameterError(f"must be a function, got {value!r:.80}", parameter=name)


def check_series(values: object, name: str) -> None:
    """Raise `InvalidParameterError` unless `values` are a list, a tuple or another sequence."""
    if not isinstance(values, Sequence):
        check_kind(values, name, list, tuple)


def check_kinds(values: object, name: str, *kinds: type) -> None:
    """Raise `InvalidParameterError` unless `values` are a series of such objects."""
    check_series(values, name)
    for k, value in enumerate(cast(Sequence[object], values)):
        check_kind(value, f"{name}[{k}]", *kinds)


def check_choice(value: object, name: str, *choices: str | None) -> None:
    """Raise `InvalidParameterError` unless `value` is one of the words, or of these and None."""
    is_word_or_none = value is None or isinstance(value, str)
    if not (is_word_or_none and value in choices):
        *others, final = (f'"{word}"' if word else "None" for word in choices)
        raise InvalidParameterError(
            f"must be {', '.join(others)} or {final}, got {value!r:.80}", parameter=name
        )


def as_generator(rng: np.random.Generator | int) -> np.random.Generator:
    """Check a random generator, or make one from its seed, a whole number that is not negative."""
    if not isinstance(rng, np.random.Generator):
        check_kind(rng, "rng", np.random.Generator, int, np.integer)
        check_count(rng, "rng", at_least=0)
    return np.random.default_rng(rng)
