"""HTML pages: one for each student, one for the instructor. They need no network."""

from labkit.grading.reports.pages import templates, write_class_page, write_student_page
from labkit.grading.reports.summary import ClassSummary

__all__ = ["ClassSummary", "templates", "write_class_page", "write_student_page"]
