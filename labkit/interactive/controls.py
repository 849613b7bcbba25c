"""The settings of a widget: one entry for each parameter, which Python and the page read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any, get_args

import traitlets

from labkit.parameters import IcpParameters, Metric

# Equal steps of a slider change a distance equally much, as on a log scale [m].
SHORT_DISTANCES = (0.01, 0.015, 0.02, 0.03, 0.04, 0.05, 0.07, 0.1, 0.12, 0.15, 0.2, 0.25, 0.3)
DISTANCES = (*SHORT_DISTANCES, 0.4, 0.5, 0.7, 1.0, 1.2, 1.5, 2.0)


@dataclass(frozen=True, kw_only=True)
class Control:
    """A parameter of `IcpParameters` under the reader's hand.

    `trait` makes the attribute of the widget that holds it. `values` are those of a slider, in
    their order, None for off; or those of a list to choose from. A check box has none.
    """

    name: str
    kind: str  # "slider", "choice" or "checkbox"
    trait: Callable[[], Any]
    values: tuple[float | str | None, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """The entry as the page has it: with label, explanation and unit of the parameter."""
        (words,) = (field.metadata for field in fields(IcpParameters) if field.name == self.name)
        return {"name": self.name, "kind": self.kind, "values": self.values, **words}


CONTROLS = (
    Control(
        name="metric",
        kind="choice",
        trait=lambda: traitlets.Enum(get_args(Metric)),
        values=get_args(Metric),
    ),
    Control(
        name="max_correspondence_distance",
        kind="slider",
        trait=lambda: traitlets.Float(allow_none=True),
        values=(*(distance for distance in DISTANCES if distance >= 0.05), None),
    ),
    Control(
        name="overlap_ratio",
        kind="slider",
        trait=traitlets.Float,
        values=tuple(percent / 100 for percent in range(20, 101)),
    ),
    Control(
        name="huber_delta",
        kind="slider",
        trait=lambda: traitlets.Float(allow_none=True),
        values=(*(distance for distance in DISTANCES if distance <= 0.5), None),
    ),
    Control(name="approach", kind="checkbox", trait=traitlets.Bool),
)
NAMES = tuple(control.name for control in CONTROLS)
SLIDERS = tuple(control.name for control in CONTROLS if control.kind == "slider")
