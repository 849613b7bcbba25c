"""The launch buttons, and the cell that makes a notebook run where labkit is missing.

Both follow from one line of `_config.yml`, the address of the repository that students
open. Without it there are neither: a button that leads nowhere is worse than none.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml
from nbformat import NotebookNode
from nbformat.v4 import new_code_cell
from sphinx.application import Sphinx
from sphinx.config import Config
from sphinx.errors import ExtensionError

CELL_ID = "install-labkit"
EXTRAS = "killian,notebooks"
_CELL = """\
# Where labkit is missing, as on Colab, this fetches it.
import importlib.util

if importlib.util.find_spec("labkit") is None:
    %pip install --quiet "icp-course-lab[{extras}] @ git+{url}@{branch}"
"""


def repository(config: Path) -> tuple[str, str]:
    """Address and branch of the students' repository in a `_config.yml`; "" where it has none."""
    entry = (yaml.safe_load(config.read_text("utf-8")) or {}).get("repository") or {}
    return str(entry.get("url") or "").rstrip("/"), str(entry.get("branch") or "main")


def add_install_cell(notebook: NotebookNode, url: str, branch: str) -> None:
    """Put the cell before the first cell of code; readers of the book do not see it."""
    source = _CELL.format(extras=EXTRAS, url=url, branch=branch).rstrip()
    install = new_code_cell(source, id=CELL_ID, metadata={"tags": ["remove-cell"]})
    kinds = [cell.cell_type for cell in notebook.cells]
    if "code" in kinds:
        notebook.cells.insert(kinds.index("code"), install)


def settle_buttons(app: Sphinx, config: Config) -> None:
    """Drop the launch buttons where there is no repository; refuse an address that cannot be."""
    options: dict[str, Any] = config.html_theme_options
    url = str(options.get("repository_url") or "")
    if not url:
        options["launch_buttons"] = {}
    elif not (url.startswith("https://") and len(url.split("/")) >= 5):
        raise ExtensionError(
            f"_config.yml, repository url: must be like https://github.com/NAME/REPOSITORY, "
            f"or empty for pages without launch buttons, got {url!r}"
        )
