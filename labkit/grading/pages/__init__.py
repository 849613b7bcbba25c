"""HTML pages: one for each student, one for the instructor. They need no network."""

from labkit.grading.pages.statistics import ClassSummary
from labkit.grading.pages.write import (
    templates,
    write_class_page,
    write_pair_page,
    write_student_page,
)

__all__ = [
    "ClassSummary",
    "templates",
    "write_class_page",
    "write_pair_page",
    "write_student_page",
]
