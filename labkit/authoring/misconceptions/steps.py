"""Mistakes in one step of ICP, each in both readings of the trimming."""

from labkit.authoring.misconceptions import stages
from labkit.authoring.misconceptions.stages import LEFT, STAGES, both, step
from labkit.authoring.mistake import mistake


@mistake("icp_step", credit=0.5, chapter=LEFT)
@both
def icp_step__update_on_the_right(*arguments, keep):
    """The increment is composed on the right, T @ dT: it acts on points that T has moved
    already, so it belongs on the left, dT @ T."""
    return stages.step_update_on_the_right(*arguments, keep=keep)


@mistake("icp_step", credit=0.5, chapter=LEFT)
@both
def icp_step__increment_alone(*arguments, keep):
    """This is the increment dT alone; the new transform is dT @ T."""
    return step(*arguments, keep, update=lambda dT, T: dT)


@mistake("icp_step", credit=0.5, chapter=LEFT)
@both
def icp_step__translation_not_turned(*arguments, keep):
    """The translations are added, t + Δt; the increment turns the old one: ΔR t + Δt."""
    return stages.step_translation_not_turned(*arguments, keep=keep)


@mistake("icp_step", credit=0.4, chapter=LEFT)
@both
def icp_step__unmoved_source(*arguments, keep):
    """The pairs are found at T, but the points that are aligned have not been moved by T."""
    return stages.step_unmoved(*arguments, keep=keep)


@mistake("icp_step", credit=0.5, chapter="chapter 2, “In the plane: one `atan2`”")
@both
def icp_step__sign_of_b(*arguments, keep):
    """The increment turns the wrong way: in b = Σ w (x v − y u) the sign is lost, or R is
    transposed."""
    return stages.step_sign_of_b(*arguments, keep=keep)


@mistake("icp_step", credit=0.4)
@both
def icp_step__swapped(*arguments, keep):
    """Source and target are swapped in the alignment: the step leads away from the target."""
    return stages.step_swapped(*arguments, keep=keep)


@mistake("icp_step", credit=0.6, chapter=STAGES)
@both
def icp_step__no_weights(*arguments, keep):
    """Huber's weights are not used in the alignment."""
    return stages.step_no_weights(*arguments, keep=keep)


@mistake("icp_step", credit=0.6, chapter=STAGES)
@both
def icp_step__weights_of_squares(*arguments, keep):
    """Huber's weights are taken of squared distances; they take distances in metres."""
    return stages.step_weights_of_squares(*arguments, keep=keep)


@mistake("icp_step", credit=0.6, chapter=STAGES)
@both
def icp_step__gate_on_squares(*arguments, keep):
    """The gate is held against squared distances; both are in metres."""
    return stages.step_gate_on_squares(*arguments, keep=keep)


@mistake("icp_step", credit=0.6, chapter=STAGES)
@both
def icp_step__no_gate(*arguments, keep):
    """The distance gate is not applied."""
    return stages.step_no_gate(*arguments, keep=keep)


@mistake("icp_step", credit=0.6, chapter=STAGES)
@both
def icp_step__no_trimming(*arguments, keep):
    """The trimming is not applied: all pairs within the gate are aligned."""
    return stages.step_no_trimming(*arguments, keep=keep)


@mistake("icp_step", credit=0.4, chapter=STAGES)
@both
def icp_step__worst_kept(*arguments, keep):
    """Trimming keeps the worst pairs; it should keep the closest ones."""
    return stages.step_worst_kept(*arguments, keep=keep)
