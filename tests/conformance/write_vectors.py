"""Write the conformance vectors anew from labkit: ``python tests/conformance/write_vectors.py``.

The same bytes come out every time. A case that sits on an edge is refused (`margins`).
"""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path

from cases import Content, all_cases
from margins import refuse_edges
from reference import answer

FOLDER = Path(__file__).parent


def texts() -> dict[str, str]:
    """The content of every file, by its path relative to this folder."""
    known = all_cases()
    vectors = []
    for case in known.cases:
        refuse_edges(case, known.files)
        expected = answer(case.command, known.files)
        vectors.append(
            {"name": case.name, "group": case.group, "command": case.command, "expected": expected}
        )
    written = {path: _file_text(content) for path, content in known.files.items()}
    lines = ",\n".join(json.dumps(vector, allow_nan=False) for vector in vectors)
    written["vectors.json"] = f"[\n{lines}\n]\n"
    written["commands.txt"] = "".join(" ".join(case.command) + "\n" for case in known.cases)
    return written


def _file_text(content: Content) -> str:
    if isinstance(content, dict):
        return json.dumps(content, allow_nan=False) + "\n"
    return "".join(",".join(map(repr, row)) + "\n" for row in content)


def main() -> None:
    """Replace the vectors in this folder."""
    written = texts()
    shutil.rmtree(FOLDER / "data", ignore_errors=True)
    (FOLDER / "data").mkdir()
    for path, text in written.items():
        (FOLDER / path).write_text(text, encoding="ascii", newline="\n")
    size = sum(map(len, written.values()))
    print(f"{written['commands.txt'].count(chr(10))} cases, {size / 1000:.0f} KB", file=sys.stderr)


if __name__ == "__main__":
    main()
