"""A covariance as the ellipse that should hold 95 % of the estimates."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Ellipse
from numpy.typing import ArrayLike

from labkit.support.arrays import as_covariance, as_numbers

SHARE = 0.95  # of the estimates, inside the ellipse


def plot_covariance(ax: Axes, mean: ArrayLike, covariance: ArrayLike, **style: Any) -> Axes:
    """Draw the ellipse of a two-dimensional Gaussian that holds 95 % of its mass.

    Parameters
    ----------
    mean, covariance : array_like, shapes (2,) and (2, 2)
        In the axes' units; the covariance is positive semi-definite.
    **style
        Of the `matplotlib.patches.Ellipse`: ``edgecolor``, ``linestyle``, ``label``, ...

    Notes
    -----
    In two dimensions the squared Mahalanobis distance is exponential with mean 2, so the
    ellipse reaches out to −2 ln 0.05 of it.

    Examples
    --------
    >>> from labkit.plotting import book_figure
    >>> ax = plot_covariance(book_figure().subplots(), [0, 0], [[4, 0], [0, 1]])
    >>> round(ax.patches[0].width, 2), round(ax.patches[0].height, 2)
    (9.79, 4.9)
    """
    center = as_numbers(mean, "mean", "x, y")
    values, vectors = np.linalg.eigh(as_covariance(covariance, "covariance", 2))
    reach = math.sqrt(-2.0 * math.log(1.0 - SHARE))
    minor, major = (2.0 * reach * np.sqrt(np.maximum(values, 0.0))).tolist()
    look = {"facecolor": "none", "edgecolor": "black", "linewidth": 1.4} | style
    angle = math.degrees(math.atan2(vectors[1, 1], vectors[0, 1]))
    ax.add_patch(Ellipse((center[0], center[1]), major, minor, angle=angle, **look))
    ax.autoscale_view()
    return ax
