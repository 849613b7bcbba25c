"""ICP in motion: one frame for the guess and one for each iteration."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from matplotlib.animation import FuncAnimation
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from labkit.arrays import FloatArray, check_range
from labkit.correspondences import Correspondences
from labkit.plotting.pairs import Fate, PairArtists
from labkit.plotting.scans import draw_source, draw_target
from labkit.plotting.style import BLUE, book_figure, legend_below, style_grid, style_plane
from labkit.result import IcpResult
from labkit.se2 import apply

Update = Callable[[int], None]


def animate_icp(result: IcpResult, *, fates: bool = False, interval: int = 400) -> FuncAnimation:
    """Animate a run: the source on its way to the target, and the cost on its way down.

    Parameters
    ----------
    result : IcpResult
        The run, with its scans and its history.
    fates : bool
        Whether each frame shows the pairs and their fates too.
    interval : int
        Milliseconds that a frame stands.

    Returns
    -------
    FuncAnimation
        Of ``result.iterations + 1`` frames. Keep a reference to it, and save it with
        `save_animation` or show it with `animation_html`.

    Raises
    ------
    InvalidParameterError
        Unless `interval` is at least 1.
    """
    p, q = result.source.points, result.target.points
    check_range(interval, "interval", at_least=1, unit="ms")
    pairs = [each.correspondences for each in result.history]
    path = [apply(each.T_target_source, p) for each in result.history]

    figure = book_figure(6.4)
    plane, cost = figure.subplots(2, 1, height_ratios=[4, 1])
    show_scans = _scans_on(plane, path, q, pairs if fates else None)
    show_cost = _cost_on(cost, result)

    def show(k: int) -> Iterable[Artist]:
        show_scans(k)
        show_cost(k)
        at = f"iteration {k} of {result.iterations}" if k else "initial guess"
        plane.set_title(f"{at}: J = {result.history[k].cost:.3g} m²")
        return ()

    show(0)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # laid out once, so that nothing jumps between frames
    return FuncAnimation(
        figure,
        show,
        frames=len(path),
        init_func=lambda: show(0),
        interval=interval,
        repeat_delay=1500,
        cache_frame_data=False,
    )


def _scans_on(
    ax: Axes, path: list[FloatArray], target: FloatArray, pairs: list[Correspondences] | None
) -> Update:
    drawn_target = draw_target(ax, target)
    style_plane(ax)
    everything = np.vstack([target, *path])
    low, high = everything.min(axis=0), everything.max(axis=0)
    margin = 0.03 * float((high - low).max()) or 1.0
    ax.set_xlim(low[0] - margin, high[0] + margin)
    ax.set_ylim(low[1] - margin, high[1] + margin)
    if pairs is None:
        line = draw_source(ax, path[0], f"source ({len(path[0])} points)")
        legend_below(ax)

        def move(k: int) -> None:
            line.set_data(*path[k].T)

        return move

    no_line = any(np.isnan(each.residuals).any() for each in pairs)
    artists = PairArtists(ax, [fate for fate in Fate if no_line or fate is not Fate.NO_LINE])
    artists.update(pairs[0])
    legend = legend_below(ax, [drawn_target, *artists.legend_handles()])

    def pair(k: int) -> None:
        artists.update(pairs[k])
        for text, points in zip(legend.get_texts()[1:], artists.points.values(), strict=True):
            text.set_text(str(points.get_label()))

    return pair


def _cost_on(ax: Axes, result: IcpResult) -> Update:
    cost = np.array([each.cost for each in result.history])
    number = np.arange(len(cost))
    drawable = np.where(cost > 0.0, cost, np.nan)
    ax.plot(number, drawable, "-", color="0.75", linewidth=1.0)
    (past,) = ax.plot([], [], "o-", color=BLUE, markersize=3.5, linewidth=1.4)
    if np.isfinite(drawable).any():
        ax.set_yscale("log")
    style_grid(ax)
    ax.set_xlim(-0.4, len(cost) - 0.6)
    ax.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    ax.set_xlabel("iteration")
    ax.set_ylabel("cost J [m²]")

    def go(k: int) -> None:
        past.set_data(number[: k + 1], drawable[: k + 1])

    return go
