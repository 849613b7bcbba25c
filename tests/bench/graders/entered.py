"""Count what one hand-in goes through: the functions of labkit that `labkit grade` enters.

``python tests/bench/graders/entered.py`` grades one right notebook with one wrong function, as an
instructor does, and lists by file how many functions were entered, outside the box and in it;
``-v`` names them. Properties and nested functions count, comprehensions and templates do not.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import threading
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[3]
sys.path.append(str(ROOT))

from labkit.cli import main  # noqa: E402
from labkit.course.authoring.write import notebook_text  # noqa: E402
from labkit.grading.box import outside  # noqa: E402
from submissions import answered, lab_answers  # noqa: E402

Function = tuple[str, str]  # its file below labkit, and its qualified name
MARK = "entered:"  # of a line that tells a function in the box
WRONG = {"wrap": "def wrap(angle):\n    return angle % 7.0\n"}
PROFILE_IN_BOX = f"""
import os, sys
told, written = set(), os.dup(2)
def note(frame, event, _):
    code = frame.f_code
    if event == "call" and "/inside/" in code.co_filename and code not in told:
        told.add(code)
        place = code.co_filename.rpartition("/labkit/")[2]
        os.write(written, f"{MARK} {{place}} {{code.co_qualname}}\\n".encode())
"""


def count(command: list[str]) -> tuple[set[Function], set[Function]]:
    """The functions that a command of labkit enters, outside the box and in it."""
    around, inside = set[Function](), set[Function]()
    above = str(ROOT / "labkit")

    def note(frame: Any, event: str, _: object) -> None:
        code = frame.f_code
        if event == "call" and code.co_filename.startswith(above) and code.co_name != "<module>":
            around.add((code.co_filename[len(above) + 1 :], code.co_qualname))

    def read_complaints(process: Any, *arguments: Any, **named: Any) -> tuple[Any, Any]:
        output, complaints = communicate(process, *arguments, **named)
        for line in (complaints or b"").decode().splitlines():
            if line.startswith(MARK) and not line.endswith("<module>"):
                _, place, name = line.split(" ", 2)
                inside.add((place, name))
        return output, complaints

    communicate: Callable[..., Any] = subprocess.Popen.communicate
    subprocess.Popen.communicate = read_complaints  # type: ignore[method-assign]
    start = PROFILE_IN_BOX.replace("{", "{{").replace("}", "}}")
    start += "sys.setprofile(note)\nmain()\n"
    outside.COMMAND = outside.COMMAND.replace("main()\n", start)
    threading.setprofile(note)
    sys.setprofile(note)
    try:
        main(command)
    finally:
        sys.setprofile(None)
        threading.setprofile(None)
    return around, inside


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        answers = next(iter(lab_answers())) | WRONG
        Path(folder, "class").mkdir()
        text = answered(notebook_text(), answers)
        Path(folder, "class/ada.ipynb").write_text(text, encoding="utf-8")
        found = count(["grade", f"{folder}/class", "--out", f"{folder}/grades"])
    for title, entered in zip(("outside", "in the box"), found, strict=True):
        functions = {
            (file, name)
            for file, name in entered
            if file.endswith(".py") and not name.endswith(("comp>", "expr>", "<lambda>"))
        }
        files = Counter(file for file, _ in functions)
        print(f"{len(functions)} functions in {len(files)} files {title}")
        for file, number in files.most_common():
            print(f"{number:5} {file}")
        if "-v" in sys.argv:
            print(*sorted(functions), sep="\n")
