"""Answer the conformance vectors anew: ``python -m tests.conformance.write_vectors``.

The cases are the lines of ``vectors.json``: a new one has a name, a group and a command, and its
files in ``data/``. A case must not sit on an edge, where two correct programs could differ.
A decision is one comparison: which neighbour is nearer, which pair is trimmed, inside the gate
or not, converged or not. Rounding moves a number by some 1e-16 of its size. So a jitter of the
inputs that is a million times as large must change no decision, and hardly the pose.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from tests.conformance.compare import disagreement
from tests.conformance.reference import Content, Files, answer, read_files

FOLDER = Path(__file__).parent
ROUNDING = 1e-12  # answers that differ by less stay as they stand: processors round differently
JITTER = 1e-10  # of each input number
JITTER_POSE = 1e-7  # how far that may move an answer
SEEDS = 8


def texts() -> dict[str, str]:
    """Both files with labkit's answers, by their name in this folder."""
    vectors = json.loads((FOLDER / "vectors.json").read_text())
    files = read_files(FOLDER, [vector["command"] for vector in vectors])
    for vector in vectors:
        refuse_edges(vector["name"], vector["command"], files)
        vector["expected"] = answer_anew(vector, files)
    lines = ",\n".join(json.dumps(vector, allow_nan=False) for vector in vectors)
    commands = "".join(" ".join(vector["command"]) + "\n" for vector in vectors)
    return {"vectors.json": f"[\n{lines}\n]\n", "commands.txt": commands}


def answer_anew(vector: dict[str, Any], files: Files) -> dict[str, Any]:
    """Labkit's answer to a case; the one that stands where they differ by rounding alone."""
    standing: dict[str, Any] = vector.get("expected", {})
    new = answer(vector["command"], files)
    return new if disagreement(new, standing, ROUNDING) else standing


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


if __name__ == "__main__":
    for name, text in texts().items():
        (FOLDER / name).write_text(text, encoding="ascii", newline="\n")
