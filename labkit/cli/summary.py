"""What a run says at its end: where its steps came from, and how good they are."""

from __future__ import annotations

from labkit.arrays import FloatArray
from labkit.cli.text import ERROR_HEADER, error_row, table
from labkit.evaluation import compare
from labkit.odometry import Decision, OdometryResult, integrate


def decision_text(result: OdometryResult, seconds: float) -> str:
    """How many steps came from where."""
    steps = len(result.records) - 1
    retry, search = result.count(Decision.RETRY), result.count(Decision.SEARCH)
    matched = result.count(Decision.ICP, Decision.RETRY, Decision.SEARCH)
    prior, skipped = result.count(Decision.PRIOR), result.count(Decision.HOLD, Decision.STAND)
    degenerate = sum(record.degenerate for record in result.records)
    pace = f" ({1e3 * seconds / steps:.2f} ms a step)" if steps else ""
    return (
        f"{steps} steps in {seconds:.1f} s{pace}: {matched} from ICP ({retry} on the second "
        f"attempt, {search} after a search), {prior} from the prior, {skipped} skipped; "
        f"{degenerate} degenerate"
    )


def error_text(reference: FloatArray, result: OdometryResult, prior: FloatArray | None) -> str:
    """Errors of the estimate against the log's reference, and the prior's beside them."""
    trajectories = {"odometry": result.poses}
    if prior is not None:
        trajectories["prior"] = integrate(prior, reference[0])
    errors = compare(trajectories, reference)
    return table(ERROR_HEADER, [error_row(name, each) for name, each in errors.items()])
