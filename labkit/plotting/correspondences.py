"""Which point was matched with which, and which of the pairs were believed."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from labkit.arrays import as_transform, check_partners
from labkit.correspondences import Correspondences
from labkit.plotting.checks import scan_points
from labkit.plotting.fates import Fate, fates
from labkit.plotting.pair_artists import PairArtists
from labkit.plotting.scans import draw_target
from labkit.plotting.style import legend_below, style_plane
from labkit.scan import Scan
from labkit.se2 import apply


def plot_correspondences(
    ax: Axes,
    source: Scan | ArrayLike,
    target: Scan | ArrayLike,
    T_target_source: ArrayLike,
    pairs: Correspondences,
) -> Axes:
    """Draw each pair as a line from the moved source point to its target point.

    Line and marker tell the pair's fate, see `labkit.plotting.fates`; the legend counts
    each of them. "no line" appears only where it happened.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    source : Scan or array_like, shape (N, 2)
        The newer scan [m].
    target : Scan or array_like, shape (M, 2)
        The older scan [m].
    T_target_source : array_like, shape (3, 3)
        The pose at which `pairs` were found: `T_target_source` of an `IcpResult`, or
        ``history[-1].T_target_source`` where the run failed.
    pairs : Correspondences
        The association. Of one from afar, which looks at every so many-th point, those are drawn.

    Returns
    -------
    Axes
        The `ax` given.

    Raises
    ------
    InvalidPointsError
        For scans or a transform that cannot be meant, or pairs of other scans.

    Examples
    --------
    >>> import labkit
    >>> from labkit.plotting import book_figure
    >>> target = [[0.0, 0.0], [4.0, 0.0], [0.0, 3.0], [4.0, 3.0]]
    >>> source = [[0.1, 0.0], [4.1, 0.0], [0.1, 3.0], [4.9, 3.0]]
    >>> run = labkit.icp(source, target)
    >>> ax = plot_correspondences(
    ...     book_figure().subplots(), source, target, run.T_target_source, run.correspondences
    ... )
    >>> [text.get_text() for text in ax.get_legend().get_texts()][1:3]
    ['gated: 1', 'trimmed: 0']
    """
    p, q = scan_points(source, "source"), scan_points(target, "target")
    check_partners(pairs.target_index, pairs.every, p, q, "pairs")
    moved = apply(as_transform(T_target_source, "T_target_source"), p)
    drawn_target = draw_target(ax, q)
    occurring = set(np.unique(fates(pairs)).tolist())
    shown = [fate for fate in Fate if fate is not Fate.NO_LINE or fate in occurring]
    artists = PairArtists(ax, shown)
    artists.update(moved, q, pairs)
    ax.relim()
    ax.autoscale_view()
    style_plane(ax)
    ax.set_title(f"{pairs.inlier_count} of {len(pairs.kept)} pairs kept")
    legend_below(ax, [drawn_target, *artists.legend_handles()])
    return ax
