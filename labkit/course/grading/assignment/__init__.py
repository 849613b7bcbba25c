"""The assignment as data: its questions, its cases, and the files that hold them."""

from labkit.course.grading.assignment.questions import FOLDER, load_assignment

__all__ = ["FOLDER", "load_assignment"]
