"""Every command that a page names is run by the walk, or a reason says why not."""

import re
import subprocess
import sys

import pytest

from labkit.cli.main import build_parser
from tests.tools import documented

KNOWN = {*documented.WALKED, *documented.INSTALLED, *documented.EXCUSED}


@pytest.mark.parametrize("page", documented.PAGES)
def test_every_command_of_a_page_is_run_or_excused(page):
    commands = documented.commands(page)
    assert commands
    unknown = [each for each in commands if each not in KNOWN and not documented.PARTS.match(each)]
    assert not unknown, "run it in tests/tools/documented.py, or say there why not"


def test_what_is_run_or_excused_is_still_told_and_the_walk_holds_it():
    every = {command for page in documented.PAGES for command in documented.commands(page)}
    assert KNOWN - every == set()
    for command, file in documented.WALKED.items():
        assert command.removesuffix(" lowest") in (documented.ROOT / file).read_text("utf-8")


def test_no_text_names_a_command_that_is_gone():
    """Of labkit's commands every chapter and page names those alone that the parser has."""
    files = [*documented.ROOT.glob("notebooks/*.ipynb"), *documented.ROOT.glob("book/*.md")]
    text = "".join(file.read_text("utf-8") for file in files)
    named = set(re.findall(r"`labkit ([a-z]+)", text))
    commands = set(re.findall(r"^    ([a-z]+)", build_parser().format_help(), re.MULTILINE))
    assert named
    assert named <= commands


@pytest.mark.parametrize("offer", [False, True], ids=["as it stands", "with its comments"])
def test_the_program_of_the_readme_runs(tmp_path, offer):
    documented.prepare(tmp_path)
    program = documented.python_of("README.md")
    if not offer:
        program = (documented.ROOT / "README.md").read_text("utf-8").split("```python\n")[1]
        program = program.split("```")[0]

    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=False
    )

    assert done.returncode == 0, done.stderr
    assert "OdometryResult(5 scans" in done.stdout
