"""How good a trajectory is: against a reference, step by step, and against a survey.

Everything takes poses as rows (x [m], y [m], θ [rad]). An error is one translation [m]
and one rotation [rad] per pose or pair; the two are never mixed into one number.
"""

from labkit.evaluation.absolute import AbsoluteErrors, ate
from labkit.evaluation.association import associate
from labkit.evaluation.comparison import absolute_errors, compare
from labkit.evaluation.consistency import disagreement, forward_backward, loop_closure
from labkit.evaluation.pose_errors import ErrorSummary, PoseErrors
from labkit.evaluation.relations import (
    RelationErrors,
    Relations,
    read_relations,
    relation_errors,
)
from labkit.evaluation.relative import RelativeErrors, rpe

__all__ = [
    "AbsoluteErrors",
    "ErrorSummary",
    "PoseErrors",
    "RelationErrors",
    "Relations",
    "RelativeErrors",
    "absolute_errors",
    "associate",
    "ate",
    "compare",
    "disagreement",
    "forward_backward",
    "loop_closure",
    "read_relations",
    "relation_errors",
    "rpe",
]
