"""Change the lab in random places, one at a time, and list what its tests do not notice.

``python tests/tools/mutants.py [--part core|course|book|js] [--count 60] [--seed 0] [FILE ...]``
works in a copy. A change takes some fifteen seconds, one that nothing notices a few minutes: it
means the same in other words, tunes what no test measures, or names a test that is missing.
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
    "js": (  # the scripts that a test sees without a built book
        r"labkit/interactive/.+\.js|book/_static/(predictions|widgets|formulas)\.js",
        r"tests/(interactive|book)/test_(agreement|drive|live_figure|pages|predictions|\w+_page)\.py",
        "not slow or computes_what",
    ),
}
# In JavaScript: what is no code, and what in code is exchanged for what.
NO_CODE = re.compile(
    r"""//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\])*"|`(?:\\.|[^`\\])*`|^import .*?;$""",
    re.DOTALL | re.MULTILINE,
)
EXCHANGED = {
    " < ": " > ", " > ": " < ", " <= ": " > ", " >= ": " < ", " === ": " !== ", " !== ": " === ",
    " && ": " || ", " || ": " && ", " + ": " - ", " - ": " + ", " * ": " / ", " / ": " * ",
    ".every(": ".some(", ".some(": ".every(", "Math.min(": "Math.max(", "Math.max(": "Math.min(",
    "true": "false", "false": "true", "++": "--", "?? ": "&& ",
}  # fmt: skip
IN_CODE = re.compile("|".join(map(re.escape, EXCHANGED)) + r"|(?<![\w.])\d+(?:\.\d+)?(?![\w.])")
OTHER = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.And: ast.Or, ast.Or: ast.And,
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult,
    ast.FloorDiv: ast.Mult, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd,
}  # fmt: skip
MOST_SECONDS = 1800  # of processor time, for the tests that one fault is held to
SKIPPED = (ast.Import, ast.ImportFrom, ast.Raise, ast.JoinedStr)
REAL_CONSTANT = re.compile(r"(?m)^([A-Z]\w+) = .*\d(?:\.\d|e-)")  # no whole number
REAL_CONSTANTS = {
    constant
    for file in TRACKED
    if re.match(r"(labkit|book/_ext)/.*\.py$", file)
    for constant in REAL_CONSTANT.findall((ROOT / file).read_text("utf-8"))
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
                for replacement in replacements(child):
                    yield node, name, k, replacement
            is_public = isinstance(child, ast.FunctionDef) and child.name[0] != "_"
            is_answer = is_public or isinstance(child, ast.Lambda)
            draws = isinstance(child, ast.Call) and ast.unparse(child.func).startswith("rng.")
            yield from changes(child, draws or (made_up and not is_answer))


def is_same(node: ast.AST, child: ast.AST) -> bool:
    """True for "<" beside "<=" where a constant is no whole number, and nothing is right on it."""
    if isinstance(node, ast.Compare) and isinstance(child, ast.Lt | ast.LtE | ast.Gt | ast.GtE):
        return any(getattr(part, "id", "") in REAL_CONSTANTS for part in ast.walk(node))
    return False


def replacements(node: ast.AST) -> Iterator[ast.AST]:
    """Another operator or number, no sign, or nothing in place of a statement."""
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


def change(source: str, number: int, made_up: bool) -> tuple[str, str]:
    """Make one of the changes of a source: the new source, and the line before and after."""
    tree = ast.parse(source)
    lines_before = ast.unparse(tree).splitlines()
    parent, field, k, replacement = list(changes(tree, made_up))[number]
    children = getattr(parent, field)
    if isinstance(children, list):
        children[k] = replacement
    else:
        setattr(parent, field, replacement)
    lines_after = ast.unparse(tree).splitlines()
    pairs = zip(lines_before, lines_after, strict=False)
    line_before, line_after = next(pair for pair in pairs if pair[0] != pair[1])
    return "\n".join(lines_after) + "\n", f"{line_before.strip()}  ->  {line_after.strip()}"


def changes_of_javascript(source: str) -> list[tuple[int, int, str]]:
    """All that may be exchanged in the code of a module: from where, to where, and for what."""
    code = NO_CODE.sub(lambda match: re.sub(r"\S", "_", match[0]), source)
    exchanges = []
    for match in IN_CODE.finditer(code):
        number = EXCHANGED.get(match[0]) or f"{1.5 * float(match[0]) or 1:g}"
        exchanges.append((match.start(), match.end(), number))
    return exchanges


def change_javascript(source: str, number: int) -> tuple[str, str]:
    """Make one of the exchanges of a module: the new source, and the line before and after."""
    start, end, replacement = changes_of_javascript(source)[number]
    changed = source[:start] + replacement + source[end:]
    row = source.count("\n", 0, start)
    lines = [text.splitlines()[row].strip() for text in (source, changed)]
    return changed, "  ->  ".join(lines)


def count_changes(file: str, source: str, made_up: bool) -> int:
    """Count the changes that a file offers."""
    if file.endswith(".js"):
        return len(changes_of_javascript(source))
    return len(list(changes(ast.parse(source), made_up)))


def tests_of(file: str, part: str) -> list[str]:
    """The file's examples and own tests, then the tests that import it, then its part's."""
    path = Path(file)
    tests = [test for test in TRACKED if re.fullmatch(PARTS[part][1], test)]
    if part == "js":  # those of the same name or folder first; of what mirrors labkit, Node's
        words = {path.stem.rstrip("s"), path.parent.name, path.stem.partition("_")[0]}
        if "mirrors labkit" in (ROOT / file).read_text("utf-8"):
            words = {"interactive"}
        return sorted(tests, key=lambda test: -sum(word[:5] in test for word in words))
    own = [test for test in tests if test.endswith(f"/test_{path.name}")]
    import_line = re.compile(rf"(?m)^(?:from|import) .*\b{path.stem}\b")
    importing = [test for test in tests if import_line.search((ROOT / test).read_text("utf-8"))]
    folder = "tests/"
    if part == "course":
        depth = 2 if path.parts[1] == "grading" else 3
        folder += "/".join(path.parts[1:depth])
    beside = [test for test in tests if test.startswith(folder)]
    return [file, *dict.fromkeys(own + importing + beside)]


def limit_processor_time() -> None:
    """End this process after half an hour of its own time: an endless loop, or a slow machine."""
    resource.setrlimit(resource.RLIMIT_CPU, (MOST_SECONDS, MOST_SECONDS))


def first_failure(lab: Path, tests: list[str], *options: str) -> str:
    """Run tests in a copy of the lab; the first that fails, or "" where none does."""
    environment = {
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
        command, cwd=lab, env=os.environ | environment, capture_output=True, text=True, check=False,
        preexec_fn=limit_processor_time,
    )  # fmt: skip
    if done.returncode < 0:
        return "no end"
    failures = re.findall(r"(?m)^(?:FAILED|ERROR) (.*)", done.stdout)
    if failures:
        return str(failures[0])
    return "no start" if done.returncode else ""


def copy_lab(lab: Path) -> None:
    """Copy the files that git tracks."""
    for file in filter(None, TRACKED):
        (lab / file).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / file, lab / file)


def try_change(lab: Path, file: str, part: str, source: str) -> str:
    """The first test that fails with another source of a file, or "" where none does."""
    original = (ROOT / file).read_text("utf-8")
    tests = tests_of(file, part)
    options = ("-k", PARTS[part][2])
    (lab / file).write_text(source, "utf-8")
    failure = first_failure(lab, tests, *options)
    if failure.startswith("tests/"):  # and once more, lest it failed by chance
        failure = first_failure(lab, tests, *options, "--last-failed")
    (lab / file).write_text(original, "utf-8")
    if failure not in ("", "no end") and first_failure(lab, tests, *options, "--last-failed"):
        sys.exit(f"fails without a change: {failure}")
    return failure


def main() -> None:
    """Draw places, change each in turn, and say what noticed it."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--part", choices=PARTS, default="core")
    parser.add_argument("files", nargs="*", metavar="FILE")
    args = parser.parse_args()
    files = args.files or [file for file in TRACKED if re.fullmatch(PARTS[args.part][0], file)]
    sources = {file: (ROOT / file).read_text("utf-8") for file in files}
    made_up = {file: bool(EXAMPLES.fullmatch(file)) for file in files}
    places = [
        (file, number)
        for file, source in sources.items()
        for number in range(count_changes(file, source, made_up[file]))
    ]
    sample = random.Random(args.seed).sample(places, min(args.count, len(places)))
    noticed = 0
    with tempfile.TemporaryDirectory() as folder:
        copy_lab(Path(folder))
        for file, number in sample:
            if file.endswith(".js"):
                source, line = change_javascript(sources[file], number)
            else:
                source, line = change(sources[file], number, made_up[file])
            failure = try_change(Path(folder), file, args.part, source)
            noticed += bool(failure)
            outcome = "noticed " if failure else "SURVIVED"
            print(f"{outcome} {file}: {line}  ({failure[:100]})", flush=True)
    print(f"{args.part}: {noticed} of {len(sample)} noticed; there are {len(places)} places")


if __name__ == "__main__":
    main()
