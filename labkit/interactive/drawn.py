"""Widgets that bring a picture along, for paper and for programs that run no script."""

from __future__ import annotations

import base64
import io
from typing import Any

import anywidget
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from labkit.plotting import book_figure
from labkit.support.arrays import FloatArray

HEIGHT = 3.6  # of a picture [in]
DPI = 150
OUTSIDE = 0.05  # of the points, on each side of the picture, as in plane.js


class DrawnWidget(anywidget.AnyWidget):
    """A widget that is shown as a picture where it cannot be shown itself."""

    def draw(self, figure: Figure) -> None:
        """Draw on an empty figure what the widget shows at first."""
        raise NotImplementedError

    def _repr_mimebundle_(self, **kwargs: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        bundle = super()._repr_mimebundle_(**kwargs)
        assert bundle is not None  # anywidget gives none for a widget without a view
        data, metadata = bundle
        figure = book_figure(HEIGHT)
        self.draw(figure)
        png = io.BytesIO()
        figure.savefig(png, format="png", dpi=DPI)
        return data | {"image/png": base64.b64encode(png.getvalue()).decode("ascii")}, metadata


def frame_points(ax: Axes, points: FloatArray) -> None:
    """Let `ax` show the points (N, 2), but for lone ones far away."""
    low, high = np.quantile(points, [OUTSIDE, 1.0 - OUTSIDE], axis=0)
    margin = 0.1 * (high - low)
    low = np.maximum(points.min(axis=0), low - margin)
    high = np.minimum(points.max(axis=0), high + margin)
    flat = low == high  # a wall along an axis
    left, bottom = low - 0.5 * flat
    right, top = high + 0.5 * flat
    ax.set(xlim=(left, right), ylim=(bottom, top))
