"""A report of a page or two: its tables, and its way from a notebook to HTML and PDF."""

from labkit.course.report.pages import ReportError, read_report, render
from labkit.course.report.pdf import write_pdf
from labkit.course.report.tables import Table, error_table, parameter_table, quality_table

__all__ = [
    "ReportError",
    "Table",
    "error_table",
    "parameter_table",
    "quality_table",
    "read_report",
    "render",
    "write_pdf",
]
