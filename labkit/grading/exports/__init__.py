"""Verdicts in the formats of those who take them: gradebooks, autograders, test reports."""

from labkit.grading.exports.gradebooks import (
    check_canvas,
    check_moodle,
    fill_canvas,
    fill_moodle,
    write_feedback,
    write_scores,
)
from labkit.grading.exports.reports import gradescope_results, write_autograder, write_junit

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
