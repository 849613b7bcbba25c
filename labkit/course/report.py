"""The tables of a report, as Markdown, and its figures, with a text for all readers."""

from __future__ import annotations

import base64
import html
import io
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from labkit.evaluation import ErrorSummary, compare
from labkit.odometry import Decision, StepRecord
from labkit.support.errors import InvalidParameterError

UNANSWERED = "**why?**"  # reason of a changed value, if none is given


class Table(str):
    """A Markdown table: text for a file, a table in a notebook."""

    def _repr_markdown_(self) -> str:
        return str(self)

    @classmethod
    def of(cls, header: Sequence[str], rows: Sequence[Sequence[object]]) -> Table:
        """Lay out rows under a header; the first column is text, the others align right.

        Examples
        --------
        >>> print(Table.of(["error", "m"], [["median", 0.03]]))
        | error | m |
        |---|--:|
        | median | 0.03 |
        """
        head, *body = [f"| {' | '.join(map(_cell, line))} |" for line in (header, *rows)]
        rule = "|---" + "|--:" * (len(header) - 1) + "|"
        return cls("\n".join([head, rule, *body]))


def _cell(value: object) -> str:
    r"""One line without a bare bar; in a formula a ``\|`` would be a norm."""
    line = " ".join(str(value).splitlines())
    parts = re.split(r"(\$[^$]+\$)", line)  # text, formula, text, ...
    bars = [r"\|", r"\\vert "]
    return "".join(re.sub(r"(?<!\\)\|", bars[k % 2], part) for k, part in enumerate(parts))


class Picture:
    """A picture, and a text for those who cannot see it; `figure_with_text` makes one."""

    def __init__(self, png: bytes, text: str) -> None:
        self.png = png
        self.text = text

    def _repr_html_(self) -> str:
        data = base64.b64encode(self.png).decode("ascii")
        return (
            f'<img alt="{html.escape(self.text)}" width="100%" src="data:image/png;base64,{data}">'
        )


def figure_with_text(figure: Any, text: str) -> Picture:
    """A figure of matplotlib as a report shows it, with `text` for those who cannot see it."""
    png = io.BytesIO()
    figure.savefig(png, format="png", dpi=200)
    return Picture(png.getvalue(), text)


def error_table(
    trajectories: Mapping[str, ArrayLike], reference: ArrayLike, stretch: float = 10.0
) -> Table:
    """Median, 95th percentile and maximum of the errors of `labkit.evaluation.compare`.

    Takes and raises what that function does.
    """

    def show(errors: ErrorSummary, scale: float, form: str) -> str:
        if errors.count == 0:
            return "none"
        values = (errors.median, errors.p95, errors.max)
        return ", ".join(f"{scale * value:{form}}" for value in values)

    rows = [
        [
            name,
            show(summary.translation, 1.0, ".3f"),
            show(summary.rotation, math.degrees(1.0), ".2f"),
        ]
        for name, summary in compare(trajectories, reference, stretch).items()
    ]
    return Table.of(["error (median, 95 %, max)", "translation [m]", "rotation [°]"], rows)


def quality_table(records: Sequence[StepRecord]) -> Table:
    """Signals of the matches over a run: RMSE beside the number of inliers it is taken over."""
    steps = [record for record in records if record.decision is not Decision.START]
    taken = [record.decision for record in steps]
    counts = [(taken.count(decision), decision.value) for decision in Decision]
    decisions = ", ".join(f"{count:,} {name}" for count, name in counts if count > 0)
    rows = [["steps", f"{len(steps):,}: {decisions}", ""]]
    for flag in ("degenerate", "ambiguous"):
        rows.append([flag, f"{sum(getattr(record, flag) for record in steps):,}", ""])
    for name, field, form in (
        ("inliers", "inlier_count", ".0f"),
        ("inlier ratio [–]", "inlier_ratio", ".2f"),
        ("inlier RMSE [m]", "rmse", ".3f"),
        ("information [–]", "information", ".3f"),
    ):
        values = [getattr(record, field) for record in steps if math.isfinite(record.rmse)]
        finite = [value for value in values if math.isfinite(value)]
        if finite:
            low, middle, high = np.percentile(finite, [5.0, 50.0, 95.0])
            rows.append([name, f"{middle:{form}}", f"{low:{form}} to {high:{form}}"])
    return Table.of(["signal", "median", "5 % to 95 %"], rows)


def parameter_table(parameters: object, reasons: Mapping[str, str] | None = None) -> Table:
    """Parameters that differ from their default, and those with a reason.

    Parameters
    ----------
    parameters : dataclass instance
        Such as `labkit.IcpParameters` or `labkit.odometry.OdometryParameters`; parameters
        within parameters are listed, too.
    reasons : mapping of str to str, optional
        Reason for each value, by name. A changed value without a reason is asked "why?".

    Examples
    --------
    >>> import labkit
    >>> chosen = labkit.IcpParameters(overlap_ratio=0.7)
    >>> print(parameter_table(chosen, {"overlap_ratio": "a third of the scan is a crowd"}))
    | parameter | value | default | reason |
    |---|--:|--:|:--|
    | `overlap_ratio` | 0.7 | 0.85 | a third of the scan is a crowd |
    """
    if not is_dataclass(parameters) or isinstance(parameters, type):
        raise InvalidParameterError(
            f"must be a parameter object such as IcpParameters(), got {parameters!r}",
            parameter="parameters",
        )
    reasons = reasons or {}
    usual = _values_with_units(type(parameters)())
    chosen = _values_with_units(parameters)
    for name in reasons.keys() - chosen.keys():
        raise InvalidParameterError(
            f"must be for parameters, got {name!r}; there are {', '.join(sorted(chosen))}",
            parameter="reasons",
        )
    rows = [
        [f"`{name}`", value, usual[name], reasons.get(name) or UNANSWERED]
        for name, value in chosen.items()
        if name in reasons or value != usual[name]
    ]
    head = Table.of(["parameter", "value", "default", "reason"], rows)
    return Table(head.replace("--:|\n", ":--|\n", 1))


def _values_with_units(parameters: Any) -> dict[str, str]:
    """Value of each parameter with its unit, by name, those within parameters included."""
    values: dict[str, str] = {}
    for field in fields(parameters):
        value = getattr(parameters, field.name)
        if is_dataclass(value):
            values |= _values_with_units(value)
            continue
        number = f"{value:g}" if isinstance(value, float) else str(value)
        with_unit = f"{number} {field.metadata.get('unit', '')}".rstrip()
        values[field.name] = "off" if value == math.inf else with_unit
    return values
