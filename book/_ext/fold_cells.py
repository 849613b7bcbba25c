"""Fold in JupyterLab what the book folds: run it on notebooks after their tags have changed.

The book reads tags; JupyterLab reads the cells' metadata. Run as a script, it writes the second
from the first::

    python book/_ext/fold_cells.py notebooks/*.ipynb
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path

SOURCE = {"source_hidden": True}
ALL = {"outputs_hidden": True, "source_hidden": True}
FOLDS = {"hide-input": SOURCE, "hide-cell": ALL, "remove-cell": ALL}


def fold(tags: Iterable[str]) -> dict[str, bool]:
    """JupyterLab's metadata for a cell with these tags.

    Examples
    --------
    >>> fold(["hide-input"])
    {'source_hidden': True}
    >>> fold(["stub"])
    {}
    """
    folded: dict[str, bool] = {}
    for tag in tags:
        folded |= FOLDS.get(tag, {})
    return dict(sorted(folded.items()))


def is_folded(cell: Mapping[str, object]) -> bool:
    """Whether a cell's metadata are what its tags ask for."""
    metadata = cell["metadata"]
    assert isinstance(metadata, Mapping)
    return metadata.get("jupyter", {}) == fold(metadata.get("tags", ()))


def fold_notebook(path: Path) -> None:
    """Write the metadata of each cell of code; nothing else of the file changes."""
    notebook = json.loads(path.read_text("utf-8"))
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            metadata = cell["metadata"] | {"jupyter": fold(cell["metadata"].get("tags", ()))}
            cell["metadata"] = {k: metadata[k] for k in sorted(metadata) if metadata[k] != {}}
    text = json.dumps(notebook, indent=1, ensure_ascii=False)
    path.write_text(text + "\n", "utf-8", newline="\n")


if __name__ == "__main__":
    for each in map(Path, sys.argv[1:]):
        fold_notebook(each)
