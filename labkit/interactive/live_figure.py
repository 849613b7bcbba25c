"""Figures that the page computes anew at each move of a slider, with a kernel or without one.

What a figure computes is written in ``models.js``; the tests hold it to labkit.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import anywidget
import traitlets
from numpy.typing import ArrayLike

from labkit.interactive.explorer.widget import base64_of, slider_values, told
from labkit.interactive.front_end import bundle, style
from labkit.parameters import IcpParameters
from labkit.support.arrays import as_floats

MODELS = ("turn", "outlier", "cuts", "race")


class LiveFigure(anywidget.AnyWidget):
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
    given = traitlets.Dict().tag(sync=True)


def live_figure(
    model: str,
    sliders: Mapping[str, Iterable[float]],
    *,
    label: str,
    start: Sequence[float],
    xlim: tuple[float, float],
    ylim: tuple[float, float],
    **given: ArrayLike | IcpParameters,
) -> LiveFigure:
    """A picture that is computed where it is read, each time that a slider moves.

    `model` is one of ``models.js``, and `given` what it is about, by the names that it knows. Each
    slider, in the order of the model's arguments, has a name with its unit and its values; `label`
    says what the picture shows, for those who cannot see it, and (`xlim`, `ylim`) [m] how much of
    the plane is seen.
    """
    return LiveFigure(
        model_name=model,
        label=label,
        sliders=[{"label": k, "values": slider_values(k, v)} for k, v in sliders.items()],
        values=[float(each) for each in start],
        window=[*map(float, (*xlim, *ylim))],
        given={name: packed_given(name, value) for name, value in given.items()},
    )


def packed_given(name: str, value: ArrayLike | IcpParameters) -> Any:
    """Arguments of a model as JSON: parameters by name, numbers, arrays as base64."""
    if isinstance(value, IcpParameters):
        return told(value)
    rows = as_floats(value, name)
    return base64_of(rows) if rows.ndim else float(rows)
