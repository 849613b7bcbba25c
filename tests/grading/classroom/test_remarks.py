"""What is odd on an instructor's day is said with a way out, and stands in the student's row."""

import csv
import json
import shutil
import sys
from pathlib import Path

from labkit.cli import main
from labkit.grading.questions import FORMAT
from tests.grading.classroom.test_handins import write
from tests.grading.small import RIGHT, hand_in, scores


def remarks():
    """The remark on each student in `scores.csv`."""
    with Path("grades/scores.csv").open(encoding="utf-8") as file:
        return {row["student"]: row["remark"] for row in csv.DictReader(file)}


def test_results_of_a_hand_in_that_is_gone_are_named(grade, tmp_path, capsys):
    hand_in(tmp_path / "class", 2)
    assert grade("class") == 0
    (tmp_path / "class/student00001.py").unlink()

    assert grade("class") == 0

    says = "kept the results of an earlier run, and handed in nothing to this one"
    assert f"1 {says}: student00001. Remove their files in" in capsys.readouterr().err
    assert remarks() == {"student00000": "", "student00001": says}


def test_people_are_called_by_their_names(grade, tmp_path, capsys):
    names = ["lovelaceada_4711_98765_a.pdf", "noetheremmy_4712_98766_a.py"]
    write(tmp_path / "class", names, RIGHT)

    assert grade("class") == 0

    assert "1 handed in files that were not read: lovelaceada. " in capsys.readouterr().err


def test_one_file_beside_the_results_of_its_class_is_nothing_odd(grade, tmp_path, capsys):
    hand_in(tmp_path / "class", 2)
    assert grade("class") == 0

    assert grade("class/student00000.py") == 0

    assert "earlier run" not in capsys.readouterr().err


def test_a_roster_that_fits_nobody_is_named(grade, tmp_path, capsys):
    """A spreadsheet takes zeros at the front of a number."""
    write(tmp_path / "class", ["0001.py", "0002.py"], RIGHT)
    write(tmp_path, ["grades/roster.csv"], "student,name\n1,Ada\n2,Emmy\n")

    assert grade("class") == 0

    err = capsys.readouterr().err
    assert "2 handed in nothing: Ada; Emmy" in err
    assert "2 handed in without a line in grades/roster.csv: 0001; 0002. Correct the table" in err
    assert remarks()["0001"] == "handed in without a line in grades/roster.csv"


def test_an_old_folder_of_results_is_no_student(grade, tmp_path, capsys):
    hand_in(tmp_path / "class", 2)
    assert grade("class", "--out", "class/grades") == 0

    assert grade("class", "--out", "grades") == 0

    assert set(scores()) == {"student00000", "student00001"}
    assert "class: grades holds results of `labkit grade`; skipped" in capsys.readouterr().err


def test_no_provisional_mark_gets_into_a_gradebook(grade, tmp_path, capsys):
    hand_in(tmp_path / "class", 2)
    write(
        tmp_path,
        ["grades/adjustments.csv"],
        "student,what,value,comment\n*,written,5,\nstudent00001,written,4,\n",
    )
    names = [f"student0000{k}" for k in range(2)]
    rows = [f"{name},{name},," for name in names]
    write(tmp_path, ["book.csv"], "\n".join(["Student,ID,Section,Lab", *rows]))

    assert grade("class", "--canvas", "book.csv", "Lab") == 0

    assert Path("grades/canvas.csv").read_text("utf-8").splitlines()[1:] == [
        "student00001,student00001,,9"
    ]
    assert "1 got no points for written answers yet" in capsys.readouterr().err
    assert "no points for written answers" in remarks()["student00000"]


def test_written_answers_that_are_worth_nothing_keep_nobody_waiting(grade, tmp_path, capsys):
    hand_in(tmp_path / "class", 1)
    write(tmp_path, ["grades/adjustments.csv"], "student,what,value,comment\n*,written,0,\n")

    assert grade("class") == 0

    assert "written answers" not in capsys.readouterr().err


def test_a_hand_in_that_nobody_read_does_not_count_as_graded(grade, tmp_path, capsys):
    write(tmp_path / "class", ["ada.pdf", "emmy/a.py"], RIGHT)

    assert grade("class") == 0

    assert "Graded 1 of 2 submissions" in capsys.readouterr().out


def test_a_student_is_graded_afresh_by_name(grade, tmp_path, capsys):
    hand_in(tmp_path / "class", 2)
    assert grade("class") == 0
    times = {path: path.stat().st_mtime_ns for path in Path("grades/verdicts").iterdir()}

    assert grade("class", "--again", "student00001") == 0

    changed = [path.stem for path, time in times.items() if path.stat().st_mtime_ns != time]
    assert changed == ["student00001"]
    write(tmp_path, ["grades/roster.csv"], "student,name,group\nada,Ada L.,student00000\n")
    assert grade("class", "--again", "Ada L.") == 0
    changed = [path.stem for path, time in times.items() if path.stat().st_mtime_ns != time]
    assert sorted(changed) == ["student00000", "student00001"]
    assert grade("class", "--again", "student00007") == 1
    assert "--again: no students are called 'student00007'; did you" in capsys.readouterr().err


def test_a_folder_with_such_a_table_alone_is_a_student(grade, tmp_path):
    write(tmp_path / "class", ["ada/adjustments.csv", "ada/a.py", "emmy/a.py"], RIGHT)

    assert grade("class") == 0

    assert scores() == {"ada": 5.0, "emmy": 5.0}


def test_a_secret_that_is_forgotten_changes_no_mark(grade, small, tmp_path, monkeypatch, capsys):
    hand_in(tmp_path / "class", 1)
    assert grade("class") == 0
    public = shutil.copytree(small, tmp_path / "public")
    course = json.dumps({"format": FORMAT, "public": True, "right": {}})
    (public / "hidden/course.json").write_text(course, encoding="utf-8")
    monkeypatch.setattr(sys.modules["labkit.cli.main"], "FOLDER", public)

    assert main(["grade", "class"]) == 1

    assert (
        "grades holds marks by the cases of a secret: name it, --secret" in capsys.readouterr().err
    )
