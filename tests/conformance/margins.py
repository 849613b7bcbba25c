"""Edges that a case must not sit on, because two correct programs could differ there.

A decision is one comparison: which neighbour is nearer, which pair is trimmed, inside the gate
or not, converged or not. Rounding moves a number by some 1e-16 of its size. So a jitter of the
inputs that is a million times as large must change no decision, and hardly the pose.
"""

from __future__ import annotations

import numpy as np

from compare import disagreement
from reference import Content, Files, answer

JITTER = 1e-10  # of each input number
JITTER_POSE = 1e-7  # how far that may move an answer
SEEDS = 8


class OnAnEdgeError(ValueError):
    """Two correct programs could answer this case differently."""


def refuse_edges(name: str, command: list[str], files: Files) -> None:
    """Raise `OnAnEdgeError`, naming the case, where a jitter of its inputs changes the answer.

    What is degenerate is left out: a jitter takes points apart that coincide.
    """
    expected = answer(command, files)
    if "degenerate" in (expected.get("error"), expected.get("termination")):
        return
    for seed in range(SEEDS):
        rng = np.random.default_rng(seed)
        shaken = {path: _shake(files[path], rng) for path in command if path in files}
        reason = disagreement(answer(command, shaken), expected, JITTER_POSE)
        if reason:
            raise OnAnEdgeError(f"{name}: a relative jitter of {JITTER:g}: {reason}")


def _shake(content: Content, rng: np.random.Generator) -> Content:
    if isinstance(content, dict):
        return content
    rows = np.array(content)
    shaken: list[list[float]] = (
        rows * (1.0 + JITTER * rng.uniform(-1.0, 1.0, rows.shape))
    ).tolist()
    return shaken
