"""Figures and animations as files: whole or not at all."""

from __future__ import annotations

import os
import re
from pathlib import Path
from tempfile import TemporaryDirectory

from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.figure import Figure

from labkit.errors import InvalidParameterError
from labkit.files import atomic_write

FPS = 2.5
_ICONS = {"minus": "−", "plus": "+", "pause": "❚❚", "play": "▶", "play fa-flip-horizontal": "◀"}
_ICONS |= {"fast-backward": "|◀", "step-backward": "◁", "step-forward": "▷", "fast-forward": "▶|"}


def save_figure(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write a figure as .png, .pdf or .svg; raise a `LabkitError` where that cannot be."""
    suffix = figure_suffix(path)
    with atomic_write(path, "wb") as file:
        figure.savefig(file, format=suffix[1:], dpi=200.0, bbox_inches="tight", pad_inches=0.08)


def save_animation(animation: FuncAnimation, path: str | os.PathLike[str]) -> None:
    """Write an animation as .gif, or as an .html page with buttons that needs no network."""
    suffix = animation_suffix(path)
    with atomic_write(path, "wb") as file, TemporaryDirectory() as folder:
        if suffix == ".html":
            page = re.sub(r'<link[^>]*"https?://[^>]*>', "", animation.to_jshtml(fps=FPS))  # type: ignore[arg-type]
            page = re.sub(r'<i class="fa fa-([a-z -]+)"></i>', lambda icon: _ICONS[icon[1]], page)
            file.write(f'<!DOCTYPE html>\n<meta charset="utf-8">\n{page}'.encode())
        else:  # Pillow's writer wants a name, not an open file
            rendered = Path(folder) / "animation.gif"
            animation.save(rendered, writer=PillowWriter(fps=FPS))  # type: ignore[arg-type]
            file.write(rendered.read_bytes())


def figure_suffix(path: str | os.PathLike[str]) -> str:
    """The suffix of a figure's name; raise the `InvalidParameterError` for an unknown one."""
    return _suffix(path, "a figure", ".png", ".pdf", ".svg")


def animation_suffix(path: str | os.PathLike[str]) -> str:
    """The suffix of an animation's name, or the `InvalidParameterError` as `figure_suffix`."""
    return _suffix(path, "an animation", ".gif", ".html")


def _suffix(path: str | os.PathLike[str], what: str, *known: str) -> str:
    suffix = Path(path).suffix.lower()
    if suffix not in known:
        names = f"{', '.join(known[:-1])} or {known[-1]}"
        raise InvalidParameterError(f"{what}'s name must end in {names}, got {os.fspath(path)!r}")
    return suffix
