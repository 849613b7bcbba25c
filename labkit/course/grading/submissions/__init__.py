"""Who handed in what: files, folders, archives and the bulk downloads of learning platforms."""

from labkit.course.grading.submissions.find import find_submissions, one_submission
from labkit.course.grading.submissions.submission import Submission

__all__ = ["Submission", "find_submissions", "one_submission"]
