"""The errors that labkit raises for a mistake of its caller.

All of them are `LabkitError`, so a command line or a grader needs one ``except``. All of
them are also `ValueError`, so code that does not know labkit can handle them. What the
*data* do (too few correspondences, an iteration budget spent) is not an error: `labkit.icp`
returns it as a termination.
"""


class LabkitError(ValueError):
    """Base of every error that names a caller's mistake, its place and the way out."""


class InvalidPointsError(LabkitError):
    """An array of points (or of weights, ranges, poses) of the wrong shape or content."""


class InvalidParameterError(LabkitError):
    """A parameter outside its range: `problem` says what it must be, and what it is.

    The message begins with the name `parameter`, which is empty where `problem` says it all.
    """

    def __init__(self, problem: str, *, parameter: str = "") -> None:
        super().__init__(problem)
        self.problem = problem
        self.parameter = parameter

    def __str__(self) -> str:
        return f"`{self.parameter}` {self.problem}" if self.parameter else self.problem


class DegenerateAlignmentError(LabkitError):
    """Pairs that leave the rotation undetermined: no rigid transform is *the* best one."""


class LogError(LabkitError):
    """A log or trajectory file that cannot be read; the message names file and line."""


class WriteError(LabkitError):
    """A file that cannot be written; the message names it and the way out."""
