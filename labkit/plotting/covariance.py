"""A covariance as the ellipse that should hold 95 % of the estimates."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Ellipse
from numpy.typing import ArrayLike

from labkit.support.arrays import as_covariance, as_numbers, check_kind

PROBABILITY = 0.95  # that an estimate lies inside the ellipse
RADIUS = math.sqrt(-2.0 * math.log(1.0 - PROBABILITY))  # of the ellipse, in standard deviations


def plot_covariance(ax: Axes, mean: ArrayLike, covariance: ArrayLike, **style: Any) -> Axes:
    """Draw the ellipse of a two-dimensional Gaussian that holds 95 % of its mass.

    Parameters
    ----------
    mean, covariance : array_like, shapes (2,) and (2, 2)
        In the axes' units; the covariance is positive semi-definite.
    **style
        Properties of `matplotlib.patches.Ellipse`: ``edgecolor``, ``linestyle``, ``label``, ...

    Notes
    -----
    In two dimensions the squared Mahalanobis distance is exponential with mean 2. On the
    ellipse it is −2 ln 0.05.

    Examples
    --------
    >>> from labkit.plotting import book_figure
    >>> ax = plot_covariance(book_figure().subplots(), [0, 0], [[4, 0], [0, 1]])
    >>> round(ax.patches[0].width, 2), round(ax.patches[0].height, 2)
    (9.79, 4.9)
    """
    check_kind(ax, "ax", Axes)
    x, y = as_numbers(mean, "mean", "x, y").tolist()
    variances, directions = np.linalg.eigh(as_covariance(covariance, "covariance", 2))
    minor, major = (2.0 * RADIUS * np.sqrt(np.maximum(variances, 0.0))).tolist()
    angle = math.degrees(math.atan2(directions[1, 1], directions[0, 1]))
    properties = {"facecolor": "none", "edgecolor": "black", "linewidth": 1.4} | style
    ax.add_patch(Ellipse((x, y), major, minor, angle=angle, **properties))
    ax.autoscale_view()
    return ax
