"""Figures as pictures inside a widget."""

from __future__ import annotations

import base64
import html
import io

from matplotlib.figure import Figure
from PIL import Image

COLORS = 128  # of a picture's palette; line drawings need fewer, and the file shrinks to a third
DPI = 150


def picture(figure: Figure, alt: str) -> str:
    """The figure as an HTML image that carries its own data; `alt` says what it shows."""
    drawn, packed = io.BytesIO(), io.BytesIO()
    figure.savefig(drawn, format="png", dpi=DPI)
    Image.open(drawn).convert("RGB").quantize(COLORS).save(packed, format="png", optimize=True)
    data = base64.b64encode(packed.getvalue()).decode("ascii")
    return (
        f'<img src="data:image/png;base64,{data}" alt="{html.escape(alt, quote=True)}" '
        f'style="width: 100%; max-width: 700px; background: white">'
    )
