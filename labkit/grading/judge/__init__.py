"""From what a call returned to points and words for the student."""
