"""Change the core in random places, one at a time, and list what its tests do not notice.

``python tests/mutants.py [--count 60] [--seed 0] [MODULE ...]`` works in a copy of the lab. A
change takes some fifteen seconds, most of them for compiling. A survivor means the same in other
words, tunes what no test measures, or names a test that is missing.
"""

from __future__ import annotations

import argparse
import ast
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
LAB = ROOT / "labkit"
CORE = [path for path in LAB.glob("[a-z]*.py") if (ROOT / f"tests/test_{path.name}").exists()]
PATHS = sorted([*CORE, *LAB.glob("odometry/[a-z]*.py")])
MODULES = [path.relative_to(LAB).as_posix() for path in PATHS]
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


def tests_of(module: str) -> list[Path]:
    """Examples in the module, its own tests, refusals, and the loop or step that it serves."""
    own = ROOT / "tests" / Path(module).parent / f"test_{Path(module).name}"
    core = ("refusals", "icp", "schedule")
    served = core if own.parent.name == "tests" else ("step", "search", "estimator")
    tests = [own, *(own.with_name(f"test_{name}.py") for name in served)]
    return [LAB / module, *dict.fromkeys(test for test in tests if test.exists())]


def is_noticed(lab: Path, module: str) -> bool:
    """Whether a test falls, or hangs."""
    told = {"PYTHONPATH": str(lab), "LABKIT_CACHE": str(lab / "cache"), "LABKIT_EXAMPLES": "quick"}
    tests = [str(lab / path.relative_to(ROOT)) for path in tests_of(module)]
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-m", "not slow", *tests]
    try:
        done = subprocess.run(
            command, cwd=lab, env=os.environ | told, capture_output=True, check=False, timeout=600
        )
    except subprocess.TimeoutExpired:
        return True
    return done.returncode != 0


def main() -> None:
    """Draw places, try each, and tell."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("modules", nargs="*", default=MODULES, metavar="MODULE")
    args = parser.parse_args()
    sources = {name: (LAB / name).read_text("utf-8") for name in args.modules}
    counts = {name: sum(1 for _ in changes(ast.parse(text))) for name, text in sources.items()}
    places = [(name, number) for name, count in counts.items() for number in range(count)]
    drawn, noticed = random.Random(args.seed).sample(places, min(args.count, len(places))), 0
    with tempfile.TemporaryDirectory() as folder:
        lab = Path(folder)
        for name in ("labkit", "tests"):
            shutil.copytree(ROOT / name, lab / name)
        shutil.copy(ROOT / "pyproject.toml", lab)
        for module, number in drawn:
            text, line = changed(sources[module], number)
            (lab / "labkit" / module).write_text(text, "utf-8")
            seen = is_noticed(lab, module)
            (lab / "labkit" / module).write_text(sources[module], "utf-8")
            noticed += seen
            print(f"{'noticed ' if seen else 'SURVIVED'} {module}: {line}", flush=True)
    print(f"{noticed} of {len(drawn)} noticed; there are {len(places)} places")


if __name__ == "__main__":
    main()
