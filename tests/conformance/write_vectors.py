"""Answer the conformance vectors anew: ``python tests/conformance/write_vectors.py``.

The cases are the lines of ``vectors.json``: a new one has a name, a group and a command, and its
files in ``data/``. A case that sits on an edge is refused (`margins`).
"""

from __future__ import annotations

import json
from pathlib import Path

from margins import refuse_edges
from reference import answer, read_files

FOLDER = Path(__file__).parent


def texts() -> dict[str, str]:
    """Both files with labkit's answers, by their name in this folder."""
    vectors = json.loads((FOLDER / "vectors.json").read_text())
    files = read_files(FOLDER, [vector["command"] for vector in vectors])
    for vector in vectors:
        refuse_edges(vector["name"], vector["command"], files)
        vector["expected"] = answer(vector["command"], files)
    lines = ",\n".join(json.dumps(vector, allow_nan=False) for vector in vectors)
    commands = "".join(" ".join(vector["command"]) + "\n" for vector in vectors)
    return {"vectors.json": f"[\n{lines}\n]\n", "commands.txt": commands}


if __name__ == "__main__":
    for name, text in texts().items():
        (FOLDER / name).write_text(text, encoding="ascii", newline="\n")
