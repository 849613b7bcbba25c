"""Figures that the page computes anew at each move of a slider, with a kernel or without one.

A figure's computation is written in ``models.js``; the tests hold it to labkit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import traitlets
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from labkit.interactive.drawn import DrawnWidget
from labkit.interactive.explorer.widget import (
    from_base64,
    parameters_to_json,
    to_base64,
    values_of_sliders,
)
from labkit.interactive.front_end import bundle, style
from labkit.parameters import IcpParameters
from labkit.plotting.scans import draw_target
from labkit.plotting.style import SOURCE, legend_below, style_plane
from labkit.support.arrays import as_floats, check_choice

MODELS = ("turn", "trace", "outlier", "cuts", "race")


class LiveFigure(DrawnWidget):
    """Sliders beside a picture that the page computes; make one with `live_figure`.

    `values` say where the sliders stand, `window` is (left, right, bottom, top) [m].
    """

    _esm = bundle("live_figure.js")
    _css = style("live_figure.css")

    model_name = traitlets.Enum(MODELS).tag(sync=True)
    label = traitlets.Unicode().tag(sync=True)
    sliders: traitlets.List[Any] = traitlets.List().tag(sync=True)
    values = traitlets.List(traitlets.Float()).tag(sync=True)
    window = traitlets.List(traitlets.Float(), minlen=4, maxlen=4).tag(sync=True)
    model_data = traitlets.Dict().tag(sync=True)

    def draw(self, figure: Figure) -> None:
        """Draw the points that the figure is given, before they are moved."""
        ax = figure.subplots()
        draw_target(ax, from_base64(self.model_data["target"]).reshape(-1, 2))
        if "source" in self.model_data:
            source = from_base64(self.model_data["source"]).reshape(-1, 2)
            ax.plot(*source.T, "o", ms=3.8, mfc="none", color=SOURCE, label="source")
        style_plane(ax)
        left, right, bottom, top = self.window
        ax.set(xlim=(left, right), ylim=(bottom, top), title=self.label)
        legend_below(ax)


def live_figure(
    model: str,
    sliders: Mapping[str, ArrayLike],
    *,
    label: str,
    start: Sequence[float],
    xlim: tuple[float, float],
    ylim: tuple[float, float],
    **model_data: ArrayLike | IcpParameters,
) -> LiveFigure:
    """A picture that is computed where it is read, each time that a slider moves.

    Parameters
    ----------
    model : {"turn", "trace", "outlier", "cuts", "race"}
        Name of the model that the page computes; see ``models.js``.
    sliders : mapping of str to array_like, shape (N,)
        Values of each slider, by its name with its unit, in the order of the model's arguments.
    label : str
        Description of the picture, for those who cannot see it.
    start : sequence of float
        Where each slider stands at first.
    xlim, ylim : (float, float)
        Part of the plane that is shown [m].
    **model_data
        Numbers, arrays and parameters of the model, by the names that it knows.
    """
    check_choice(model, "model", *MODELS)
    window = as_floats([*xlim, *ylim], "xlim, ylim", "give (left, right), (bottom, top)", (4,))
    values_by_name = values_of_sliders(sliders)
    values = as_floats(start, "start", "give one number per slider", (len(values_by_name),))
    return LiveFigure(
        model_name=model,
        label=label,
        sliders=[{"label": name, "values": values} for name, values in values_by_name.items()],
        values=values.tolist(),
        window=window.tolist(),
        model_data={name: argument_to_json(name, value) for name, value in model_data.items()},
    )


def argument_to_json(name: str, value: ArrayLike | IcpParameters) -> Any:
    """Encode an argument of a model: parameters by name, a number, or an array as base64."""
    if isinstance(value, IcpParameters):
        return parameters_to_json(value)
    array = as_floats(value, name)
    return to_base64(array) if array.ndim else float(array)
