"""Mistakes in the convergence test."""

import math

from labkit.authoring.mistake import mistake
from labkit.authoring.variants import vectorised as right

ANY = "the errata, “Convergence: any test, or both?”"


def _turn(dT):
    return math.atan2(dT[1, 0], dT[0, 0])


def _shift(dT):
    return math.hypot(dT[0, 2], dT[1, 2])


@mistake("has_converged", credit=0.5, chapter=ANY)
def has_converged__any(dT, cost_change, iteration, step, turn, cost, budget):
    """One of the two pose tests is enough here; a scan that turns on the spot would stop the
    loop at once. Both must hold."""
    pose = _shift(dT) < step or abs(_turn(dT)) < turn
    return pose or abs(cost_change) < cost or iteration >= budget


@mistake("has_converged", credit=0.5)
def has_converged__all(dT, cost_change, iteration, step, turn, cost, budget):
    """Pose and cost must both be still here; either of them ends the loop."""
    pose = _shift(dT) < step and abs(_turn(dT)) < turn
    return (pose and abs(cost_change) < cost) or iteration >= budget


@mistake("has_converged", credit=0.6)
def has_converged__signed_turn(dT, cost_change, iteration, step, turn, cost, budget):
    """The angle keeps its sign, so that every turn to the right looks small: take |Δψ|."""
    pose = _shift(dT) < step and _turn(dT) < turn
    return pose or abs(cost_change) < cost or iteration >= budget


@mistake("has_converged", credit=0.6)
def has_converged__signed_cost(dT, cost_change, iteration, step, turn, cost, budget):
    """The change of the cost keeps its sign, so that every cost that falls ends the loop."""
    pose = _shift(dT) < step and abs(_turn(dT)) < turn
    return pose or cost_change < cost or iteration >= budget


@mistake("has_converged", credit=0.7)
def has_converged__each_axis(dT, cost_change, iteration, step, turn, cost, budget):
    """Each axis is held against ε_t by itself; the test is on the length ‖Δt‖."""
    still = max(abs(dT[0, 2]), abs(dT[1, 2])) < step and abs(_turn(dT)) < turn
    return still or abs(cost_change) < cost or iteration >= budget


@mistake("has_converged", credit=0.6)
def has_converged__squared_step(dT, cost_change, iteration, step, turn, cost, budget):
    """‖Δt‖² is held against ε_t; both are lengths in metres."""
    pose = _shift(dT) ** 2 < step and abs(_turn(dT)) < turn
    return pose or abs(cost_change) < cost or iteration >= budget


@mistake("has_converged", credit=0.6)
def has_converged__degrees(dT, cost_change, iteration, step, turn, cost, budget):
    """The angle is in degrees here; ε_ψ is in radians."""
    pose = _shift(dT) < step and abs(math.degrees(_turn(dT))) < turn
    return pose or abs(cost_change) < cost or iteration >= budget


@mistake("has_converged", credit=0.8)
def has_converged__one_more(dT, cost_change, iteration, step, turn, cost, budget):
    """The budget is overdrawn by one: at k = k_max the loop ends."""
    pose = _shift(dT) < step and abs(_turn(dT)) < turn
    return pose or abs(cost_change) < cost or iteration > budget


@mistake("has_converged", credit=0.8)
def has_converged__one_less(dT, cost_change, iteration, step, turn, cost, budget):
    """The budget is cut by one: the loop ends at k = k_max, not before."""
    pose = _shift(dT) < step and abs(_turn(dT)) < turn
    return pose or abs(cost_change) < cost or iteration >= budget - 1


@mistake("has_converged", credit=0.6)
def has_converged__no_budget(dT, cost_change, iteration, step, turn, cost, budget):
    """The budget k_max is not looked at, so the loop may never end."""
    return (_shift(dT) < step and abs(_turn(dT)) < turn) or abs(cost_change) < cost


@mistake("has_converged", credit=0.5)
def has_converged__no_cost(dT, cost_change, iteration, step, turn, cost, budget):
    """The change of the cost is not looked at; a cost that stands still ends the loop, too."""
    return (_shift(dT) < step and abs(_turn(dT)) < turn) or iteration >= budget


@mistake("has_converged", credit=0.4)
def has_converged__no_turn(dT, cost_change, iteration, step, turn, cost, budget):
    """The rotation is not looked at: a scan may turn on the spot."""
    return _shift(dT) < step or abs(cost_change) < cost or iteration >= budget


@mistake("has_converged", credit=0.8)
def has_converged__sine(dT, cost_change, iteration, step, turn, cost, budget):
    """The sine is taken for the angle: at half a turn it is zero as well. Use arctan2."""
    pose = _shift(dT) < step and abs(dT[1, 0]) < turn
    return pose or abs(cost_change) < cost or iteration >= budget


@mistake("has_converged", credit=0.0)
def has_converged__inverted(*arguments):
    """True and False are swapped: True means to stop."""
    return not right.has_converged(*arguments)


@mistake("has_converged", credit=0.0)
def has_converged__always(*arguments):
    """It says True whatever it is given."""
    return True


@mistake("has_converged", credit=0.0)
def has_converged__never(*arguments):
    """It says False whatever it is given."""
    return False
