"""Change the lab in random places, one at a time, and list what its tests do not notice.

``python tests/mutants.py [--part core|course|book] [--count 60] [--seed 0] [FILE ...]`` works in a
copy. A change takes some fifteen seconds. A survivor means the same in other words, tunes what no
test measures, or names a test that is missing.
"""

from __future__ import annotations

import argparse
import ast
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
TRACKED = subprocess.run(
    ["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True
).stdout.split("\n")
PARTS = {  # the files that are changed, and the tests that all of a part's files are held to
    "core": (r"labkit/(odometry/)?[a-z]\w*\.py", ()),
    "course": (r"labkit/course/.+\.py", ()),
    "book": (
        r"book/_ext/\w+\.py",
        ("edition", "folds", "formulas", "predictions", "figures", "notebooks", "pages"),
    ),
}
OTHER = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.And: ast.Or, ast.Or: ast.And,
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult,
    ast.FloorDiv: ast.Mult, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd,
}  # fmt: skip
SKIPPED = (ast.Import, ast.ImportFrom, ast.Raise, ast.JoinedStr)
SKIPPED_FIELDS = {"annotation", "returns", "decorator_list"}
Change = tuple[ast.AST, str, int, ast.AST]  # the parent, its field, the place there, the new child


def changes(node: ast.AST) -> Iterator[Change]:
    """All that may be changed below a node."""
    for name, value in ast.iter_fields(node):
        if name in SKIPPED_FIELDS:
            continue
        for k, child in enumerate(value if isinstance(value, list) else [value]):
            if isinstance(child, ast.AST) and not isinstance(child, SKIPPED):
                yield from ((node, name, k, new) for new in instead_of(child))
                yield from changes(child)


def instead_of(node: ast.AST) -> Iterator[ast.AST]:
    """Another operator or number, no sign, or nothing where a statement stood."""
    if type(node) in OTHER:
        yield OTHER[type(node)]()
    if isinstance(node, ast.Constant) and isinstance(node.value, bool):
        yield ast.Constant(not node.value)
    elif isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        large = isinstance(node.value, float) and node.value
        yield ast.Constant(1.5 * node.value if large else node.value + 1)
    if isinstance(node, ast.UnaryOp):
        yield node.operand
    if isinstance(node, ast.Assign | ast.AugAssign):
        yield ast.Pass()


def changed(text: str, number: int) -> tuple[str, str]:
    """The source with one of its changes, and the line in question, before and after."""
    tree = ast.parse(text)
    before = ast.unparse(tree).splitlines()
    parent, name, k, new = list(changes(tree))[number]
    if isinstance(children := getattr(parent, name), list):
        children[k] = new
    else:
        setattr(parent, name, new)
    after = ast.unparse(tree).splitlines()
    lines = next(each for each in zip(before, after, strict=False) if each[0] != each[1])
    return "\n".join(after) + "\n", "  ->  ".join(line.strip() for line in lines)


def tests_of(file: str, part: str) -> list[str]:
    """The file's own tests and examples first, then those of what it serves."""
    name = Path(file).name
    if part == "book":
        own = [file, *(f"tests/book/test_{each}.py" for each in PARTS[part][1])]
    else:
        folder = "tests" / Path(file).parent.relative_to("labkit")
        own = [file, (folder / f"test_{name}").as_posix()]
        if part == "course":  # the tests of its folder, and of the folders below and above
            own += [folder.as_posix(), folder.parent.as_posix()]
        else:
            served = ("refusals", "icp", "schedule", "step", "search", "estimator")
            own += [(folder / f"test_{each}.py").as_posix() for each in served]
    return [each for each in dict.fromkeys(own) if (ROOT / each).exists() and each != "tests"]


def is_noticed(lab: Path, file: str, part: str) -> bool:
    """Whether a test falls, or hangs."""
    told = {"PYTHONPATH": str(lab), "LABKIT_CACHE": str(lab / "cache"), "LABKIT_EXAMPLES": "quick"}
    quick = "not others" if part == "book" else "not slow and not others"
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-m", quick]
    try:
        done = subprocess.run(
            [*command, *tests_of(file, part)],
            cwd=lab, env=os.environ | told, capture_output=True, check=False, timeout=600,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return True
    return done.returncode != 0


def main() -> None:
    """Draw places, try each, and tell."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--part", choices=PARTS, default="core")
    parser.add_argument("files", nargs="*", metavar="FILE")
    args = parser.parse_args()
    files = args.files or [each for each in TRACKED if re.fullmatch(PARTS[args.part][0], each)]
    sources = {name: (ROOT / name).read_text("utf-8") for name in files}
    counts = {name: sum(1 for _ in changes(ast.parse(text))) for name, text in sources.items()}
    places = [(name, number) for name, count in counts.items() for number in range(count)]
    drawn, noticed = random.Random(args.seed).sample(places, min(args.count, len(places))), 0
    with tempfile.TemporaryDirectory() as folder:
        lab = Path(folder)
        for name in filter(None, TRACKED):
            (lab / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, lab / name)
        for name, number in drawn:
            text, line = changed(sources[name], number)
            (lab / name).write_text(text, "utf-8")
            seen = is_noticed(lab, name, args.part)
            (lab / name).write_text(sources[name], "utf-8")
            noticed += seen
            print(f"{'noticed ' if seen else 'SURVIVED'} {name}: {line}", flush=True)
    print(f"{args.part}: {noticed} of {len(drawn)} noticed; there are {len(places)} places")


if __name__ == "__main__":
    main()
