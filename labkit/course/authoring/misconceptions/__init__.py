"""Known mistakes: wrong implementations whose answers are known, so that they get a name.

The functions take what the question's function takes. What is said of them is read by students.
"""

from labkit.course.authoring.entries import MISTAKES
from labkit.course.authoring.misconceptions import alignment, correspondences, loop, odometry, se2

__all__ = ["MISTAKES", "alignment", "correspondences", "loop", "odometry", "se2"]
