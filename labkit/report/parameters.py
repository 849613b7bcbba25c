"""A report's table of parameters: what was chosen, and why."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, fields, is_dataclass
from numbers import Integral, Real
from typing import Any

from labkit.errors import InvalidParameterError
from labkit.report.tables import Table

UNANSWERED = "**why?**"


def parameter_table(parameters: object, reasons: Mapping[str, str] | None = None) -> Table:
    """Every parameter that was chosen, with the reason for it.

    Parameters
    ----------
    parameters : dataclass instance
        Such as `labkit.IcpParameters` or `labkit.odometry.OdometryParameters`; parameters
        within parameters are listed, too.
    reasons : mapping of str to str, optional
        Why each has its value. One that has neither its default nor a reason is asked "why?".

    Returns
    -------
    Table
        Those that differ from their default, and those with a reason.

    Raises
    ------
    InvalidParameterError
        For a reason for a parameter that there is not.

    Examples
    --------
    >>> import labkit
    >>> chosen = labkit.IcpParameters(overlap_ratio=0.7)
    >>> print(parameter_table(chosen, {"overlap_ratio": "a third of the scan is a crowd"}))
    | parameter | value | default | reason |
    |---|--:|--:|---|
    | `overlap_ratio` | 0.7 | 0.85 | a third of the scan is a crowd |
    """
    given = dict(reasons or {})
    rows = []
    leaves = list(_leaves(parameters))
    for name, value, default, unit in leaves:
        reason = given.pop(name, None)
        if reason is not None or value != default:
            cells = (_show(value, unit), _show(default, unit))
            rows.append([f"`{name}`", *cells, reason or UNANSWERED])
    if given:
        known = ", ".join(sorted(name for name, *_ in leaves))
        raise InvalidParameterError(
            f"must be for parameters, got {next(iter(given))!r}; there are {known}",
            parameter="reasons",
        )
    head = Table.of(["parameter", "value", "default", "reason"], rows)
    return Table(head.replace("|---|--:|--:|--:|", "|---|--:|--:|---|", 1))


def _leaves(parameters: object) -> Iterator[tuple[str, Any, Any, str]]:
    """Name, value, default and unit of each parameter, those within parameters included."""
    if not is_dataclass(parameters) or isinstance(parameters, type):
        raise InvalidParameterError(
            f"must be a parameter object such as IcpParameters(), got {parameters!r}",
            parameter="parameters",
        )
    for field in fields(parameters):
        value = getattr(parameters, field.name)
        default = field.default_factory() if field.default_factory is not MISSING else field.default
        if not is_dataclass(value):
            yield field.name, value, default, field.metadata.get("unit", "")
            continue
        usual = {name: each for name, each, *_ in _leaves(default)}
        yield from ((name, each, usual.get(name), unit) for name, each, _, unit in _leaves(value))


def _show(value: object, unit: str) -> str:
    if isinstance(value, bool) or not isinstance(value, Real):
        return str(value)
    if value == math.inf:
        return "off"
    number = str(value) if isinstance(value, Integral) else f"{float(value):g}"
    return f"{number} {unit}".rstrip()
