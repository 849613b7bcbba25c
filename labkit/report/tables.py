"""The tables of a report, as Markdown that a notebook shows as a table."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from labkit.arrays import FARTHEST, check_range
from labkit.errors import InvalidParameterError
from labkit.evaluation import ErrorSummary, PoseErrors, absolute_errors, rpe
from labkit.odometry import Decision, StepRecord


class Table(str):
    """A Markdown table: text for a file, a table in a notebook."""

    __slots__ = ()

    def _repr_markdown_(self) -> str:
        return str(self)

    @classmethod
    def of(cls, header: Sequence[str], rows: Sequence[Sequence[object]]) -> Table:
        """Lay out rows under a header; the first column is text, the others align right.

        A bar or a line's end within a cell is written so that it ends no cell.

        Examples
        --------
        >>> print(Table.of(["error", "m"], [["median", 0.03]]))
        | error | m |
        |---|--:|
        | median | 0.03 |
        """
        rule = ["---", *(["--:"] * (len(header) - 1))]
        lines = [header, None, *rows]
        return cls(
            "\n".join(
                "|" + "|".join(rule) + "|"
                if line is None
                else f"| {' | '.join(map(_cell, line))} |"
                for line in lines
            )
        )


def error_table(
    trajectories: Mapping[str, ArrayLike], reference: ArrayLike, stretch: float = 10.0
) -> Table:
    """Errors of trajectories against a reference: per step, over a stretch, and absolute.

    Parameters
    ----------
    trajectories : mapping of str to array_like, shape (K, 3)
        Rows (x [m], y [m], θ [rad]) by the name of what estimated them.
    reference : array_like, shape (K, 3)
        The same instants.
    stretch : float
        Metres of the middle rows.

    Returns
    -------
    Table
        Median, 95th percentile and maximum.

    Raises
    ------
    InvalidParameterError
        For a `stretch` that is not positive, or longer than 1e9 m.
    """
    check_range(stretch, "stretch", above=0.0, at_most=FARTHEST, unit="m")
    errors: list[tuple[str, PoseErrors]] = []
    for name, poses in trajectories.items():
        errors.append((f"{name}, RPE a step", rpe(poses, reference)))
    for name, poses in trajectories.items():
        over = rpe(poses, reference, stretch, "metres")
        errors.append((f"{name}, RPE over {stretch:g} m", over))
    for name, poses in trajectories.items():
        kind, absolute = absolute_errors(poses, reference)
        errors.append((f"{name}, {kind}", absolute))
    rows = [[title, *_three(each.translation, each.rotation)] for title, each in errors]
    return Table.of(["error (median, 95 %, max)", "translation [m]", "rotation [°]"], rows)


def quality_table(records: Sequence[StepRecord]) -> Table:
    """What the matches say about themselves, over a run.

    Parameters
    ----------
    records : sequence of StepRecord
        Of an `OdometryResult`; the first scan's is passed over.

    Returns
    -------
    Table
        Where the steps came from; RMSE beside the number of inliers that it is taken over.
    """
    steps = [record for record in records if record.decision is not Decision.START]
    if not steps:
        raise InvalidParameterError("must hold at least one step, got none", parameter="records")
    matched = [record for record in steps if record.termination is not None]
    counts = {
        decision: sum(record.decision is decision for record in steps) for decision in Decision
    }
    decisions = ", ".join(f"{count:,} {kind.value}" for kind, count in counts.items() if count)
    rows: list[list[object]] = [
        ["steps", f"{len(steps):,}: {decisions}", ""],
        ["degenerate", f"{sum(record.degenerate for record in steps):,}", ""],
    ]
    signals = {
        "inliers": ([record.inlier_count for record in matched], ".0f"),
        "inlier ratio [–]": ([record.inlier_ratio for record in matched], ".2f"),
        "inlier RMSE [m]": ([record.rmse for record in matched], ".3f"),
        "information [–]": ([record.information for record in matched], ".3f"),
    }
    for name, (values, form) in signals.items():
        finite = np.array(values, dtype=np.float64)
        finite = finite[np.isfinite(finite)]
        if finite.size:
            low, middle, high = np.percentile(finite, [5.0, 50.0, 95.0])
            rows.append([name, f"{middle:{form}}", f"{low:{form}} to {high:{form}}"])
    return Table.of(["signal", "median", "5 % to 95 %"], rows)


def _cell(value: object) -> str:
    r"""One line without a bare bar; in a formula a ``\|`` would be a norm."""
    line = " ".join(str(value).splitlines())
    parts = re.split(r"(\$[^$]+\$)", line)  # text, formula, text, ...
    bars = [r"\|", r"\\vert "]
    return "".join(re.sub(r"(?<!\\)\|", bars[k % 2], part) for k, part in enumerate(parts))


def _three(translation: ErrorSummary, rotation: ErrorSummary) -> list[str]:
    def line(errors: ErrorSummary, scale: float, form: str) -> str:
        if errors.count == 0:
            return "none"
        values = (errors.median, errors.p95, errors.max)
        return ", ".join(f"{scale * value:{form}}" for value in values)

    return [line(translation, 1.0, ".3f"), line(rotation, math.degrees(1.0), ".2f")]
