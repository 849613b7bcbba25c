"""Mistakes in the integration of increments and in the sanity check."""

from labkit.course.authoring import solution as right
from labkit.course.authoring.entries import mistakes

LENGTH = "np.hypot(increment[0], increment[1])"
MOTION = f"{LENGTH} <= max_shift\n        and abs(increment[2]) <= max_turn"
QUALITY = "inlier_ratio >= min_ratio\n        and rmse <= max_rmse"
HEADING = "wrap(psi + increment[2])"

# fmt: off
mistakes("integrate", {
    "world_frame": (0.1, "The increments are added in the world's frame: turn each by R(ψ_k).",
        {"rotation(psi) @ increment": "increment"}),
    "not_wrapped": (0.8, "The headings grow beyond (−π, π]: wrap them.",
        {HEADING: "psi + increment[2]"}),
    "wrapped_to_full_turn": (0.8, "The headings are wrapped to [0, 2π): the convention is (−π, π].",
        {HEADING: "(psi + increment[2]) % (2 * np.pi)"}),
    "half_open": (0.9, "The headings are wrapped to [−π, π): the lab's are (−π, π], π stays π.",
        {HEADING: "(psi + increment[2] + np.pi) % (2 * np.pi) - np.pi"}),
    "new_heading": (0.6, "The step is turned by the new heading ψ_{k+1}; it is in scan k's frame.",
        {"rotation(psi)": "rotation(psi + increment[2])"}),
    "mean_heading": (0.6, "The step is turned by the mean of both headings, as wheels are "
        "integrated; a scan match is expressed in the frame of scan k.",
        {"rotation(psi)": "rotation(psi + increment[2] / 2)"}),
    "turned_backwards": (0.5, "The step is turned by R(ψ)ᵀ; from robot to world it is R(ψ).",
        {"rotation(psi)": "rotation(psi).T"}),
    "start_left_out": (0.7, "The start is not in the result: K increments make K + 1 poses.",
        {"np.array(poses)": "np.array(poses[1:])"}),
    "start_ignored": (0.5, "The trajectory starts at the origin, whatever the start is.",
        {"np.array(start, dtype=float)": "np.zeros(3)"}),
    "start_added": (0.5, "The start's position is added to a trajectory from the origin, but it is "
        "not turned by the start's heading.", {"rotation(psi)": "rotation(psi - start[2])"}),
    "degrees": (0.5, "The headings are in degrees here; all angles are in radians.",
        {"np.array(poses)": "np.array(poses) * [1, 1, 180 / np.pi]"}),
    "last_pose": (0.3, "This is the last pose alone; asked for are all K + 1.",
        {"np.array(poses)": "np.array(poses[-1:])"}),
})
mistakes("is_plausible", {
    "residual_alone": (0.15, "Only the RMSE is looked at: all four limits have to be kept.",
        {f"{MOTION}\n        and {QUALITY}": "rmse <= max_rmse"}),
    "any": (0.3, "One check that passes is enough here; all of them must.",
        {"        and": "        or"}),
    "signed_turn": (0.9, "The turn keeps its sign, so turns to the right are never too wide.",
        {"abs(increment[2])": "increment[2]"}),
    "each_axis": (0.9, "Each axis is held against the limit by itself; test the length ‖Δt‖.",
        {LENGTH: "np.abs(increment[:2]).max()"}),
    "ahead_only": (0.75, "Only Δx with its sign is looked at; the test is on the length ‖Δt‖.",
        {LENGTH: "increment[0]"}),
    "nan_passes": (0.9, "A residual that is NaN passes: every comparison with NaN is False, so ask "
        "for `rmse <= max_rmse` rather than refuse `rmse > max_rmse`.",
        {"rmse <= max_rmse": "not rmse > max_rmse"}),
    "strict": (0.9, "A step right on a limit is refused: the limits themselves are allowed.",
        {"<= max_": "< max_", ">= min_": "> min_"}),
    "degrees": (0.6, "The turn is in degrees here; the limit is in radians.",
        {"abs(increment[2])": "abs(np.rad2deg(increment[2]))"}),
    "no_motion": (0.5, "The motion is not looked at, only the quality of the match.",
        {MOTION: "True"}),
    "no_quality": (0.65, "The quality of the match is not looked at, only the motion.",
        {QUALITY: "True"}),
    "no_residual": (0.75, "The RMSE is not looked at.", {"rmse <= max_rmse": "True"}),
    "ratio_upside_down": (0.5, "The inlier ratio's limit is taken for an upper one; it is lower.",
        {"inlier_ratio >= min_ratio": "inlier_ratio <= min_ratio"}),
    "inverted": (0.0, "True and False are swapped: True means that the step can be believed.",
        lambda *arguments: not right.is_plausible(*arguments)),
    "always": (0.0, "It says True whatever it is given.", lambda *arguments: True),
    "never": (0.0, "It says False whatever it is given.", lambda *arguments: False),
})
