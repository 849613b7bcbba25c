"""The result of a registration: how it ended, the estimate, and every step."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from enum import Enum
from functools import cached_property, partial
from typing import Any

import numpy as np

from labkit.correspondences import Correspondences, pairs_at
from labkit.covariance import censi_covariance
from labkit.degeneracy import free_motions, observability
from labkit.line_alignment import Information
from labkit.parameters import IcpParameters
from labkit.scan import Scan
from labkit.se2 import to_xytheta
from labkit.support.arrays import FloatArray, read_only
from labkit.support.compiled import compiled
from labkit.target import Target

FAILED = read_only(np.full((3, 3), np.nan))  # a failed run returns NaN, never the guess


class Termination(Enum):
    """The endings of a run; the value is the message for a person."""

    CONVERGED_POSE = "converged: the last step was below both pose tolerances"
    CONVERGED_COST = "converged: the cost stopped changing"
    BUDGET_SPENT = "not converged: the iteration budget is spent"
    TOO_FEW_CORRESPONDENCES = (
        "failed: fewer than 3 correspondences are left; widen the gate or improve the guess"
    )
    DEGENERATE = "failed: the correspondences leave the motion undetermined"

    @property
    def converged(self) -> bool:
        """True if a convergence test ended the run."""
        return self in (Termination.CONVERGED_POSE, Termination.CONVERGED_COST)

    @property
    def failed(self) -> bool:
        """True if the run ended without an estimate."""
        return self in (Termination.TOO_FEW_CORRESPONDENCES, Termination.DEGENERATE)


class _Quality:
    """The quality of a match, read from the `correspondences` of an iteration or a result."""

    correspondences: Correspondences

    @property
    def cost(self) -> float:
        """The truncated Huber cost J [m²]; see `labkit.icp`."""
        return self.correspondences.cost

    @property
    def inlier_count(self) -> int:
        """Number of kept pairs."""
        return self.correspondences.inlier_count

    @property
    def fitness(self) -> float:
        """Kept pairs over source points, in [0, 1]."""
        return self.correspondences.fitness

    @property
    def inlier_rmse(self) -> float:
        """Root mean square distance [m] of the kept pairs; NaN where none was kept."""
        return self.correspondences.inlier_rmse


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Iteration(_Quality):
    """The state after one iteration; number 0 is the initial guess, before any step."""

    T_target_source: FloatArray  #: The pose, shape (3, 3).
    correspondences: Correspondences  #: The association there.
    translation_step: float  #: How far the pose moved to get here [m]; NaN at number 0.
    rotation_step: float  #: How far it turned [rad].
    coarse: bool  #: True for a coarse iteration; see `labkit.schedule`.

    def __repr__(self) -> str:
        return (
            f"<Iteration: step {self.translation_step:.3g} m, {self.rotation_step:.3g} rad; "
            f"{self.inlier_count} of {len(self.correspondences.kept)} pairs kept>"
        )


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class IcpResult(_Quality):
    """The outcome of one registration; pairs and history are computed when they are asked for."""

    termination: Termination  #: How the run ended.
    source: Scan  #: The newer scan, k+1.
    target: Target  #: The older scan, k, as it was matched.
    parameters: IcpParameters  #: The parameters of the run.
    poses: FloatArray  #: ``T_target_source`` from the guess (number 0) on, shape (K+1, 3, 3).
    coarse_poses: int  #: Number of coarse iterations, the first ones; see `labkit.schedule`.

    def __post_init__(self) -> None:
        read_only(self.poses)

    def __reduce__(self) -> tuple[Any, ...]:
        """Make the result anew where it is unpickled: its arrays are read-only there, too."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return partial(type(self), **values), ()

    def __repr__(self) -> str:
        return (
            f"<IcpResult: {self.termination.value}; {self.iterations} iterations, "
            f"{self.inlier_count} of {len(self.correspondences.kept)} pairs kept>"
        )

    @property
    def T_target_source(self) -> FloatArray:
        """The estimate, (3, 3); NaN if the run failed (``poses[-1]`` holds the last pose)."""
        return FAILED if self.termination.failed else self.poses[-1]

    @property
    def xytheta(self) -> FloatArray:
        """The estimate as x [m], y [m], θ [rad], shape (3,); NaN if the run failed."""
        return to_xytheta(self.T_target_source)

    def covariance(self, range_std: float | None = None) -> FloatArray:
        """Covariance (3, 3) of `xytheta`; see `labkit.covariance.censi_covariance`.

        `range_std` is the standard deviation of one range [m], at least; that which the target's
        points show is taken where it is larger, and where none is given.
        """
        return censi_covariance(self, range_std)

    @cached_property
    def history(self) -> tuple[Iteration, ...]:
        """Every iteration, from the initial guess (number 0) to the last step."""
        steps = step_lengths(self.poses).tolist()
        return tuple(
            Iteration(
                T_target_source=self.poses[k],
                correspondences=self._pairs_at(k) if k < self.iterations else self.correspondences,
                translation_step=moved,
                rotation_step=turned,
                coarse=k < self.coarse_poses,
            )
            for k, (moved, turned) in enumerate(steps)
        )

    @cached_property
    def correspondences(self) -> Correspondences:  # type: ignore[override]
        """The last association, at the final pose."""
        return self._pairs_at(self.iterations)

    def _pairs_at(self, k: int) -> Correspondences:
        return pairs_at(
            self.source,
            self.target,
            self.poses[k],
            self.parameters,
            coarse=k < self.coarse_poses,
        )

    @property
    def converged(self) -> bool:
        """True if a convergence test ended the run."""
        return self.termination.converged

    @property
    def message(self) -> str:
        """The ending in words, and the motions that the run could not see."""
        unseen = f"; unobservable: {', '.join(self.unobservable)}" if self.unobservable else ""
        return self.termination.value + unseen

    @cached_property
    def observability(self) -> Information | None:
        """Information of the final pairs about each direction of the motion.

        None where the run failed or no pair lies on a surface.
        In its ``free`` directions the estimate is not a measurement: it is the guess, or chance.
        """
        if self.termination.failed:
            return None
        return observability(self.correspondences, self.target)

    @property
    def unobservable(self) -> tuple[str, ...]:
        """The free directions in words, such as 'shift along (1.00, 0.00)'; empty if none is."""
        return () if self.observability is None else free_motions(self.observability)

    @property
    def iterations(self) -> int:
        """Number of steps."""
        return len(self.poses) - 1


@compiled
def step_lengths(poses: FloatArray) -> FloatArray:
    """Length [m] and turn [rad] of the step to each pose, shape (K+1, 2); NaN for the first."""
    lengths = np.full((len(poses), 2), math.nan)
    for k in range(1, len(poses)):
        lengths[k, 0], lengths[k, 1] = step_length(poses[k - 1], poses[k])
    return lengths


@compiled
def step_length(T_before: FloatArray, T: FloatArray) -> tuple[float, float]:
    """Length |Δt| [m] and turn |Δψ| [rad] of the step between two poses."""
    moved = math.hypot(T[0, 2] - T_before[0, 2], T[1, 2] - T_before[1, 2])
    c = T_before[0, 0] * T[0, 0] + T_before[1, 0] * T[1, 0]
    s = T_before[0, 1] * T[0, 0] + T_before[1, 1] * T[1, 0]
    return moved, abs(math.atan2(s, c))
