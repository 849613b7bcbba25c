"""Write the students' edition: the lab without solutions, and a book built from that.

Run as a script, `make student` does, it fills one folder:

- ``lab``, what students get: the notebooks without solutions and without outputs, the pages,
  the package, and all that is needed to build the book again;
- ``html``, the book built from it.

The solutions go before anything is built, so what the builder copies, indexes and offers
for download never had them. Afterwards every file of both is searched for traces of them;
one trace, and nothing is written. Which files students get, `handed_out` says.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path

import for_lab
import launch
import nbformat
from handed_out import EditionError, choose_files
from leaks import find_leaks, only_secret
from solutions import SolutionMarkError, refuse_untagged, strip_notebook

ROOT = Path(__file__).parents[2]
STAFF_PAGES = r"benchmark|decisions|host"
COMMANDS = ("help", "book", "lab", "clean")  # whose files students get
README = """\
# ICP-based motion estimation: the lab

Everything for the course: notebooks to fill in, the pages around them, and the package
`labkit`. You need Python 3.11 or newer.

```bash
make lab     # sets up .venv once, then opens the notebooks in JupyterLab
make book    # builds the pages, with your own results in them
```

Start with `notebooks/01_problem_and_se2.ipynb`; `book/students.md` says how to go on, how to
submit and where to get help. Where a function ends in `raise NotImplementedError`, write yours
in its place and run the cell; `check` says whether it is right.

Code: MIT (LICENSE). Text and figures: CC BY 4.0 (LICENSE-TEXT).
"""


def write_source(root: Path, to: Path) -> tuple[int, frozenset[str]]:
    """Copy what students get from `root` into the new folder `to`, without its solutions.

    Returns how many solutions went, and the runs of words that only they have.
    """
    url, branch = launch.repository(root / "_config.yml")
    edits = EDITED | {"_config.yml": partial(launch.with_address, url=url)}
    secret: list[str] = []
    public: list[str] = [README]
    lookup = for_lab.read_lookup(root)
    for path in choose_files(root)[0]:
        name = path.relative_to(root).as_posix()
        target = to / name
        target.parent.mkdir(parents=True, exist_ok=True)
        if path.suffix == ".ipynb":
            notebook = nbformat.read(path, as_version=4)
            original = "\n".join(cell.source for cell in notebook.cells)
            notebook, taken = strip_notebook(notebook, name)
            for_lab.resolve(notebook, path, lookup)
            if url:
                launch.add_install_cell(notebook, url, branch)
            nbformat.write(notebook, target)
            secret += taken
            for solution in taken:
                original = original.replace(solution, "\n")
        else:
            shutil.copy(path, target)
            original = path.read_text("utf-8", errors="replace")
            if path.suffix == ".md":
                refuse_untagged(original, name)
            if edit := edits.get(path.suffix, edits.get(name)):
                target.write_text(edit(original), "utf-8", newline="\n")
        public.append(original)
    (to / "README.md").write_text(README, "utf-8", newline="\n")
    return len(secret), only_secret(secret, public)


def without_commands(makefile: str) -> str:
    """The Makefile without the commands that students lack the files for."""
    for command in re.findall(r"(?m)^(\w+):.*##", makefile):
        if command not in COMMANDS:
            makefile = re.sub(rf"(?m)^{command}:.*\n(?:\t.*\n)+\n?", "", makefile)
            makefile = re.sub(rf"(?m)^(\.PHONY:.*) {command}\b", r"\1", makefile)
    return makefile


def without_staff_pages(source: str) -> str:
    """The table of contents or a page without the pages that students do not get."""
    source = re.sub(rf"(?m)^ *- file: book/(?:{STAFF_PAGES})\n", "", source)
    return re.sub(rf"\[([^\]]+)\]\((?:[./]*book/)?(?:{STAFF_PAGES})(?:\.md)?\)", r"\1", source)


EDITED = {
    "_toc.yml": without_staff_pages,
    ".md": without_staff_pages,
    "Makefile": without_commands,
}


def build_book(source: Path, scratch: Path, vendor: Path) -> Path:
    """Build the pages from a copy of the source tree, which stays as it is."""
    work = scratch / "work"
    shutil.copytree(source, work)
    if vendor.is_dir():
        shutil.copytree(vendor, work / "book" / "_static" / "vendor")
    jupyter_book = Path(sys.executable).with_name("jupyter-book")
    command = [str(jupyter_book), "build", str(work), "--all", "-W", "-n", "--keep-going"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        output = done.stdout + done.stderr
        warnings = [line for line in output.split("\n") if "WARNING:" in line]
        reason = "\n".join(warnings[:20]) or output[-3000:]
        raise EditionError(f"the students' book does not build:\n{reason}")
    return work / "_build" / "html"


def write_edition(root: Path, to: Path, *, with_book: bool = True) -> int:
    """Write both parts below `to`, or neither where a trace of a solution is found.

    An edition that stands there is replaced; any other folder is not touched. Returns how many
    solutions were taken out.
    """
    if to.exists() and not (to / "lab" / "labkit").is_dir() and any(to.iterdir()):
        raise EditionError(f"{to} holds something else than a students' edition; name another")
    to.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=to.parent, prefix=".student-") as name:
        scratch = Path(name)
        fresh = scratch / "student"
        solutions, secrets = write_source(root, fresh / "lab")
        if with_book:
            html = build_book(fresh / "lab", scratch, root / "book" / "_static" / "vendor")
            html.rename(fresh / "html")
        refuse_leaks(find_leaks(fresh, secrets))
        shutil.rmtree(to, ignore_errors=True)
        fresh.rename(to)
    return solutions


def refuse_leaks(leaks: list[str]) -> None:
    """Raise where there is a leak, and say where and what."""
    if leaks:
        traces = "\n".join(f"  {leak}" for leak in leaks[:10])
        raise EditionError(
            f"{len(leaks)} traces of solutions, so nothing was written:\n{traces}\n"
            f"Mark what they belong to as a solution, too, or say it in other words."
        )


def main() -> None:
    """Write the edition where the command line says."""
    parser = argparse.ArgumentParser(description="Write the lab without its solutions.")
    parser.add_argument("--to", type=Path, default=ROOT / "_build" / "student", metavar="FOLDER")
    parser.add_argument("--no-book", action="store_true", help="only the source, not the pages")
    args = parser.parse_args()
    if not args.no_book:
        print("Building the students' book, which runs every notebook; a few minutes ...")
    try:
        solutions = write_edition(ROOT, args.to.resolve(), with_book=not args.no_book)
        untracked = choose_files(ROOT)[1]
    except (EditionError, SolutionMarkError) as error:
        sys.exit(f"students' edition: {error}")
    files = sum(path.is_file() for path in args.to.rglob("*"))
    print(f"{solutions} solutions taken out; no trace of one in {files:,} files.")
    if untracked:
        print("Not handed out, since git does not track it:", *untracked, sep="\n  ")
    print(f"For students: {args.to / 'lab'}")
    if not args.no_book:
        print(f"Their book:   {args.to / 'html' / 'index.html'}")


if __name__ == "__main__":
    main()
