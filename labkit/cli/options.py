"""Options made from parameter objects: one for each field, under the field's own name."""

from __future__ import annotations

import argparse
import math
from dataclasses import fields
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

from labkit.parameters import IcpParameters

Parameters = TypeVar("Parameters")

SHORT = {"max_correspondence_distance": "--gate", "overlap_ratio": "--overlap"}


def add_options(
    parser: argparse.ArgumentParser, title: str, defaults: object, names: tuple[str, ...] = ()
) -> None:
    """Add one option for each field of a parameter object, or for those in `names`.

    What a field means, and in which unit, stands in its metadata.
    """
    group = parser.add_argument_group(title)
    kinds = get_type_hints(type(defaults))
    for field in fields(defaults):  # type: ignore[arg-type]
        name = field.name
        if names and name not in names:
            continue
        default = getattr(defaults, name)
        flags = ["--" + name.replace("_", "-")]
        if name in SHORT:
            flags.insert(0, SHORT[name])
        kind: dict[str, Any] = {"type": number_or_off, "metavar": "X"}
        if get_origin(kinds[name]) is Literal:
            kind = {"choices": get_args(kinds[name])}
        elif isinstance(default, bool):
            kind = {"action": argparse.BooleanOptionalAction}
        elif isinstance(default, int):
            kind = {"type": int, "metavar": "N"}
        unit = f" [{field.metadata['unit']}]" if "unit" in field.metadata else ""
        explanation = f"{field.metadata['help']}{unit} (default {_show(default)})"
        group.add_argument(*flags, dest=name, default=default, help=explanation, **kind)


def from_options(kind: type[Parameters], args: argparse.Namespace, **more: object) -> Parameters:
    """Make a parameter object from the options of its fields; `more` gives other fields."""
    names = {field.name for field in fields(kind)}  # type: ignore[arg-type]
    return kind(**{name: value for name, value in vars(args).items() if name in names} | more)


def add_icp_options(parser: argparse.ArgumentParser, defaults: IcpParameters | None = None) -> None:
    """Add the robust parameters of the matcher."""
    add_options(parser, "matching", defaults or IcpParameters())


def number_or_off(text: str) -> float:
    """A number; ``off`` is infinity."""
    return math.inf if text.lower() == "off" else float(text)


number_or_off.__name__ = "number"  # what argparse calls the type in its message


def _show(value: object) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, float):
        return f"{value:g}"
    return str(value)
