"""Sliders over pictures: alive in JupyterLab, and in a built page without a kernel.

Python draws every picture beforehand, and the slider merely turns them over in the
reader's browser. No value is left that was not drawn when the notebook ran.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TypeVar

import anywidget
import traitlets
from matplotlib.figure import Figure
from PIL import Image

from labkit.interactive.explorer.widget import FOLDER as EXPLORER
from labkit.interactive.explorer.widget import joined
from labkit.plotting import book_figure
from labkit.support.errors import InvalidParameterError

Value = TypeVar("Value")
DPI = 150
FOLDER = Path(__file__).parent


class Flipbook(anywidget.AnyWidget):
    """A slider above one of several pictures; make one with `flipbook`.

    `index` says which is shown; `pictures` are WebP in base64, of `size` in pixels.
    """

    _esm = joined([EXPLORER / "controls.js", FOLDER / "flipbook.js"])
    _css = FOLDER.joinpath("flipbook.css").read_text("utf-8")

    label = traitlets.Unicode().tag(sync=True)
    alt = traitlets.Unicode().tag(sync=True)
    readouts = traitlets.List(traitlets.Unicode()).tag(sync=True)
    pictures = traitlets.List(traitlets.Unicode()).tag(sync=True)
    size = traitlets.Dict().tag(sync=True)
    index = traitlets.Int().tag(sync=True)

    @traitlets.validate("index")
    def _drawn(self, proposal: dict[str, int]) -> int:
        index = proposal["value"]
        if not 0 <= index < len(self.readouts):
            raise InvalidParameterError(
                f"must be an index of the {len(self.readouts)} values, got {index!r}",
                parameter="start",
            )
        return index


def flipbook(
    draw: Callable[[Figure, Value], object],
    values: Iterable[Value],
    *,
    label: str,
    alt: str,
    start: int = 0,
    height: float = 4.5,
) -> Flipbook:
    """A slider over pictures, one for each value, all of them drawn now.

    Parameters
    ----------
    draw : callable
        ``draw(figure, value)`` draws on an empty figure of the book's width. Fix the
        limits of its axes, or the picture will jump.
    values : iterable
        What the slider can be set to, in its order; at least two, no two of which read alike.
    label : str
        What the slider changes, with its unit.
    alt : str
        What the pictures show, for those who cannot see them; the value is added.
    start : int
        Index of the value shown first.
    height : float
        Of the figure [in].

    Examples
    --------
    >>> def line(figure, slope):
    ...     figure.subplots().axline((0.0, 0.0), slope=slope)
    >>> book = flipbook(line, [0.0, 0.5, 1.0], label="slope", alt="a straight line")
    """
    values = list(values)  # a generator is spent after one pass
    readouts = [str(value) for value in values]
    if len(readouts) < 2 or len(set(readouts)) < len(readouts):
        raise InvalidParameterError(
            f"must be at least two that read differently, got {readouts}", parameter="values"
        )
    pictures = []
    for value in values:
        figure = book_figure(height)
        draw(figure, value)
        pictures.append(_picture(figure))
    return Flipbook(
        label=label,
        alt=alt,
        readouts=readouts,
        pictures=pictures,
        size={"width": round(DPI * figure.get_figwidth()), "height": round(DPI * height)},
        index=start,
    )


def _picture(figure: Figure) -> str:
    """The figure as WebP, in base64."""
    drawn, packed = io.BytesIO(), io.BytesIO()
    figure.savefig(drawn, format="png", dpi=DPI)
    Image.open(drawn).convert("RGB").save(packed, format="webp", lossless=True)
    return base64.b64encode(packed.getvalue()).decode("ascii")
