"""Verdicts in the formats of those who take them: gradebooks, autograders, test reports."""
