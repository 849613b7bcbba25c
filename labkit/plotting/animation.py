"""ICP in motion: one frame for the guess and one for each iteration."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from matplotlib.animation import FuncAnimation
from matplotlib.artist import Artist
from matplotlib.ticker import MaxNLocator

from labkit.plotting.scans import draw_source, draw_target
from labkit.plotting.style import SOURCE, book_figure, legend_below, style_plane
from labkit.result import IcpResult
from labkit.se2 import apply

INTERVAL = 400  # ms that a frame stands


def animate_icp(result: IcpResult) -> FuncAnimation:
    """Animate a run: the source on its way to the target, and the cost on its way down.

    There are ``result.iterations + 1`` frames; `save_animation` writes them.
    """
    p, q = result.source.points, result.target.points
    path = [apply(each.T_target_source, p) for each in result.history]
    cost = np.array([each.cost for each in result.history])
    drawable = np.where(cost > 0.0, cost, np.nan)

    figure = book_figure(6.4)
    plane, curve = figure.subplots(2, 1, height_ratios=[4, 1])
    draw_target(plane, q)
    source = draw_source(plane, path[0], f"source ({len(p)} points)")
    style_plane(plane)
    everything = np.vstack([q, *path])
    low, high = everything.min(axis=0), everything.max(axis=0)
    margin = 0.03 * float((high - low).max()) or 1.0
    plane.set_xlim(low[0] - margin, high[0] + margin)
    plane.set_ylim(low[1] - margin, high[1] + margin)
    legend_below(plane)
    curve.plot(drawable, "-", color="0.75", linewidth=1.0)
    (past,) = curve.plot([], [], "o-", color=SOURCE, markersize=3.5, linewidth=1.4)
    if np.isfinite(drawable).any():
        curve.set_yscale("log")
    curve.set_xlim(-0.4, len(cost) - 0.6)
    curve.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    curve.set_xlabel("iteration")
    curve.set_ylabel("cost J [m²]")

    def show(k: int) -> Iterable[Artist]:
        source.set_data(*path[k].T)
        past.set_data(np.arange(k + 1), drawable[: k + 1])
        at = f"iteration {k} of {result.iterations}" if k else "initial guess"
        plane.set_title(f"{at}: J = {cost[k]:.3g} m²")
        return ()

    show(0)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # laid out once, so that nothing jumps between frames
    return FuncAnimation(
        figure, show, len(path), lambda: show(0), interval=INTERVAL, cache_frame_data=False
    )
