"""Change the lab in random places, one at a time, and list what its tests do not notice.

``python tests/tools/mutants.py [--part core|course|book] [--count 60] [--seed 0] [FILE ...]`` works
in a copy. A change takes some fifteen seconds, one that nothing notices a few minutes: it means the
same in other words, tunes what no test measures, or names a test that is missing.
"""

from __future__ import annotations

import argparse
import ast
import os
import random
import re
import resource
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
TRACKED = subprocess.run(
    ["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True
).stdout.split("\n")
PARTS = {  # the files that are changed, the tests that they are held to, and which of these
    "core": (r"labkit/(odometry/)?[a-z]\w*\.py", r"tests/(odometry/)?test_\w+\.py", "not slow"),
    "course": (
        r"labkit/(course|grading)/(?!.*/scenes).+\.py",
        r"tests/(course|grading)/.*test_\w+\.py",
        "not slow",
    ),
    "book": (
        r"book/_ext/\w+\.py",
        r"tests/book/test_(?!firefox|jupyterlab|\w+_page)\w+\.py",
        "not slow or intro or icp_loop",  # two pages of twenty-seven
    ),
}
OTHER = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.And: ast.Or, ast.Or: ast.And,
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult,
    ast.FloorDiv: ast.Mult, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd,
}  # fmt: skip
MOST_SECONDS = 1800  # of processor time, for the tests that one fault is held to
SKIPPED = (ast.Import, ast.ImportFrom, ast.Raise, ast.JoinedStr)
REAL = {  # constants that are no whole numbers
    found
    for name in TRACKED
    if re.match(r"(labkit|book/_ext)/.*\.py$", name)
    for found in re.findall(r"(?m)^([A-Z]\w+) = .*\d(?:\.\d|e-)", (ROOT / name).read_text("utf-8"))
}
# Where private functions make examples up, and others would do as well.
EXAMPLES = re.compile(r"labkit/course/(exercises|authoring/questions)/(?!checking|entries)\w+\.py")
SKIPPED_FIELDS = {"annotation", "returns", "decorator_list"}
Change = tuple[ast.AST, str, int, ast.AST]  # the parent, its field, the place there, the new child


def changes(node: ast.AST, made_up: bool = False) -> Iterator[Change]:
    """All that may be changed below a node, but for what is made up."""
    for name, value in ast.iter_fields(node):
        if name in SKIPPED_FIELDS:
            continue
        for k, child in enumerate(value if isinstance(value, list) else [value]):
            if not isinstance(child, ast.AST) or isinstance(child, SKIPPED):
                continue
            if not made_up and not is_same(node, child):
                yield from ((node, name, k, new) for new in instead_of(child))
            is_public = isinstance(child, ast.FunctionDef) and child.name[0] != "_"
            is_answer = is_public or isinstance(child, ast.Lambda)
            draws = isinstance(child, ast.Call) and ast.unparse(child.func).startswith("rng.")
            yield from changes(child, draws or (made_up and not is_answer))


def is_same(node: ast.AST, child: ast.AST) -> bool:
    """True for "<" beside "<=" where a constant is no whole number, and nothing is right on it."""
    if isinstance(node, ast.Compare) and isinstance(child, ast.Lt | ast.LtE | ast.Gt | ast.GtE):
        return any(getattr(part, "id", "") in REAL for part in ast.walk(node))
    return False


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


def changed(text: str, number: int, made_up: bool) -> tuple[str, str]:
    """The source with one of its changes, and the line in question, before and after."""
    tree = ast.parse(text)
    before = ast.unparse(tree).splitlines()
    parent, name, k, new = list(changes(tree, made_up))[number]
    if isinstance(children := getattr(parent, name), list):
        children[k] = new
    else:
        setattr(parent, name, new)
    after = ast.unparse(tree).splitlines()
    lines = next(each for each in zip(before, after, strict=False) if each[0] != each[1])
    return "\n".join(after) + "\n", "  ->  ".join(line.strip() for line in lines)


def tests_of(file: str, part: str) -> list[str]:
    """The file's examples and own tests first, then those that import it, then its part's."""
    path = Path(file)
    names = re.compile(rf"(?m)^(?:from|import) .*\b{path.stem}\b")
    depth = 2 if path.parts[1] == "grading" else 3
    folder = "tests/" + "/".join(path.parts[1:depth] if part == "course" else path.parts[:0])
    tests = [each for each in TRACKED if re.fullmatch(PARTS[part][1], each)]
    own = [each for each in tests if each.endswith(f"/test_{path.name}")]
    own += [each for each in tests if names.search((ROOT / each).read_text("utf-8"))]
    own += [each for each in tests if each.startswith(folder)]
    return [file, *dict.fromkeys(own)]


def limit_processor_time() -> None:
    """End this process after half an hour of its own time: an endless loop, or a slow machine."""
    resource.setrlimit(resource.RLIMIT_CPU, (MOST_SECONDS, MOST_SECONDS))


def red(lab: Path, tests: list[str], *options: str) -> str:
    """The first test that falls, or "" where none does."""
    told = {
        "PYTHONPATH": str(lab),
        "LABKIT_CACHE": str(lab / "cache"),
        "LABKIT_EXAMPLES": "quick",
        "LABKIT_PATIENCE": "30",
    }
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-x",
        "-q",
        "-m",
        "not others and not pages and not nightly",
        *options,
        *tests,
    ]
    done = subprocess.run(
        command, cwd=lab, env=os.environ | told, capture_output=True, text=True, check=False,
        preexec_fn=limit_processor_time,
    )  # fmt: skip
    if done.returncode < 0:
        return "no end"
    found = re.findall(r"(?m)^(?:FAILED|ERROR) (.*)", done.stdout)
    return (found or ["no start" if done.returncode else ""])[0]


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
    made_up = {name: bool(EXAMPLES.fullmatch(name)) for name in files}
    counts = {
        name: sum(1 for _ in changes(ast.parse(text), made_up[name]))
        for name, text in sources.items()
    }
    places = [(name, number) for name, count in counts.items() for number in range(count)]
    drawn, noticed = random.Random(args.seed).sample(places, min(args.count, len(places))), 0
    with tempfile.TemporaryDirectory() as folder:
        lab = Path(folder)
        for name in filter(None, TRACKED):
            (lab / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, lab / name)
        for name, number in drawn:
            text, line = changed(sources[name], number, made_up[name])
            tests, chosen = tests_of(name, args.part), ("-k", PARTS[args.part][2])
            (lab / name).write_text(text, "utf-8")
            by = red(lab, tests, *chosen)
            if by.startswith("tests/"):  # and once more, lest it fell by chance
                by = red(lab, tests, *chosen, "--last-failed")
            (lab / name).write_text(sources[name], "utf-8")
            if by not in ("", "no end") and red(lab, tests, *chosen, "--last-failed"):
                sys.exit(f"red without a change: {by}")
            noticed += bool(by)
            print(f"{'noticed ' if by else 'SURVIVED'} {name}: {line}  ({by[:100]})", flush=True)
    print(f"{args.part}: {noticed} of {len(drawn)} noticed; there are {len(places)} places")


if __name__ == "__main__":
    main()
