"""Verdicts in the formats of those who take them: gradebooks, autograders, test reports."""

from labkit.grading.exports.canvas import check_canvas, fill_canvas
from labkit.grading.exports.feedback import write_feedback
from labkit.grading.exports.gradebook import write_scores
from labkit.grading.exports.gradescope import gradescope_results, write_autograder
from labkit.grading.exports.junit import write_junit
from labkit.grading.exports.moodle import check_moodle, fill_moodle

__all__ = [
    "check_canvas",
    "check_moodle",
    "fill_canvas",
    "fill_moodle",
    "gradescope_results",
    "write_autograder",
    "write_feedback",
    "write_junit",
    "write_scores",
]
