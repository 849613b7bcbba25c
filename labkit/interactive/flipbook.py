"""Sliders over pictures: alive in JupyterLab, and in a built page without a kernel.

Python draws every picture beforehand, and the slider merely turns them over in the
reader's browser. No value is left that was not drawn when the notebook ran.
"""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Callable, Iterable
from typing import TypeVar

import ipywidgets
from matplotlib.figure import Figure
from PIL import Image

from labkit.errors import InvalidParameterError
from labkit.plotting import book_figure

Value = TypeVar("Value")
DPI = 150


def flipbook(
    draw: Callable[[Figure, Value], object],
    values: Iterable[Value],
    *,
    label: str,
    alt: str,
    readout: Callable[[Value], str] = str,
    start: int = 0,
    height: float = 4.5,
) -> ipywidgets.VBox:
    """A slider over pictures, one for each value, all of them drawn now.

    Parameters
    ----------
    draw : callable
        ``draw(figure, value)`` draws on an empty figure of the book's width. Fix the
        limits of its axes, or the picture will jump.
    values : iterable
        What the slider can be set to, in its order; at least two.
    label : str
        What the slider changes, with its unit.
    alt : str
        What the pictures show, for those who cannot see them; the value is added.
    readout : callable
        How a value is written beside the slider. No two may be written alike.
    start : int
        Index of the value shown first.
    height : float
        Of the figure, in inches.

    Returns
    -------
    ipywidgets.VBox
        The slider above the pictures.

    Raises
    ------
    InvalidParameterError
        For fewer than two values, two that read alike, or a `start` outside them.

    Examples
    --------
    >>> def line(figure, slope):
    ...     figure.subplots().axline((0.0, 0.0), slope=slope)
    >>> book = flipbook(line, [0.0, 0.5, 1.0], label="slope", alt="a straight line")
    >>> slider, pages = book.children
    >>> slider.index, len(pages.children)
    (0, 3)
    """
    values = list(values)  # a generator is spent after one pass
    readouts = [readout(value) for value in values]
    if len(readouts) < 2 or len(set(readouts)) < len(readouts):
        raise InvalidParameterError(
            f"must be at least two that read differently, got {readouts}", parameter="values"
        )
    if not 0 <= start < len(readouts):
        raise InvalidParameterError(
            f"must be an index of the {len(readouts)} values, got {start!r}", parameter="start"
        )
    pages = []
    for value, text in zip(values, readouts, strict=True):
        figure = book_figure(height)
        draw(figure, value)
        pages.append(ipywidgets.HTML(_picture(figure, f"{alt}; {label}: {text}")))
    slider = ipywidgets.SelectionSlider(
        options=[(text, index) for index, text in enumerate(readouts)],
        index=start,
        description=label,
        style={"description_width": "initial"},
        layout={"width": "min(100%, 560px)"},
    )
    stack = ipywidgets.Stack(pages, selected_index=start)
    ipywidgets.jslink((slider, "index"), (stack, "selected_index"))
    return ipywidgets.VBox([slider, stack])


def _picture(figure: Figure, alt: str) -> str:
    """The figure as an HTML image that carries its own data; `alt` says what it shows."""
    drawn, packed = io.BytesIO(), io.BytesIO()
    figure.savefig(drawn, format="png", dpi=DPI)
    Image.open(drawn).convert("RGB").save(packed, format="webp", lossless=True)
    data = base64.b64encode(packed.getvalue()).decode("ascii")
    return (
        f'<img src="data:image/webp;base64,{data}" alt="{html.escape(alt, quote=True)}" '
        f'style="width: 100%; max-width: 700px; background: white">'
    )
