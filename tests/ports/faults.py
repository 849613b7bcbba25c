"""Faults to plant into a port: the classical mistakes, one small change each."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Fault:
    """In `file` of `port`, `right` becomes `wrong`."""

    port: str
    name: str
    file: str
    right: str
    wrong: str


B_SIGN, GATE, COMPOSITION, WEIGHTS = (
    "b_with_the_wrong_sign",
    "gate_against_squares",
    "composed_on_the_right",
    "weights_forgotten",
)

FAULTS = (
    Fault("cpp", B_SIGN, "alignment.cpp", "H(0, 1) - H(1, 0)", "H(1, 0) - H(0, 1)"),
    Fault(
        "cpp",
        GATE,
        "correspondences.cpp",
        "distances(i) <= max_distance",
        "distances(i) * distances(i) <= max_distance",
    ),
    Fault(
        "cpp",
        COMPOSITION,
        "icp.cpp",
        "*dT * now.T_target_source",
        "now.T_target_source * *dT",
    ),
    Fault("cpp", WEIGHTS, "alignment.cpp", "x * w.asDiagonal() * y", "x * y"),
    Fault("java", B_SIGN, "Alignment.java", "b += pair.weight()", "b -= pair.weight()"),
    Fault(
        "java",
        GATE,
        "Correspondences.java",
        "if (distances[i] <= gate)",
        "if (distances[i] * distances[i] <= gate)",
    ),
    Fault(
        "java",
        COMPOSITION,
        "Icp.java",
        "update.after(before.targetFromSource())",
        "before.targetFromSource().after(update)",
    ),
    Fault("java", WEIGHTS, "Alignment.java", "b += pair.weight() * x", "b += x"),
    Fault(
        "matlab",
        B_SIGN,
        "align_weighted.m",
        "x(:, 1) .* y(:, 2) - x(:, 2) .* y(:, 1)",
        "x(:, 2) .* y(:, 1) - x(:, 1) .* y(:, 2)",
    ),
    Fault("matlab", GATE, "reject_pairs.m", "distance <= gate;", "distance.^2 <= gate;"),
    Fault("matlab", COMPOSITION, "icp.m", "T = dT * T_before;", "T = T_before * dT;"),
    Fault(
        "matlab",
        WEIGHTS,
        "icp.m",
        "pairs.target, pairs.weight)",
        "pairs.target, ones(size(pairs.weight)))",
    ),
    Fault("wolfram", B_SIGN, "Icp2d.wl", "(w Conjugate[x]) . y;", "(w x) . Conjugate[y];"),
    Fault(
        "wolfram",
        GATE,
        "Icp2d.wl",
        "kept = Take[closest, countWithin[d,",
        "kept = Take[closest, countWithin[d^2,",
    ),
    Fault(
        "wolfram",
        COMPOSITION,
        "Icp2d.wl",
        'compose[dT, state["Motion"]]',
        'compose[state["Motion"], dT]',
    ),
    Fault("wolfram", WEIGHTS, "Icp2d.wl", 'pairs["Target"], pairs["Weights"]', 'pairs["Target"]'),
)


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
