"""The launch buttons, and the cell that makes a notebook run where labkit is missing.

Both follow from the address of the repository that students open: a line of `_config.yml`, or the
variable STUDENTS_REPOSITORY of the workflow that publishes (NAME/REPOSITORY on GitHub). Without it
there are neither: a button that leads nowhere is worse than none.
"""

from __future__ import annotations

import os
import re
from datetime import date
from pathlib import Path
from typing import Any

import yaml
from nbformat import NotebookNode
from nbformat.v4 import new_code_cell
from sphinx.application import Sphinx
from sphinx.config import Config
from sphinx.errors import ExtensionError

import labkit

CELL_ID = "install-labkit"
EXTRAS = "killian,notebooks"
_CELL = """\
# Where labkit is missing, as on Colab, this fetches it.
import importlib.util

if importlib.util.find_spec("labkit") is None:
    %pip install --quiet "icp-course-lab[{extras}] @ git+{url}@{branch}"
"""


def repository(config: Path) -> tuple[str, str]:
    """Address and branch of the students' repository; "" where neither place names it."""
    entry = (yaml.safe_load(config.read_text("utf-8")) or {}).get("repository") or {}
    name = os.environ.get("STUDENTS_REPOSITORY")
    url = entry.get("url") or (f"https://github.com/{name}" if name else "")
    return str(url).rstrip("/"), str(entry.get("branch") or "main")


def with_address(config: str, url: str) -> str:
    """Write the address of the students' repository into the text of a `_config.yml`."""
    return re.sub(r'(?m)^  url: "".*$', f'  url: "{url}"', config) if url else config


def pages_address(url: str) -> str:
    """Where GitHub shows the pages of a repository; "" for a repository elsewhere."""
    match = re.fullmatch(r"https://github\.com/([\w.-]+)/([\w.-]+)", url)
    return f"https://{match[1].lower()}.github.io/{match[2]}/" if match else ""


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
    options["use_issues_button"] = bool(url)  # where students ask
    if not url:
        options["launch_buttons"] = {}
        return
    if not (url.startswith("https://") and len(url.split("/")) >= 5):
        raise ExtensionError(
            f"_config.yml, repository url: must be like https://github.com/NAME/REPOSITORY, "
            f"or empty for pages without launch buttons, got {url!r}"
        )
    config.html_baseurl = config.html_baseurl or pages_address(url)


def settle_footer(app: Sphinx, config: Config) -> None:
    """Say in the footer which version a page is of, and of which year."""
    commit = os.environ.get("GITHUB_SHA", "")[:7]
    config.copyright = str(date.today().year)
    version = f"labkit {labkit.__version__}" + (f", commit {commit}" if commit else "")
    config.html_theme_options["extra_footer"] = version
