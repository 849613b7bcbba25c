"""Faults to plant into a port: the classical mistakes, one small change each."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Fault:
    """In `file` of `port`, `right` becomes `wrong`; the vector `red` must tell."""

    port: str
    name: str
    file: str
    right: str
    wrong: str
    red: str


B_SIGN, GATE, COMPOSITION, WEIGHTS = (
    "b_with_the_wrong_sign",
    "gate_against_squares",
    "composed_on_the_right",
    "weights_forgotten",
)

TURN, WEIGHED, STEP_HUBER = "angle_90", "weighted", "step_huber"
STEP_GATE, STEP_FAR = "step_gate", "step_turned_far"

FAULTS = (  # all four where a port is built or started soon, one where it takes long
    Fault(
        "cpp",
        COMPOSITION,
        "icp.cpp",
        "*dT * now.T_target_source",
        "now.T_target_source * *dT",
        STEP_FAR,
    ),
    Fault("java", B_SIGN, "Alignment.java", "b += pair.weight()", "b -= pair.weight()", TURN),
    Fault(
        "java",
        GATE,
        "Correspondences.java",
        "if (distances[i] <= gate)",
        "if (distances[i] * distances[i] <= gate)",
        STEP_GATE,
    ),
    Fault(
        "java",
        COMPOSITION,
        "Icp.java",
        "update.after(before.targetFromSource())",
        "before.targetFromSource().after(update)",
        STEP_FAR,
    ),
    Fault("java", WEIGHTS, "Alignment.java", "b += pair.weight() * x", "b += x", WEIGHED),
    Fault(
        "matlab",
        B_SIGN,
        "align_weighted.m",
        "x(:, 1) .* y(:, 2) - x(:, 2) .* y(:, 1)",
        "x(:, 2) .* y(:, 1) - x(:, 1) .* y(:, 2)",
        TURN,
    ),
    Fault("matlab", GATE, "reject_pairs.m", "distance <= gate;", "distance.^2 <= gate;", STEP_GATE),
    Fault("matlab", COMPOSITION, "icp.m", "T = dT * T_before;", "T = T_before * dT;", STEP_FAR),
    Fault(
        "matlab",
        WEIGHTS,
        "icp.m",
        "pairs.target, pairs.weight)",
        "pairs.target, ones(size(pairs.weight)))",
        STEP_HUBER,
    ),
    Fault(
        "wolfram",
        COMPOSITION,
        "Icp2d.wl",
        'compose[dT, state["Motion"]]',
        'compose[state["Motion"], dT]',
        STEP_FAR,
    ),
)
UNTOUCHED = "degenerate_one_pair"  # by all of them; a program that is broken fails there, too


def planted(fault: Fault, sources: Path, copy: Path) -> Path:
    """A copy of `sources` with the fault in it."""
    shutil.copytree(sources, copy)
    file = copy / fault.file
    text = file.read_text(encoding="utf-8")
    if text.count(fault.right) != 1:
        raise ValueError(
            f"{fault.file} must hold {fault.right!r} once, got {text.count(fault.right)}"
        )
    file.write_text(text.replace(fault.right, fault.wrong), encoding="utf-8")
    return copy
