"""Options made from parameter objects: one for each field, under the field's own name."""

from __future__ import annotations

import argparse
import math
from dataclasses import fields
from typing import Any, TypeVar, get_args

from labkit.registration import IcpParameters, Metric

Parameters = TypeVar("Parameters")

EXPLANATIONS = {
    # labkit.IcpParameters
    "max_correspondence_distance": "gate: pairs farther apart are rejected [m], or `off`",
    "overlap_ratio": "share of the source points that is kept, closest first, in (0, 1]",
    "huber_delta": "residuals beyond it weigh delta/r [m], or `off`",
    "max_iterations": "iteration budget",
    "translation_tolerance": "converged when a step is below this [m] and ...",
    "rotation_tolerance": "... below this [rad]",
    "cost_tolerance": "converged when the cost changes by less [m²]",
    "metric": "what a residual is",
    "step_fraction": "share of each step that is taken, in (0, 1]",
    "approach": "begin with a wide delta, end with a gate of 8 delta",
    # labkit.odometry.SanityLimits
    "max_translation": "farthest motion of a step [m]",
    "max_rotation": "largest rotation of a step [rad]",
    "max_prior_translation": "farthest from the prior [m]",
    "max_prior_rotation": "farthest from the prior [rad]",
    "min_inlier_ratio": "smallest share of inliers",
    "max_rmse": "largest inlier RMSE [m]",
    "min_information": "smallest eigenvalue of the information",
    # labkit.filters.Preprocessing
    "range_min": "drop points nearer than this [m]",
    "range_max": "drop points farther than this [m], or `off`",
    "voxel_size": "thin to one point a cell of this size [m], 0 for none",
    "isolation_radius": "drop points without a neighbour this near [m], 0 for none",
    # labkit.odometry.OdometryParameters
    "retry_gate": "share of the gate in the second attempt",
    "retry_step": "share of each step in the second attempt",
    "on_skip": "without match and prior: hold the last motion once, or stand still",
}
SHORT = {"max_correspondence_distance": "--gate", "overlap_ratio": "--overlap"}
CHOICES = {"metric": get_args(Metric), "on_skip": ("hold", "stand")}


def add_options(
    parser: argparse.ArgumentParser, title: str, defaults: object, names: tuple[str, ...] = ()
) -> None:
    """Add one option for each field of a parameter object, or for those in `names`."""
    group = parser.add_argument_group(title)
    for name in names or tuple(field.name for field in fields(defaults)):  # type: ignore[arg-type]
        default = getattr(defaults, name)
        flags = ["--" + name.replace("_", "-")]
        if name in SHORT:
            flags.insert(0, SHORT[name])
        kind: dict[str, Any] = {"type": number_or_off, "metavar": "X"}
        if name in CHOICES:
            kind = {"choices": CHOICES[name]}
        elif isinstance(default, bool):
            kind = {"action": argparse.BooleanOptionalAction}
        elif isinstance(default, int):
            kind = {"type": int, "metavar": "N"}
        explanation = f"{EXPLANATIONS[name]} (default {_show(default)})"
        group.add_argument(*flags, dest=name, default=default, help=explanation, **kind)


def from_options(kind: type[Parameters], args: argparse.Namespace, **more: object) -> Parameters:
    """Make a parameter object from the options of its fields; `more` gives other fields."""
    names = {field.name for field in fields(kind)}  # type: ignore[arg-type]
    return kind(**{name: value for name, value in vars(args).items() if name in names} | more)


def add_icp_options(parser: argparse.ArgumentParser, defaults: IcpParameters | None = None) -> None:
    """Add the robust parameters of the matcher."""
    add_options(parser, "matching", defaults or IcpParameters())


def number_or_off(text: str) -> float:
    """A number, or infinity for ``off``."""
    return math.inf if text.lower() == "off" else float(text)


number_or_off.__name__ = "number"  # what argparse calls the type in its message


def _show(value: object) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, float):
        return "off" if value == math.inf else f"{value:g}"
    return str(value)
