"""Grading of what students hand in: it knows questions and cases, and nothing of what they ask."""
