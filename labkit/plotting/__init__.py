"""Pictures of what the lab computes: scans, pairs, convergence, trajectories, quality.

A plotter draws on the `ax` that it is given, a matplotlib ``Axes``, and returns it; none touches
pyplot. Scans are a `Scan` or an array of points (N, 2); what is no scan raises the
`InvalidPointsError`. Lengths are in metres, axes are equal where they show the plane. What a colour
means stands in `labkit.plotting.style`; no figure leans on colour alone.
"""

from labkit.plotting.convergence import plot_convergence
from labkit.plotting.covariance import plot_covariance
from labkit.plotting.observability import plot_observability
from labkit.plotting.pairs import plot_correspondences
from labkit.plotting.quality import plot_quality
from labkit.plotting.scans import plot_scans
from labkit.plotting.style import book_figure
from labkit.plotting.trajectory import map_points, plot_trajectory

__all__ = [
    "book_figure",
    "map_points",
    "plot_convergence",
    "plot_correspondences",
    "plot_covariance",
    "plot_observability",
    "plot_quality",
    "plot_scans",
    "plot_trajectory",
]
