"""Errors of a trajectory: against a reference, step by step, and against itself.

Everything takes poses as rows (x [m], y [m], θ [rad]) or as transforms, (3, 3) or (4, 4) each.
An error is one translation [m] and one rotation [rad] per pose or pair; the two are never mixed
into one number. Other poses, or unequal lengths, raise `InvalidPointsError`.
"""

from labkit.evaluation.consistency import disagreement, forward_backward, loop_closure
from labkit.evaluation.pose_errors import ErrorSummary, PoseErrors
from labkit.evaluation.reference import ate, compare, rpe

__all__ = [
    "ErrorSummary",
    "PoseErrors",
    "ate",
    "compare",
    "disagreement",
    "forward_backward",
    "loop_closure",
    "rpe",
]
