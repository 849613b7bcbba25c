"""A second measurement of a step: the scan matched with the scan before alone.

A match with the map tells where the newest scan lies, and nothing of the pose before. If that one
is wrong, so is the step, however well the newest scan fits. Two scans alone tell their motion
without any pose.
"""

from __future__ import annotations

import numpy as np

from labkit.icp import icp
from labkit.odometry.record import Check, Placement, are_apart, rmse_of
from labkit.parameters import IcpParameters
from labkit.result import IcpResult
from labkit.scan import Scan
from labkit.se2 import from_xytheta, to_xytheta
from labkit.support.arrays import FloatArray
from labkit.target import Target

UNCHECKED = Check(np.full(3, np.nan))


def check_step(
    scan: Scan,
    last_scan: Target,
    increment: FloatArray,
    wheels: FloatArray | None,
    parameters: IcpParameters,
) -> Check:
    """Match a scan with the one before, from the motion taken, (3,), and from wheels that differ.

    Of these matches, and of the scan as it was taken to lie, the one of the lowest cost counts.
    """
    T_taken = from_xytheta(increment)
    guesses = [T_taken]
    if wheels is not None and are_apart(wheels, increment):
        guesses.append(from_xytheta(wheels))
    matches = [icp(scan, last_scan, T_guess, parameters) for T_guess in guesses]
    matches = [match for match in matches if not match.termination.failed]
    if not matches:
        return UNCHECKED
    taken = Placement(source=scan, target=last_scan, parameters=parameters, T_target_source=T_taken)
    candidates: list[IcpResult | Placement] = [taken, *matches]
    best = min(candidates, key=lambda candidate: candidate.correspondences.cost)
    noise = min(rmse_of(best.correspondences), parameters.huber_delta)
    observability = best.observability
    return Check(
        increment=to_xytheta(np.array(best.T_target_source)),
        noise=noise,
        information=0.0 if observability is None else float(observability.values[0]),
    )
