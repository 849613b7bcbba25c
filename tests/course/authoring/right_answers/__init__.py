"""Right answers of different kinds, each file a submission; all of them get full marks.

They are written as students write, on numpy or less, and import nothing of labkit. What a file
leaves out is as in the solution.
"""

from labkit.course.authoring import solution

from . import homogeneous, plain_python

RIGHT = (solution, plain_python, homogeneous)
