"""The assignment: each question with all that belongs to it, in the order of the notebook.

What is said of a mistake is read by students.
"""

from labkit.course.authoring.entries import question
from labkit.course.authoring.questions import (
    alignment,
    correspondences,
    loop,
    odometry,
    se2,
    stopping,
)
from labkit.course.exercises.entries import ENTRIES

TITLE = "ICP-based motion estimation"
# Each imports those before it.
_SECTIONS = (se2, alignment, correspondences, stopping, loop, odometry)
QUESTIONS = tuple(one for one in ENTRIES.values() if isinstance(one, question))
SOLUTION = "\n\n".join(["import numpy as np\n", *(entry.solution for entry in QUESTIONS)])
