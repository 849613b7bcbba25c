"""The ordinary kind of sliders: Python computes and draws anew whenever one moves."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import ipywidgets
import numpy as np
from numpy.typing import ArrayLike

from labkit.icp import DEFAULTS, icp
from labkit.interactive.pictures import picture
from labkit.plotting import book_figure, plot_correspondences
from labkit.registration import IcpParameters, IcpResult
from labkit.scan import Scan
from labkit.target import Target, as_target

HEIGHT = 5.2  # inches of the figure

# A page of the built book has no kernel: there the sliders make room for a line that says so.
# Sphinx marks its pages by `data-content_root`; notebooks have no such attribute.
_STYLE = """\
<style>
.labkit-without-kernel { display: none; }
html[data-content_root] .labkit-without-kernel { display: block; }
html[data-content_root] .labkit-needs-kernel { display: none; }
</style>
<p class="labkit-without-kernel"><em>In the notebook three sliders stand here, for gate, overlap
and δ, and Python draws this figure anew when one of them moves. A page has no Python.</em></p>
"""


def icp_sliders(
    source: Scan | ArrayLike,
    target: Target | Scan | ArrayLike,
    T_init: ArrayLike | None = None,
    parameters: IcpParameters = DEFAULTS,
) -> ipywidgets.VBox:
    """Sliders for gate, overlap and Huber's δ above the matched scans; needs a kernel.

    Parameters
    ----------
    source, target, T_init, parameters
        As in `labkit.icp`. The sliders start at the parameters, also at those between or
        beyond their steps; at the end of theirs, gate and delta are off.

    Returns
    -------
    ipywidgets.VBox
        The sliders, a line of figures, and the picture of the pairs at the end of the run.
        In a built page, the picture and a remark instead of sliders that would do nothing.

    Examples
    --------
    >>> import labkit
    >>> from labkit.simulation import lesson_experiment
    >>> lesson = lesson_experiment()
    >>> box = icp_sliders(lesson.source, lesson.target, lesson.T_init)
    >>> [slider.description for slider in box.children[1].children]
    ['gate [m]', 'overlap ρ', 'Huber δ [m]']
    """
    prepared = as_target(target)
    gate = _slider("gate [m]", parameters.max_correspondence_distance, 0.05, 2.0, 0.05, math.inf)
    ratio = _slider("overlap ρ", parameters.overlap_ratio, 0.2, 1.0, 0.01)
    delta = _slider("Huber δ [m]", parameters.huber_delta, 0.01, 0.5, 0.01, math.inf)
    figures, image = ipywidgets.HTML(), ipywidgets.HTML()

    def redraw(_: Any = None) -> None:
        told = replace(
            parameters,
            max_correspondence_distance=gate.value,
            overlap_ratio=ratio.value,
            huber_delta=delta.value,
        )
        result = icp(source, prepared, T_init, told)
        figures.value = _in_words(result)
        image.value = _drawn(source, prepared, result)

    controls = ipywidgets.VBox([gate, ratio, delta])
    controls.add_class("labkit-needs-kernel")
    for slider in controls.children:
        slider.observe(redraw, "value")
    redraw()
    return ipywidgets.VBox([ipywidgets.HTML(_STYLE), controls, figures, image])


def _slider(
    label: str, value: float, first: float, last: float, step: float, *beyond: float
) -> ipywidgets.SelectionSlider:
    """A slider over the steps, what lies beyond them, and the value that it starts at.

    It holds a list, because a slider over floats moves its value to a step when it is shown.
    """
    regular = np.linspace(first, last, round((last - first) / step) + 1).round(6).tolist()
    others = [each for each in (*regular, *beyond) if not math.isclose(each, value)]
    return ipywidgets.SelectionSlider(
        options=[(_read(each), each) for each in sorted([*others, value])],
        value=value,
        description=label,
        style={"description_width": "7em"},
        layout={"width": "min(100%, 480px)"},
    )


def _read(value: float) -> str:
    return "off" if value == math.inf else f"{value:g}"


def _in_words(result: IcpResult) -> str:
    pairs = result.correspondences
    return (
        f"{result.iterations} iterations, {result.message}<br>"
        f"RMSE {result.inlier_rmse:.4f} m over {result.inlier_count} inliers "
        f"of {len(pairs.kept)} points, cost {result.cost:.3g} m²"
    )


def _drawn(source: Scan | ArrayLike, target: Target, result: IcpResult) -> str:
    figure = book_figure(HEIGHT)
    pose = result.history[-1].T_target_source
    ax = plot_correspondences(figure.subplots(), source, target.scan, pose, result.correspondences)
    return picture(figure, f"the matched scans: {ax.get_title()}")
