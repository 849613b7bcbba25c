"""Sections of the assignment: of each question the cases, and the mistakes that get a name.

What is said of a mistake is read by students.
"""

from labkit.course.authoring.entries import ENTRIES
from labkit.course.authoring.sections import alignment, correspondences, loop, odometry, se2

__all__ = ["ENTRIES", "alignment", "correspondences", "loop", "odometry", "se2"]
