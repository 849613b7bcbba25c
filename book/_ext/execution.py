"""Run notebooks, two at a time: all of the book while it is built, or those that are named.

No clock ends a run, so a slow machine gives what a fast one gives. As a command this runs the
notebooks that it is given, or all of them, and says which cell failed::

    python book/_ext/execution.py notebooks/03_correspondences.ipynb
"""

from __future__ import annotations

import asyncio
import json
import queue
import sys
import threading
import time
from collections.abc import Iterable
from concurrent.futures import Future
from contextlib import suppress
from pathlib import Path
from typing import ClassVar, NamedTuple

import nbformat
from myst_nb.core import execute
from myst_nb.core.execute.base import NotebookClientBase
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError
from nbformat import NotebookNode
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from traitlets import Integer

NOTEBOOKS = Path(__file__).parents[2] / "notebooks"
JOBS = 2  # notebooks at a time: each takes one processor and some 300 MB


class Run(NamedTuple):
    """A notebook with its outputs, up to the first cell that fails, and what that says."""

    notebook: NotebookNode
    failure: str


class PatientClient(NotebookClient):
    """Waits for a kernel and its messages as long as the kernel lives."""

    startup_timeout = Integer(None, allow_none=True)
    iopub_timeout = Integer(None, allow_none=True)


def run(notebook: NotebookNode, folder: Path) -> Run:
    """Run a notebook in a folder."""
    client = PatientClient(notebook, timeout=None, resources={"metadata": {"path": str(folder)}})
    try:
        asyncio.run(client.async_execute())
    except CellExecutionError as error:
        return Run(notebook, str(error))
    return Run(notebook, "")


def run_all(paths: Iterable[Path]) -> dict[Path, Future[Run]]:
    """Start to run notebooks; an interrupt does not wait for those that still run."""
    runs = {path: Future[Run]() for path in paths}
    waiting: queue.SimpleQueue[Path] = queue.SimpleQueue()
    for path in runs:
        waiting.put(path)

    def work() -> None:
        with suppress(queue.Empty):
            while True:
                path = waiting.get_nowait()
                try:
                    notebook = nbformat.read(path, as_version=4)
                    runs[path].set_result(run(notebook, path.parent))
                except Exception as error:
                    runs[path].set_exception(error)

    for _ in range(JOBS):
        threading.Thread(target=work, daemon=True).start()
    return runs


class BookClient(NotebookClientBase):
    """Gives a page of the book the outputs of its run, in place of MyST-NB's own client."""

    runs: ClassVar[dict[Path, Future[Run]]] = {}

    def start_client(self) -> None:
        """Wait for the run that was started, or run the page now; a failure is a warning."""
        if self.path in self.runs:
            done = self.runs.pop(self.path).result()
        else:
            done = run(nbformat.from_dict(self.notebook), self.path.parent)
        for cell, other in zip(self.notebook.cells, done.notebook.cells, strict=True):
            if cell.cell_type == "code":
                cell.outputs = other.outputs
                cell.execution_count = other.execution_count
        self.notebook.metadata.update(done.notebook.metadata)  # its language and widgets
        if done.failure:
            self.logger.warning(done.failure, subtype="exec")


def start_notebooks(app: Sphinx, env: BuildEnvironment, pages: list[str]) -> None:
    """Start to run the notebooks of the book, and let MyST-NB take their outputs from there."""
    execute.NotebookClientDirect = BookClient
    if app.config.nb_execution_mode != "force":
        return
    paths = [Path(env.doc2path(page)) for page in sorted(pages)]
    excluded = app.config.nb_execution_excludepatterns
    BookClient.runs = run_all(
        path
        for path in paths
        if is_run(path) and not any(path.match(pattern) for pattern in excluded)
    )


def is_run(path: Path) -> bool:
    """Whether a page is a notebook that has not switched its execution off."""
    if path.suffix != ".ipynb":
        return False
    settings = json.loads(path.read_text("utf-8"))["metadata"].get("mystnb", {})
    return settings.get("execution_mode") != "off"


def main() -> int:
    """Run the notebooks that the command line names, and tell their seconds."""
    paths = [Path(name) for name in sys.argv[1:]] or sorted(NOTEBOOKS.glob("*.ipynb"))
    failed = 0
    began = time.monotonic()
    for path, result in run_all(paths).items():
        failure = result.result().failure
        failed += bool(failure)
        print(f"{time.monotonic() - began:5.0f} s  {path.name} {'FAILED' if failure else 'ran'}")
        print(failure, end="\n" if failure else "", flush=True)
    return failed > 0


if __name__ == "__main__":
    sys.exit(main())
