"""Right answers of different kinds, each file a submission; all of them get full marks.

They are written as students write, on numpy or less, and import nothing of labkit. What a file
leaves out is as in the solution.
"""

import inspect
from types import ModuleType

from labkit.course.authoring import plain_python
from labkit.course.authoring.questions import SOLUTION

from . import homogeneous

solution = ModuleType("solution")
exec(SOLUTION, vars(solution))
RIGHT = (solution, plain_python, homogeneous)


def source_of(submission):
    """The text of one of them."""
    return SOLUTION if submission is solution else inspect.getsource(submission)
