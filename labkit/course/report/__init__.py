"""A report of a page or two: its tables, and its way from a notebook to HTML and PDF."""

from labkit.course.report.tables import Table, error_table, parameter_table, quality_table

__all__ = ["Table", "error_table", "parameter_table", "quality_table"]
