"""Right answers of different kinds, each file a whole submission; all of them get full marks.

They are written as students write, on numpy or less, and import nothing of labkit.
"""

from labkit.course.authoring import solution

from . import homogeneous, plain_python, single_precision

RIGHT = (solution, plain_python, homogeneous, single_precision)
