"""The commands that the pages name, and where each of them is run.

``python tests/tools/documented.py`` runs those that need the installed package alone, as they are
written and in their order, in the folder it stands in; `.ci/wheel` calls it with the wheel. What
authors call runs in the checkout.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
PAGES = ("README.md", "CONTRIBUTING.md", "book/students.md", "book/instructors.md")
FENCE = re.compile(r"(?ms)^```(\w*)\n(.*?)^```$")
SPAN = re.compile(r"`([^`]+)`")
COMMAND = re.compile(
    r"(make|labkit|python|pip|jupyter|nbgrader|dolos|git|rm|source|\.venv/bin/\w+) \S|\.ci/\w"
)
# Commands of a checkout: the file of CI that walks them.
WALKED = {
    **dict.fromkeys(("make book", "make test", "make pages", "make student"), ".ci/run"),
    "make others": ".ci/others",
    ".ci/others": ".github/workflows/ci.yml",
    ".ci/run": ".github/workflows/ci.yml",
    ".ci/versions lowest": ".github/workflows/ci.yml",
    "make mutants": ".github/workflows/nightly.yml",
    "make bench": ".github/workflows/nightly.yml",
}
# What the walk runs with the installed package, in this order.
INSTALLED = (
    "labkit --help",
    "labkit --version",
    "python -m labkit.course.authoring --secret course.secret",
    "labkit grade submissions.zip --secret course.secret",
    'labkit grade submissions.zip --secret course.secret --canvas gradebook.csv "ICP lab"',
    "labkit grade submissions.zip --secret course.secret --moodle worksheet.csv",
    "labkit autograder autograder.zip --secret course.secret",
    "labkit grade submissions.zip --secret course.secret --again 4711",
    "labkit odometry killian",
    "labkit odometry your.log",
    "jupyter nbconvert --to html --execute --no-input --embed-images my_report.ipynb",
)
EXCUSED = {
    "make lab": "opens JupyterLab in a window; tests/book/test_jupyterlab.py starts it",
    "make fix": "changes the sources; make test holds what it would change",
    "make lock": "asks the registry for what is new; tests/test_packaging.py reads the lock",
    "source .venv/bin/activate": "changes the terminal that it is typed in",
    ".venv/bin/python tests/bench/pages.py": "measures times, which no test asserts",
    "pip install pre-commit && pre-commit install": "changes the contributor's git hooks",
    "python -m pip list": "is pip's own",
    **dict.fromkeys(
        (
            r"robocopy .binder .venv\share\jupyter\lab\settings overrides.json",
            "mkdir -p .venv/share/jupyter/lab/settings && "
            "cp .binder/overrides.json .venv/share/jupyter/lab/settings",
        ),
        "copies a file, as make does; tests/book/test_jupyterlab.py reads it there",
    ),
    "pip install .": ".ci/versions installs the checkout so, .ci/wheel what is built from it",
    ".venv/bin/python -m labkit.course.authoring": (
        "writes the assignment anew in a checkout; tests/course/authoring calls what it calls"
    ),
    "nbgrader generate_assignment": "tests/grading/test_nbgrader.py, in make others",
    "labkit grade submitted --secret course.secret --nbgrader gradebook.db lab1": (
        "needs nbgrader's gradebook; tests/grading/classroom/test_nbgrader_book.py fills one"
    ),
    "jupyter nbconvert --to notebook notebooks/09_problems.ipynb --output-dir source/problems "
    "--TagRemovePreprocessor.enabled=True --TagRemovePreprocessor.remove_cell_tags=solution": (
        "prepares nbgrader's source; its own tests are nbconvert's"
    ),
    "dolos run -l python -i grades/handed_out.py grades/code/*.py": "another program's",
}
# Parts of make test; the names of commands that are run; what the workflow's Windows job runs.
PARTS = re.compile(
    r"make quick|\.venv/bin/(pytest|python book/_ext/execution.py) |"
    r"(labkit grade|python -m labkit.course.authoring)$|py(thon3)? -|\.venv."
)


def commands(page: str) -> list[str]:
    """The commands of a page: lines of its consoles, and what its text quotes."""
    markdown = re.sub(r"(?<!`)``[^`].*?``(?!`)", "", (ROOT / page).read_text("utf-8"))
    prose, *fenced = FENCE.split(markdown)  # then for each fence its language, its lines, and prose
    passages = [prose, *fenced[2::3]]
    languages = [*fenced[::3], ""]
    consoles = [*fenced[1::3], ""]
    lines = []
    for passage, language, console in zip(passages, languages, consoles, strict=True):
        quoted = (" ".join(span.split()) for span in SPAN.findall(passage))
        lines += filter(COMMAND.match, quoted)
        if language in {"bash", "console"}:
            lines += console.replace("\\\n", "").splitlines()
    without_comments = (re.sub(r"(^|\s+)#.*", "", " ".join(line.split())) for line in lines)
    return [line for line in dict.fromkeys(without_comments) if line]


def prepare(folder: Path) -> None:
    """What the commands read: a class of one, a gradebook, a robot's sweeps, a report."""
    with zipfile.ZipFile(folder / "submissions.zip", "w") as archive:
        code = "def wrap(angle):\n    return angle\n"
        archive.writestr("lovelaceada_4711_98765_answers.py", code)
    (folder / "gradebook.csv").write_text(
        "Student,ID,SIS User ID,SIS Login ID,Section,ICP lab (77)\n"
        "    Points Possible,,,,,100.00\n"
        '"Lovelace, Ada",4711,a1,ada@x.org,Monday,\n',
        "utf-8",
    )
    (folder / "worksheet.csv").write_text(
        "Identifier,Full name,Status,Grade,Maximum Grade\nParticipant 4711,Ada Lovelace,,,100.00\n",
        "utf-8",
    )
    shutil.copy(ROOT / "notebooks/report_template.ipynb", folder / "my_report.ipynb")
    angles = np.radians(np.arange(-90, 90))
    sweep = 3.0 / np.maximum(abs(np.cos(angles)), 0.5)
    sweeps = [sweep - 0.05 * k * np.cos(angles) for k in range(5)]
    stamps = np.arange(len(sweeps)) / 10.0  # [s]
    header = ",".join(["stamp", *(f"range_{k}" for k in range(len(angles)))])
    rows = np.column_stack([stamps, sweeps])
    np.savetxt(folder / "sweeps.csv", rows, delimiter=",", header=header, comments="")
    wheels = [(stamp, 0.05 * k, 0, 0, 0, 0, 0, 1) for k, stamp in enumerate(stamps)]
    np.savetxt(folder / "wheels.tum", wheels)
    beams = " ".join(f"{r:.3f}" for r in sweep)
    lines = (f"FLASER 180 {beams} {k / 10} 0 0 {k / 10} 0 0 {k} host {k}\n" for k in range(5))
    (folder / "your.log").write_text("".join(lines), "utf-8")


def python_of(page: str) -> str:
    """The program that a page shows, and what its comments offer in place of a line."""
    program = re.search(r"(?ms)^```python\n(.*?)^```", (ROOT / page).read_text("utf-8"))
    assert program is not None
    return re.sub(r"(?m)^# .*: (?=\w+ = )", "", program[1])


def main() -> None:
    """Run them here; the first that fails ends it."""
    here = Path.cwd()
    prepare(here)
    for command in (*INSTALLED, f"python -c '{python_of('README.md')}'"):
        print(f"$ {command.splitlines()[0]}", flush=True)
        authors = "labkit.course.authoring" in command  # which stands in the checkout alone
        to_run = (
            command.replace("course.secret", str(here / "course.secret")) if authors else command
        )
        folder = ROOT if authors else here
        if subprocess.run(["bash", "-c", to_run], cwd=folder, check=False).returncode:
            sys.exit(f"as documented, this fails: {command}")
        if command.startswith("labkit grade"):
            Path("grades/adjustments.csv").touch()


if __name__ == "__main__":
    main()
