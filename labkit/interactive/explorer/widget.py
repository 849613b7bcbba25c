"""The explorer on the Python side: whole, as sliders, or to align two scans by hand."""

from __future__ import annotations

import base64
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
import traitlets
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from labkit.icp import DEFAULTS, icp
from labkit.interactive.controls import CONTROLS, NAMES, SLIDERS
from labkit.interactive.drawn import DrawnWidget, frame_points
from labkit.interactive.explorer.scenes import Scene, default_scenes
from labkit.interactive.front_end import bundle, style
from labkit.parameters import IcpParameters
from labkit.plotting import plot_scans
from labkit.result import IcpResult
from labkit.scan import Scan, as_scan
from labkit.se2 import apply, from_xytheta, to_xytheta
from labkit.support.arrays import FloatArray, as_floats, as_transform, check_kind, check_kinds
from labkit.support.errors import InvalidParameterError
from labkit.target import Target, as_target


class Explorer(DrawnWidget):
    """An ICP run to play with; `icp_explorer`, `icp_sliders` and `align_by_hand` make one.

    `scene` names the scans that are shown, `guess` is (x [m], y [m], θ [rad]). Sliders are named
    as in `IcpParameters`, None where a gate or a delta is off. `outcome` is what the page computed
    last: termination, iterations, pose, inlier_count, inlier_rmse, cost.
    """

    _esm = bundle("explorer/explorer.js")
    _css = style()

    label = traitlets.Unicode("ICP explorer").tag(sync=True)
    form = traitlets.Enum(("explorer", "sliders", "by hand"), "explorer").tag(sync=True)
    runs = traitlets.Bool(True).tag(sync=True)
    scene_data: traitlets.List[Any] = traitlets.List().tag(sync=True)
    first_parameters = traitlets.Dict().tag(sync=True)
    sliders = traitlets.Dict(allow_none=True, default_value=None).tag(sync=True)
    scene = traitlets.Unicode().tag(sync=True)
    vars().update({control.name: control.trait().tag(sync=True) for control in CONTROLS})
    guess = traitlets.List(traitlets.Float(), minlen=3, maxlen=3).tag(sync=True)
    outcome = traitlets.Dict().tag(sync=True)

    def __init__(self, scenes: Sequence[Scene], parameters: IcpParameters, **layout: Any) -> None:
        check_kinds(scenes, "scenes", Scene)
        check_kind(parameters, "parameters", IcpParameters)
        self.scenes = {scene.name: scene for scene in scenes}
        if not scenes or len(self.scenes) < len(scenes):
            names = [scene.name for scene in scenes]
            raise InvalidParameterError(
                f"must be at least one, no two of one name, got {names}", parameter="scenes"
            )
        first = parameters_to_json(parameters)
        super().__init__(
            scene_data=[scene_to_json(scene) for scene in scenes],
            first_parameters=first,
            scene=scenes[0].name,
            guess=_to_row(scenes[0].T_init),
            **{name: first[name] for name in NAMES},
            **layout,
        )

    @property
    def parameters(self) -> IcpParameters:
        """Parameters as the sliders stand."""
        moved = {name: getattr(self, name) for name in NAMES}
        return parameters_from_json(self.first_parameters | moved)

    @property
    def T_init(self) -> FloatArray:
        """Guess as a transform, shape (3, 3)."""
        return from_xytheta(self.guess)

    def run(self) -> IcpResult:
        """Run `labkit.icp` on the scene, with the sliders and the guess as they are now."""
        scene = self.scenes[self.scene]
        return icp(scene.source, scene.target, self.T_init, self.parameters)

    def draw(self, figure: Figure) -> None:
        """Draw the scans at the guess and, where a run is shown at once, at its end."""
        scene = self.scenes[self.scene]
        poses = {"The first guess": self.T_init}
        if self.runs and self.form != "by hand":
            result = self.run()
            failed = result.termination.failed
            poses["Where the run failed" if failed else "The end of the run"] = result.poses[-1]
        all_axes = figure.subplots(1, len(poses), squeeze=False)[0]
        for ax, (title, T) in zip(all_axes, poses.items(), strict=True):
            plot_scans(ax, scene.source, scene.target, T)
            moved = apply(T, scene.source.points)
            frame_points(ax, np.vstack([moved, scene.target.points]))
            ax.set_title(title)

    @traitlets.validate("scene")
    def _check_scene(self, proposal: dict[str, Any]) -> Any:
        name = proposal["value"]
        if name not in self.scenes:
            names = ", ".join(self.scenes)
            raise InvalidParameterError(f"must be one of {names}, got {name!r}", parameter="scene")
        return name

    @traitlets.validate(*SLIDERS)
    def _check_parameter(self, proposal: dict[str, Any]) -> Any:
        value = none_if_off(proposal["value"])
        parameters_from_json({proposal["trait"].name: value})
        return value

    @traitlets.observe("scene")
    def _start_over(self, change: dict[str, Any]) -> None:
        self.guess = _to_row(self.scenes[change["new"]].T_init)


def icp_explorer(
    scenes: Sequence[Scene] | None = None, parameters: IcpParameters = DEFAULTS
) -> Explorer:
    """A widget in which the reader runs ICP by hand, with a kernel or without.

    The page computes all that it shows; in JupyterLab its values also reach Python. Google Colab
    shows it after ``google.colab.output.enable_custom_widget_manager()``.

    `scenes` are pairs of scans to choose from, `default_scenes` by default. `parameters` set the
    sliders at first; what has no slider stays as it is there.

    Examples
    --------
    >>> explorer = icp_explorer(default_scenes()[:1])
    >>> explorer.huber_delta = 0.1
    >>> explorer.run().converged, explorer.parameters.huber_delta
    (True, 0.1)
    """
    return Explorer(default_scenes() if scenes is None else scenes, parameters)


def icp_sliders(
    source: Scan | ArrayLike,
    target: Target | Scan | ArrayLike,
    T_init: ArrayLike | None = None,
    parameters: IcpParameters = DEFAULTS,
    *,
    T_reference: ArrayLike | None = None,
    reference: str = "truth",
    runs: bool = True,
    sliders: Mapping[str, ArrayLike] | None = None,
) -> Explorer:
    """The lesson's three sliders, gate, overlap and Huber's delta, beside one pair of scans.

    The scans, `T_init` and `parameters` are as in `labkit.icp`; `T_reference` is the true motion,
    `reference` its name: "truth" of a simulation, "reference" of a recording. With `runs` the end
    of the loop is shown first; without, the sliders judge the pairs at `T_init`. `sliders` are
    others than the three, each with its values: of "max_correspondence_distance",
    "overlap_ratio" and "huber_delta", and of the guess "x", "y" [m] and "turn" [°]. An empty
    mapping leaves the iterations alone.
    """
    scene = Scene(
        name="the scans",
        source=as_scan(source),
        target=as_target(target).scan,
        T_init=np.eye(3) if T_init is None else as_transform(T_init, "T_init"),
        T_reference=None if T_reference is None else as_transform(T_reference, "T_reference"),
        reference=reference,
    )
    check_kind(runs, "runs", bool)
    label, values_by_name = "Gate, overlap and Huber's δ", None
    if sliders is not None:
        label, values_by_name = "Two scans and their match", values_of_sliders(sliders)
    return Explorer(
        [scene], parameters, label=label, form="sliders", runs=runs, sliders=values_by_name
    )


def align_by_hand(scene: Scene, parameters: IcpParameters = DEFAULTS) -> Explorer:
    """Two scans to lay over one another by mouse or keys; ICP goes on from there.

    The newer one lies at the scene's `T_init` at first. A verdict says whether ICP found the
    answer.
    """
    return Explorer([scene], parameters, label="Two scans, to align by hand", form="by hand")


def values_of_sliders(sliders: Mapping[str, ArrayLike]) -> dict[str, list[float | None]]:
    """Check the values that each slider can be set to: two or more numbers; None is off."""
    check_kind(sliders, "sliders", Mapping)
    return {name: _slider_values(name, values) for name, values in sliders.items()}


def _slider_values(name: str, values: ArrayLike) -> list[float | None]:
    numbers = as_floats(values, f"sliders[{name!r}]", "give the values of the slider", ("N",))
    if len(numbers) < 2 or np.isnan(numbers).any():
        raise InvalidParameterError(
            f"must give at least two values to each, got {name!r}: {numbers.tolist()}",
            parameter="sliders",
        )
    return [none_if_off(round(value, 9)) for value in numbers.tolist()]


def none_if_off(value: Any) -> Any:
    """Return the value, or None for infinity, which JSON does not have: that parameter is off."""
    return None if value == math.inf else value


def parameters_to_json(parameters: IcpParameters) -> dict[str, Any]:
    """Parameters by name, None for one that is off."""
    return {name: none_if_off(value) for name, value in asdict(parameters).items()}


def parameters_from_json(by_name: dict[str, Any]) -> IcpParameters:
    """Parameters from their values by name, None for one that is off."""
    values: dict[str, Any] = {
        name: math.inf if value is None else value for name, value in by_name.items()
    }
    return IcpParameters(**values)


def scene_to_json(scene: Scene) -> dict[str, Any]:
    """Scans, guess and answer of a scene, by name."""
    target = Target(scene.target)
    return {
        "name": scene.name,
        "source": to_base64(scene.source.points),
        "target": to_base64(target.points),
        "normals": to_base64(target.normals),
        "guess": _to_row(scene.T_init),
        "answer": None if scene.T_reference is None else _to_row(scene.T_reference),
        "reference": scene.reference,
        "worse": None if scene.T_worse is None else _to_row(scene.T_worse),
    }


def to_base64(rows: FloatArray) -> str:
    """Encode an array as base64 of its little-endian float64, no digit lost."""
    return base64.b64encode(np.ascontiguousarray(rows, dtype="<f8").tobytes()).decode("ascii")


def from_base64(text: str) -> FloatArray:
    """Read back what `to_base64` wrote, as one row of numbers."""
    return np.frombuffer(base64.b64decode(text), dtype="<f8")


def _to_row(T: ArrayLike) -> list[float]:
    """(x, y, θ) as plain floats."""
    return [float(number) for number in to_xytheta(T)]
