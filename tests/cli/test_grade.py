"""Grading a class from the command line: interrupted, resumed, corrected, exported."""

import csv
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import pytest

from labkit.cli import main
from labkit.course.grading import class_run
from labkit.course.grading.assignment.files import FORMAT, cases_beside, read_secret, salt_of
from labkit.course.grading.assignment.files import _load as load_assignment
from labkit.course.grading.class_run import Graded, grade_class
from labkit.course.grading.pages.write import templates
from labkit.course.grading.sandbox.host import available_modes
from labkit.course.grading.similarity import Group

sys.path.insert(0, str(Path(__file__).parents[1] / "course/grading"))
from small import HANGS, RIGHT, SQUARED, hand_in, write_assignment

SAFE = any(not why for mode, why in available_modes().items() if mode != "none")
NEEDS_A_BOX = pytest.mark.skipif(
    not SAFE, reason="no isolation works here: apt install bubblewrap, or run as root on Linux"
)
GROUP = Group(
    students=("student00000", "student00001"), pairs=(("student00000", "student00001", 0.9),)
)
WHERE = [] if SAFE else ["--no-isolation"]


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    return write_assignment(tmp_path_factory.mktemp("grade") / "small")


@pytest.fixture
def grade(small, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        command = ["grade", *map(str, arguments), "--assignment", str(small), "--seconds", "2"]
        return main([*command, "--jobs", "2", *WHERE])

    return run


def scores(folder):
    with (folder / "scores.csv").open(encoding="utf-8") as file:
        return {row["student"]: float(row["score"]) for row in csv.DictReader(file)}


def test_a_class_gets_its_scores_pages_and_exports(grade, tmp_path, capsys):
    expected = hand_in(tmp_path / "class", 8)
    (tmp_path / "class/student00002.py").write_text(HANGS, encoding="utf-8")
    expected["student00002"] = 3.0
    assert grade("class", "--junit", "junit.xml") == 0
    assert scores(tmp_path / "grades") == expected
    assert "8 of 8 submissions graded" in capsys.readouterr().out
    page = (tmp_path / "grades/students/student00003.html").read_text(encoding="utf-8")
    assert "this is x squared" in page
    assert "8 submissions" in (tmp_path / "grades/index.html").read_text(encoding="utf-8")
    assert (tmp_path / "junit.xml").exists()


def test_it_goes_on_where_it_was_and_grades_what_changed(grade, tmp_path, capsys):
    expected = hand_in(tmp_path / "class", 4)
    assert grade("class", "--no-html") == 0
    capsys.readouterr()
    (tmp_path / "class/student00001.py").write_text(SQUARED, encoding="utf-8")
    (tmp_path / "class/new.py").write_text(RIGHT, encoding="utf-8")
    assert grade("class", "--no-html") == 0
    assert "2 of 5 submissions graded" in capsys.readouterr().out
    assert scores(tmp_path / "grades") == {**expected, "student00001": 3.5, "new": 5.0}
    assert grade("class", "--no-html", "--again", "new") == 0
    assert "1 of 5 submissions graded" in capsys.readouterr().out
    capsys.readouterr()
    assert grade("class", "--no-html", "--question", "negate") == 0
    assert "5 of 5 submissions graded (isolation: " in capsys.readouterr().out
    assert scores(tmp_path / "grades")["student00001"] == 3.5


def test_one_question_of_one_student_is_graded_again_and_nothing_else(grade, tmp_path, monkeypatch):
    expected = hand_in(tmp_path / "class", 4)
    assert grade("class", "--no-html") == 0
    asked = []

    def spy(part, settings, *rest, **more):
        asked.extend((one.student, settings.questions) for one in part)
        return grade_class(part, settings, *rest, **more)

    monkeypatch.setattr("labkit.cli.grade.grade_class", spy)
    assert grade("class", "--no-html", "--again", "student00003", "--question", "double") == 0
    assert asked == [("student00003", ("double",))]
    assert scores(tmp_path / "grades") == expected


def test_one_students_run_leaves_the_class_in_table_and_page(grade, tmp_path):
    expected = hand_in(tmp_path / "class", 3)
    assert grade("class") == 0
    (tmp_path / "late.py").write_text(SQUARED, encoding="utf-8")
    assert grade("late.py", "--student", "student00001") == 0
    assert scores(tmp_path / "grades") == {**expected, "student00001": 3.5}
    assert "3 submissions" in (tmp_path / "grades/index.html").read_text(encoding="utf-8")


def test_overrides_late_days_and_groups_survive_a_new_grading(grade, tmp_path, capsys):
    hand_in(tmp_path / "class", 4)  # 5, 5, 5, 3.5
    (tmp_path / "marks.csv").write_text(
        "student,question,points,comment\n"
        "student00003,double,1.5,you showed me the sheet\n"
        "student00003,late,2,\n"
        "student00000,bonus,0.5,\n",
        encoding="utf-8",
    )
    (tmp_path / "groups.csv").write_text(
        "student,group\nstudent00000,A\nemmy,A\nstudent00003,B\nstudent00002,B\ncarl,C\n",
        encoding="utf-8",
    )
    options = ["--overrides", "marks.csv", "--late-percent", "10", "--groups", "groups.csv"]
    expected = {
        "student00000": 5.5,
        "student00001": 5.0,
        "student00002": 5.0,
        "student00003": 3.6,  # the group's work, its first question set to 1.5, two days late
        "emmy": 5.0,
    }
    for again in ([], ["--again", "student00003"]):
        assert grade("class", *options, *again) == 0
        assert scores(tmp_path / "grades") == expected
        assert "nobody handed in for C" in capsys.readouterr().err
    page = (tmp_path / "grades/students/student00003.html").read_text(encoding="utf-8")
    assert "you showed me the sheet" in page
    assert "2 days late: 20 % off 4.5 points." in page
    assert "Handed in by student00002 for B." in page


def test_feedback_goes_back_under_the_names_that_came(grade, tmp_path):
    """Moodle's importziplib.php and Canvas's infer_comment_context_from_filename read these."""
    (tmp_path / "canvas").mkdir()
    (tmp_path / "canvas/lovelaceada_LATE_4711_98765_a.py").write_text(RIGHT, encoding="utf-8")
    (tmp_path / "canvas/noetheremmy_815_98766_a.py").write_text(RIGHT, encoding="utf-8")
    folder = tmp_path / "moodle/Ada Lovelace_4711_assignsubmission_file_"
    folder.mkdir(parents=True)
    (folder / "a.py").write_text(RIGHT, encoding="utf-8")
    for name, expected in {
        "canvas": ["lovelaceada_4711_98765_feedback.html", "noetheremmy_815_98766_feedback.html"],
        "moodle": ["Ada Lovelace_4711_assignsubmission_file_/feedback.html"],
    }.items():
        assert grade(name, "--feedback", f"{name}.zip", "--out", f"{name} grades") == 0
        with zipfile.ZipFile(tmp_path / f"{name}.zip") as archive:
            assert sorted(archive.namelist()) == expected
            assert b"5 of 5 points" in archive.read(expected[0])


def test_copies_stand_side_by_side(grade, tmp_path, monkeypatch):
    monkeypatch.setattr("labkit.cli.grade_outputs.groups_alike", lambda *_: [GROUP])
    hand_in(tmp_path / "class", 3)
    assert grade("class") == 0
    page = (tmp_path / "grades/index.html").read_text(encoding="utf-8")
    assert '<a href="pairs/1.html">student00000 and student00001</a>' in page
    pair = (tmp_path / "grades/pairs/1.html").read_text(encoding="utf-8")
    assert pair.count("return 2 * x") == 2
    assert grade("class", "--student", "ada", "--out", "others") == 0


def test_cases_of_a_secret_grade_and_go_into_the_archive(small, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    hand_in(tmp_path / "class", 1)
    secret = read_secret(tmp_path / "course.secret", make=True)
    folder = shutil.copytree(small, cases_beside(tmp_path / "course.secret"))
    command = ["grade", "class", "--no-html", *WHERE, "--secret", "course.secret"]
    assert main(command) == 1
    assert "was not drawn from course.secret; write them with" in capsys.readouterr().err
    for public, salt in ((False, salt_of(secret)), (True, "")):
        course = {"format": FORMAT, "public": public, "salt": salt, "right": {}}
        (folder / "hidden/course.json").write_text(json.dumps(course), encoding="utf-8")
        load_assignment.cache_clear()
        given = ["--secret", "course.secret"] if salt else ["--assignment", str(folder)]
        assert main([*command[:-2], *given]) == 0
        assert main(["autograder", "autograder.zip", *given]) == 0
        assert capsys.readouterr().err.count("which anybody can compute") == 2 * public
        with zipfile.ZipFile(tmp_path / "autograder.zip") as archive:
            held = archive.read("labkit/course/grading/assignment/hidden/course.json").decode()
            assert json.loads(held) == course
            assert secret not in b"".join(map(archive.read, archive.namelist()))


def test_every_option_is_told_of_on_the_instructors_page(capsys):
    with pytest.raises(SystemExit):
        main(["grade", "--help"])
    options = set(re.findall(r"--[a-z-]+", capsys.readouterr().out)) - {"--help", "--secret"}
    page = Path(__file__).parents[2] / "book/instructors.md"
    told = set(re.findall(r"--[a-z-]+", page.read_text(encoding="utf-8")))
    assert len(options) > 15
    assert not options - told


def test_a_question_that_fails_is_counted(grade, tmp_path, capsys, monkeypatch):
    hand_in(tmp_path / "class", 2)
    assert grade("class", "--no-html") == 0

    def lost(part, *_, **__):
        return (Graded(student=one.student, failure="lost") for one in part)

    monkeypatch.setattr("labkit.cli.grade.grade_class", lost)
    capsys.readouterr()
    assert grade("class", "--no-html", "--question", "negate") == 1
    assert "0 of 2 submissions graded (isolation: " in capsys.readouterr().out


def test_verdicts_among_the_submissions_are_not_graded(grade, tmp_path, capsys):
    hand_in(tmp_path, 2)
    for _ in range(2):
        assert grade(".") == 0
    assert "0 of 2 submissions graded" in capsys.readouterr().out
    assert set(scores(tmp_path / "grades")) == {"student00000", "student00001"}


def test_what_cannot_be_read_is_named_once(grade, tmp_path, capsys):
    hand_in(tmp_path / "class", 2)
    (tmp_path / "class/carl.rar").write_bytes(b"Rar!")
    assert grade("class", "--no-html") == 0
    assert capsys.readouterr().err.count("carl.rar") == 1
    assert len(scores(tmp_path / "grades")) == 2


def test_a_submission_named_like_a_module_is_not_imported_by_the_grader(small, tmp_path):
    """Workers are started where the grader is: often among the submissions."""
    for name in ("signal", "pickle", "socket", "random"):
        (tmp_path / f"{name}.py").write_text(f"open({name!r}, 'w')\n{RIGHT}", encoding="utf-8")
    command = [sys.executable, "-P", "-m", "labkit", "grade", ".", "--assignment", str(small)]
    command += ["--jobs", "2", "--no-html", *WHERE]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert "4 of 4 submissions graded" in done.stdout, done.stderr
    assert sorted(path.name for path in tmp_path.glob("[!g]*")) == [
        "pickle.py", "random.py", "signal.py", "socket.py",
    ]  # fmt: skip


def test_gradescope_gets_one_students_folder(grade, tmp_path):
    (tmp_path / "work").mkdir()
    (tmp_path / "work/answers.py").write_text(RIGHT, encoding="utf-8")
    results = tmp_path / "results.json"
    assert grade("work", "--student", "ada@x.org", "--gradescope", results, "--no-html") == 0
    assert json.loads(results.read_text(encoding="utf-8"))["score"] == 5.0


@pytest.mark.parametrize(
    ("arguments", "status", "says"),
    [
        (["missing"], 1, "missing: no such file or folder"),
        (["class", "--again", "nobody"], 2, "--again must name students (student00000"),
        (["class", "--question", "nine"], 2, "--question must be one of double, negate"),
        (["class", "--jobs", "0"], 2, "--jobs must be"),
        (["class", "--seconds", "0"], 2, "--seconds must be"),
        (["class", "--canvas", "book.csv"], 2, "--title and --canvas must be given together"),
        (["class", "--canvas", "book.csv", "--title", "Lab"], 1, "book.csv: cannot be read"),
        (["class", "--moodle", "sheet.csv"], 1, "sheet.csv: cannot be read"),
        (["class", "--gradescope", "r.json"], 2, "--gradescope is for one submission, got 2"),
        (["class", "--junit", "no/such/folder.xml"], 1, "does not exist; make it first"),
        (["class", "--out", "class/student00000.py"], 1, "choose another place"),
        (["class", "--assignment", "class"], 1, "name the folder of an assignment"),
        (["class", "--cluster", "tcp://127.0.0.1:9"], 1, "no Dask scheduler answers"),
    ],
)
def test_a_mistake_is_named_before_anything_is_graded(
    small, tmp_path, monkeypatch, capsys, arguments, status, says
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(class_run, "PATIENCE", 0.5)  # nobody ever answers
    hand_in(tmp_path / "class", 2)
    given = ["grade", "--assignment", str(small), "--no-html", *WHERE, *arguments]
    assert main(given) == status
    assert says in capsys.readouterr().err
    assert not (tmp_path / "grades/scores.csv").exists()


def test_a_folder_that_may_not_be_written_in_is_named_before_anything_is_graded(
    grade, tmp_path, monkeypatch, capsys
):
    """Though the verdicts could still be appended to a file in it."""
    hand_in(tmp_path / "class", 2)
    (tmp_path / "grades").mkdir()
    monkeypatch.setattr(os, "access", lambda place, mode: place != tmp_path / "grades")
    assert grade("class") == 1
    assert "cannot write grades/scores.csv: the directory" in capsys.readouterr().err
    assert list((tmp_path / "grades").iterdir()) == []


@NEEDS_A_BOX
def test_without_jinja2_the_extra_is_named_before_anything_is_graded(
    grade, tmp_path, monkeypatch, capsys
):
    hand_in(tmp_path / "class", 1)
    templates.cache_clear()
    monkeypatch.setitem(sys.modules, "jinja2", None)
    assert grade("class") == 1
    assert (
        'needs jinja2, which is not installed: python -m pip install "labkit[grading]"'
        in capsys.readouterr().err
    )
    assert not (tmp_path / "grades/scores.csv").exists()
    assert grade("class", "--no-html") == 0


@pytest.mark.skipif(sys.platform != "linux", reason="only there do workers come by a socket")
def test_a_folder_for_temporary_files_that_is_too_far_down_is_named(small, tmp_path):
    """The path of a socket has at most 107 letters, and multiprocessing puts one below TMPDIR."""
    far = tmp_path / ("deep" * 30)
    far.mkdir()
    hand_in(tmp_path / "class", 1)
    command = [sys.executable, "-m", "labkit", "grade", "class", "--assignment", str(small)]
    done = subprocess.run(
        command,
        cwd=tmp_path,
        env={**os.environ, "TMPDIR": str(far)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    (line,) = done.stderr.splitlines()
    assert line.startswith("labkit grade: no worker can be started: ")
    assert f"got TMPDIR={far}; name a folder" in line
    assert list(far.iterdir()) == []


def test_killed_halfway_and_resumed(small, tmp_path):
    """Takes some ten seconds; buys that a crash costs no verdict and leaves no process."""
    expected = hand_in(tmp_path / "class", 60)
    command = [sys.executable, "-m", "labkit", "grade", str(tmp_path / "class"), "--no-html"]
    command += ["--assignment", str(small), "--out", str(tmp_path / "grades"), "--jobs", "2"]
    with subprocess.Popen(command, stderr=subprocess.DEVNULL, start_new_session=True) as first:
        verdicts = tmp_path / "grades/verdicts.jsonl"
        deadline = time.monotonic() + 60
        while lines(verdicts) < 20 and time.monotonic() < deadline:
            time.sleep(0.02)
        os.killpg(first.pid, signal.SIGKILL)
    done = lines(verdicts) - 1
    assert 0 < done < 60
    again = subprocess.run(command, capture_output=True, text=True, check=True)
    assert f"{60 - done} of 60 submissions graded" in again.stdout
    assert scores(tmp_path / "grades") == expected


def lines(path):
    return path.read_bytes().count(b"\n") if path.exists() else 0


@NEEDS_A_BOX
@pytest.mark.skipif(os.name == "nt", reason="Windows knows no SIGINT of its own group")
def test_an_interruption_leaves_no_process_and_no_traceback(small, tmp_path):
    hand_in(tmp_path / "class", 2000)
    command = [sys.executable, "-m", "labkit", "grade", str(tmp_path / "class"), "--no-html"]
    command += ["--assignment", str(small), "--out", str(tmp_path / "grades"), "--jobs", "2"]
    heard = signal.signal(signal.SIGINT, signal.default_int_handler)  # a job in the background
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as run:  # ignores it
        signal.signal(signal.SIGINT, heard)
        deadline = time.monotonic() + 60
        while lines(tmp_path / "grades/verdicts.jsonl") < 5 and time.monotonic() < deadline:
            time.sleep(0.02)
        children = subprocess.run(
            ["pgrep", "-P", str(run.pid)], capture_output=True, text=True, check=True
        )
        run.send_signal(signal.SIGINT)
        _, errors = run.communicate(timeout=60)
    assert run.returncode == 130
    assert "interrupted" in errors
    assert "Traceback" not in errors
    deadline = time.monotonic() + 10
    while any(map(alive, children.stdout.split())) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert not any(map(alive, children.stdout.split()))


def alive(process):
    """Whether a process runs; one that ended and that nobody asked after does not."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False
