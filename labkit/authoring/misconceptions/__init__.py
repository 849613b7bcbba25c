"""Known mistakes: wrong implementations whose answers are known, so that they get a name.

The functions take what the question's function takes. Their docstrings are read by students.
"""

from labkit.authoring.misconceptions import alignment, endings, loop, odometry, pairs, se2
from labkit.authoring.mistake import MISTAKES

__all__ = ["MISTAKES", "alignment", "endings", "loop", "odometry", "pairs", "se2"]
