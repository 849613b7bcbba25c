"""The assignment as data: its questions, its cases, and the files that hold them."""

from labkit.course.grading.assignment.files import FOLDER, load_assignment
from labkit.course.grading.assignment.questions import Answer, Assignment, Case, Cases, Question

__all__ = ["FOLDER", "Answer", "Assignment", "Case", "Cases", "Question", "load_assignment"]
