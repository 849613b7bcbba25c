"""What became of each pair: the stage that rejected it, or the weight that it got."""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from labkit.correspondences import Correspondences


class Fate(IntEnum):
    """The end of a pair on its way through gate, trimming and weighting.

    A pair that several stages reject is counted at the first of them, in the order of
    the lesson's flow chart.
    """

    GATED = 0  # farther apart than d_max
    TRIMMED = 1  # not among the ⌊ρN⌋ closest
    NO_LINE = 2  # point-to-line only: the target has no normal there
    DOWN_WEIGHTED = 3  # kept, residual beyond Huber's δ
    KEPT = 4  # kept with full weight

    @property
    def label(self) -> str:
        """The word for a legend."""
        return self.name.lower().replace("down_", "down-").replace("_", " ")


def fates(pairs: Correspondences) -> NDArray[np.int8]:
    """The fate of each pair.

    Parameters
    ----------
    pairs : Correspondences
        One association of N source points.

    Returns
    -------
    ndarray of int8, shape (N,)
        Values of `Fate`. Every pair has exactly one.

    Examples
    --------
    >>> import labkit
    >>> target = [[0.0, 0.0], [4.0, 0.0], [0.0, 3.0], [4.0, 3.0]]
    >>> moved = [[0.1, 0.0], [4.1, 0.0], [0.1, 3.0], [4.9, 3.0]]
    >>> result = labkit.icp(moved, target)
    >>> [Fate(fate).label for fate in fates(result.correspondences)]
    ['kept', 'kept', 'kept', 'gated']
    """
    return np.select(
        [~pairs.within_gate, ~pairs.within_overlap, ~pairs.kept, pairs.weights < 1.0],
        [
            np.int8(Fate.GATED),
            np.int8(Fate.TRIMMED),
            np.int8(Fate.NO_LINE),
            np.int8(Fate.DOWN_WEIGHTED),
        ],
        default=np.int8(Fate.KEPT),
    )
