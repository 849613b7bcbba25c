"""HTML pages: one for each student, one for the instructor. They need no network."""
