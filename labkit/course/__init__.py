"""Parts that serve the course: exercises, the assignment and its grading, the students' reports."""
