"""Options made from fields of parameter objects; default, meaning and unit are the field's."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from dataclasses import fields
from typing import Any, get_args, get_type_hints

SHORT = {
    "max_correspondence_distance": "--gate",
    "overlap_ratio": "--overlap",
    "huber_delta": "--huber",
}
MATCHING = ("metric", *SHORT)


def flag(name: str) -> str:
    """Option of a field: its own name, or a short one."""
    return SHORT.get(name, "--" + name.replace("_", "-"))


def add_options(
    parser: argparse.ArgumentParser, title: str, defaults: Any, names: Sequence[str]
) -> None:
    """Add an option for each of the named fields, numbers or choices, of a parameter object."""
    group = parser.add_argument_group(title)
    hints = get_type_hints(type(defaults))
    for field in fields(defaults):
        if field.name not in names:
            continue
        default = getattr(defaults, field.name)
        choices = get_args(hints[field.name])
        unit = f" [{field.metadata['unit']}]" if "unit" in field.metadata else ""
        shown = f"{default:g}" if isinstance(default, float) else default
        group.add_argument(
            flag(field.name),
            dest=field.name,
            default=default,
            help=f"{field.metadata['help']}{unit} (default {shown})",
            **({"choices": choices} if choices else {"type": number_or_off, "metavar": "X"}),
        )


def chosen(args: argparse.Namespace, names: Sequence[str]) -> dict[str, Any]:
    """Values of the named fields on the command line."""
    return {name: getattr(args, name) for name in names}


def number_or_off(text: str) -> float:
    """Convert a number; ``off`` is infinity."""
    return math.inf if text.lower() == "off" else float(text)


number_or_off.__name__ = "number"  # argparse's word for the type in its message
