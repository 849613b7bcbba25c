"""Figures and animations as files: whole or not at all."""

from __future__ import annotations

import os
import re
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib as mpl
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.figure import Figure

from labkit.arrays import check_range
from labkit.errors import InvalidParameterError
from labkit.files import atomic_write

FIGURE_SUFFIXES = (".png", ".pdf", ".svg")
ANIMATION_SUFFIXES = (".gif", ".html")
_ICONS = {  # what the page's buttons show in place of a font from the network
    "minus": "−",
    "plus": "+",
    "fast-backward": "|◀",
    "step-backward": "◁",
    "play fa-flip-horizontal": "◀",
    "pause": "❚❚",
    "play": "▶",
    "step-forward": "▷",
    "fast-forward": "▶|",
}


def save_figure(figure: Figure, path: str | os.PathLike[str], *, dpi: float = 200.0) -> Path:
    """Write a figure; the suffix says the format.

    Parameters
    ----------
    figure : Figure
        What to write.
    path : path-like
        A name that ends in .png, .pdf or .svg. An older file there is replaced, and
        stays as it was if anything goes wrong.
    dpi : float
        Dots per inch of a PNG, and of the map's points in PDF and SVG.

    Returns
    -------
    Path
        The `path` given.

    Raises
    ------
    InvalidParameterError
        For another suffix.
    WriteError
        If the file cannot be written there; a `LabkitError` too.

    Examples
    --------
    >>> from labkit.plotting import book_figure
    >>> save_figure(book_figure(), "figure.bmp")
    Traceback (most recent call last):
    ...
    labkit.errors.InvalidParameterError: a figure's name must end in .png, .pdf or .svg, \
got 'figure.bmp'
    """
    suffix = figure_suffix(path)
    check_range(dpi, "dpi", above=0.0, at_most=2400.0)
    with atomic_write(path, "wb") as file:
        figure.savefig(file, format=suffix[1:], dpi=dpi, bbox_inches="tight", pad_inches=0.08)
    return Path(path)


def figure_suffix(path: str | os.PathLike[str]) -> str:
    """The suffix of a figure's name; raise the `InvalidParameterError` for an unknown one."""
    return _suffix(path, FIGURE_SUFFIXES, "a figure")


def save_animation(
    animation: FuncAnimation, path: str | os.PathLike[str], *, fps: float = 2.5
) -> Path:
    """Write an animation: a .gif, or an .html page with buttons that needs no network.

    Parameters
    ----------
    animation : FuncAnimation
        What to write, e.g. from `animate_icp`.
    path : path-like
        A name that ends in .gif or .html; replaced as by `save_figure`.
    fps : float
        Frames per second.

    Returns
    -------
    Path
        The `path` given.

    Raises
    ------
    InvalidParameterError
        For another suffix.
    WriteError
        If the file cannot be written there; a `LabkitError` too.
    """
    suffix = animation_suffix(path)
    check_range(fps, "fps", above=0.0, at_most=100.0)
    with atomic_write(path, "wb") as file:
        if suffix == ".html":
            body = animation_html(animation, fps=fps)
            file.write(f'<!DOCTYPE html>\n<meta charset="utf-8">\n{body}'.encode())
        else:
            # Pillow's writer wants a name of its own, not an open file.
            with TemporaryDirectory() as folder:
                rendered = Path(folder) / "animation.gif"
                animation.save(rendered, writer=PillowWriter(fps=fps))  # type: ignore[arg-type]
                file.write(rendered.read_bytes())
    return Path(path)


def animation_suffix(path: str | os.PathLike[str]) -> str:
    """The suffix of an animation's name, or the `InvalidParameterError` as `figure_suffix`."""
    return _suffix(path, ANIMATION_SUFFIXES, "an animation")


def animation_html(animation: FuncAnimation, *, fps: float = 2.5) -> str:
    """An animation as a piece of HTML with buttons, for a notebook or a page.

    All frames are in it, and nothing is asked from the network: the icons that
    matplotlib would load are replaced by characters.

    Parameters
    ----------
    animation : FuncAnimation
        What to show.
    fps : float
        Frames per second.

    Returns
    -------
    str
    """
    check_range(fps, "fps", above=0.0, at_most=100.0)
    with mpl.rc_context({"animation.embed_limit": 200.0}):  # MB; beyond it frames get lost
        html: str = animation.to_jshtml(fps=fps)  # type: ignore[arg-type]
    html = re.sub(r'<link rel="stylesheet"\s+href="https?://[^"]*">', "", html)
    return re.sub(
        r'<i class="fa fa-([a-z -]+)"></i>', lambda icon: _ICONS.get(icon[1], icon[1]), html
    )


def _suffix(path: str | os.PathLike[str], known: tuple[str, ...], what: str) -> str:
    suffix = Path(path).suffix.lower()
    if suffix not in known:
        raise InvalidParameterError(
            f"{what}'s name must end in {', '.join(known[:-1])} or {known[-1]}, "
            f"got {os.fspath(path)!r}"
        )
    return suffix
