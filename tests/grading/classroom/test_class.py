"""`labkit grade` on a class: interrupted, resumed, corrected, exported."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import pytest

from labkit.cli import main
from labkit.grading.questions import FORMAT, cases_beside, read_assignment, read_secret
from tests.grading.classroom.test_handins import ZIP64, write
from tests.grading.small import HANGS, RIGHT, SQUARED, hand_in, scores


def verdicts(folder="grades"):
    """What is stored of each student, but for the time that it took."""
    found = {}
    for path in Path(folder, "verdicts").glob("*.json"):
        found[path.stem] = json.loads(path.read_text(encoding="utf-8"))
        found[path.stem]["verdict"].pop("seconds")
    return found


def decide(lines):
    with Path("grades/adjustments.csv").open("a", encoding="utf-8") as file:
        file.write(lines)


def test_a_class_gets_scores_pages_and_code_for_its_owner_alone(grade, tmp_path, capsys):
    expected = hand_in(tmp_path / "class", 4)
    write(tmp_path, ["class/student00002.py"], HANGS)
    expected["student00002"] = 3.0
    assert grade("class") == 0
    assert scores() == expected
    assert "Graded 4 of 4 submissions" in capsys.readouterr().out
    write(tmp_path, ["student00001.py"], SQUARED)
    assert grade("student00001.py") == 0
    assert scores() == {**expected, "student00001": 3.5}
    with zipfile.ZipFile("grades/feedback.zip") as archive:
        assert archive.namelist() == ["student00001.html"]
    page = Path("grades/students/student00003.html").read_text(encoding="utf-8")
    assert "this is x squared" in page
    assert "4 marks" in Path("grades/index.html").read_text(encoding="utf-8")
    code = Path("grades/code/student00003.py").read_text(encoding="utf-8")
    assert code == f"{SQUARED}# student00003\n"
    assert "def double" in Path("grades/handed_out.py").read_text(encoding="utf-8")
    for path in Path("grades").rglob("*"):
        assert path.stat().st_mode & 0o077 == 0, path


def test_it_goes_on_where_it_was_and_keeps_what_people_decided(grade, tmp_path, capsys):
    expected = hand_in(tmp_path / "class", 3)
    assert grade("class") == 0
    before = verdicts()
    decide("student00000,double,0,copied\n*,late_percent,10,\nstudent00002,late,2,\n")
    decide("*,written,4,\nnew,written,0,\n")
    write(tmp_path, ["grades/roster.csv"], "student,name\nstudent00000,Ada\nabsent,Nobody N.\n")
    write(tmp_path, ["class/new.py"], SQUARED)
    for _ in range(2):
        assert grade("class") == 0
        decided = {**expected, "student00000": 3.0, "student00002": 4.0, "new": 3.5, "absent": -1}
        assert scores() == decided
        assert {name: entry for name, entry in verdicts().items() if name != "new"} == before
        told = capsys.readouterr().err
        assert "1 handed in nothing: Nobody N." in told
        assert "3 got no points for written answers yet, and so no row in a gradebook: " in told
    assert "Nobody N." in Path("grades/index.html").read_text(encoding="utf-8")
    decide("ada,double,0,\n")
    assert grade("class") == 1
    assert "line 7: no students are called 'ada'" in capsys.readouterr().err


def test_one_submission_that_cannot_be_read_costs_nobody_else(grade, tmp_path, monkeypatch, capsys):
    """The archive once ended the whole class's run."""
    write(tmp_path / "class", ["ada/a.py", "zoe/a.py"], RIGHT)
    write(tmp_path / "class", ["mallory/a.zip"]).joinpath("mallory/a.zip").write_bytes(ZIP64)
    assert grade("class") == 0
    assert scores() == {"ada": 5.0, "mallory": -1, "zoe": 5.0}
    assert "a.zip cannot be read" in Path("grades/index.html").read_text(encoding="utf-8")

    tries = []

    def broken(files):
        tries.append(files)
        raise OverflowError("beyond all")

    monkeypatch.setattr("labkit.grading.classroom.rounds.read_files", broken)
    assert grade("class") == 1
    err = capsys.readouterr().err
    assert "zoe was not graded: OverflowError: beyond all" in err
    assert len(tries) == 3  # once each: no machine's fault
    assert scores() == {"ada": 5.0, "mallory": -1, "zoe": 5.0}


def test_a_group_has_one_mark_for_all_members(grade, tmp_path):
    """Law 5."""
    write(tmp_path / "class", ["red/a.py"], SQUARED)
    write(tmp_path / "class", ["zoe/a.py"], RIGHT)
    roster = "student,name,group\nada,Ada,red\nemmy,Emmy,red\nzoe,Zoe,\n"
    write(tmp_path, ["grades/roster.csv"], roster)

    assert grade("class") == 0

    assert scores() == {"ada": 3.5, "emmy": 3.5, "zoe": 5.0}


def test_a_hand_in_beside_the_group_s_is_told(grade, tmp_path, capsys):
    write(tmp_path / "class", ["red/a.py"], SQUARED)
    write(tmp_path / "class", ["ada/a.py"], RIGHT)
    write(tmp_path, ["grades/roster.csv"], "student,group\nada,red\nemmy,red\n")

    assert grade("class") == 0

    assert scores() == {"ada": 3.5, "emmy": 3.5}
    assert "1 handed in alone, and got the mark of the group in roster.csv: ada" in (
        capsys.readouterr().err
    )
    pages = [Path(f"grades/students/{one}.html").read_text("utf-8") for one in ("ada", "emmy")]
    assert ["The hand-in of red counts for you" in page for page in pages] == [True, False]


def test_what_a_group_is_given_holds_for_its_members_and_what_one_is_given_stays_private(
    grade, tmp_path
):
    """Law 5."""
    write(tmp_path / "class", ["red/a.py", "zoe/a.py"], RIGHT)
    roster = "student,name,group\nada,Ada,red\nemmy,Emmy,red\n"
    write(tmp_path, ["grades/roster.csv"], roster)
    lines = "student,what,value,comment\nred,double,1,for both\nemmy,negate,0,in private\n"
    write(tmp_path, ["grades/adjustments.csv"], lines)

    assert grade("class") == 0

    assert scores() == {"ada": 4.0, "emmy": 1.0, "zoe": 5.0}
    with zipfile.ZipFile("grades/feedback.zip") as archive:
        page = archive.read("red.html").decode()
    assert "for both" in page
    assert "in private" not in page
    assert "<b>Emmy</b>" in Path("grades/students/emmy.html").read_text(encoding="utf-8")
    decide("ada,double,2,\n")
    assert grade("class") == 1


def test_a_group_is_as_late_as_the_worksheet_says_of_its_members(grade, tmp_path):
    write(tmp_path / "class", ["red/a.py", "zoe/a.py"], RIGHT)
    write(tmp_path, ["grades/roster.csv"], "student,name,group\n1,Ada,red\n2,Emmy,red\n")
    write(tmp_path, ["grades/adjustments.csv"], "student,what,value\n*,late_percent,10\n")
    status = "Submitted for grading - 2 days late"
    rows = [f"Participant {number},{status}," for number in (1, 2)]
    write(tmp_path, ["book.csv"], "\n".join(["Identifier,Status,Grade", *rows]))

    assert grade("class", "--moodle", "book.csv") == 0

    assert scores() == {"1": 4.0, "2": 4.0, "zoe": 5.0}


def test_each_member_of_a_group_in_gradescope_has_a_page_of_their_own(grade, tmp_path):
    """Two pages of one name once stood in the archive."""
    people = "".join(f"  - :name: {name}\n    :email: {name}@x.org\n" for name in ("ada", "emmy"))
    write(tmp_path / "class", ["submission_77/a.py", "submission_78/a.py"], RIGHT)
    text = f"submission_77:\n  :submitters:\n{people}"
    write(tmp_path / "class", ["submission_metadata.yml"], text)

    assert grade("class") == 0

    with zipfile.ZipFile("grades/feedback.zip") as archive:
        pages = {name: archive.read(name).decode() for name in archive.namelist()}
    assert len(pages) == 3
    assert all(sum(name in page for page in pages.values()) == 1 for name in ("ada", "emmy"))


@pytest.mark.parametrize("name", ["ada.rar", "ada.7z", "ada.pdf", "ada/.hidden.py", "ada/a.rar"])
def test_who_handed_in_nothing_that_can_be_read_has_a_row_with_the_reason(
    name, grade, tmp_path, capsys
):
    """Laws 4 and 5."""
    write(tmp_path / "class", [name, "emmy/a.py", "zoe/a.py"], RIGHT)

    assert grade("class") == 0

    ada, _, zoe = Path("grades/scores.csv").read_text("utf-8").splitlines()[1:]
    assert ada.startswith("ada,ada,,")
    assert "handed in" in ada
    assert zoe.startswith("zoe,zoe,5,5")
    assert (
        "1 handed in files that were not read: ada. grades/index.html says why"
        in capsys.readouterr().err
    )


def test_code_of_nobody_is_told_and_ends_in_status_1(grade, tmp_path, capsys):
    """Law 5: never skipped with exit 0."""
    names = ["Ada L_4711_assignsubmission_file_/a.py", "stray.py"]
    write(tmp_path / "class", names, RIGHT)

    assert grade("class", "--layout", "moodle") == 1

    assert "1 files with code belong to no student, and are not graded: stray.py" in (
        capsys.readouterr().err
    )
    assert scores() == {"4711": 5.0}


@pytest.mark.skipif(os.name == "nt", reason="Windows knows no SIGKILL")
def test_killed_in_the_middle_it_goes_on_to_equal_verdicts(grade, options, tmp_path):
    hand_in(tmp_path / "class", 5)
    start = (
        f"import sys\nfrom labkit.cli import main\n"
        f"sys.modules['labkit.cli.main'].FOLDER = {options[2] + '.cases'!r}\n"
        f"main({[*options, 'class', '--jobs', '1']})"
    )
    command = [sys.executable, "-c", start]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as run:
        while len(verdicts()) < 2:
            assert run.poll() is None
            time.sleep(0.02)
        run.send_signal(signal.SIGKILL)
    assert len(verdicts()) < 5
    assert grade("class") == 0
    assert grade("class", "--out", "afresh") == 0
    assert verdicts() == verdicts("afresh")
    assert len(verdicts()) == 5


def test_lateness_comes_from_the_platform(grade, tmp_path):
    names = ["lovelaceada_LATE_4711_98765_a.py", "noetheremmy_4712_98766_a.py"]
    write(tmp_path / "class", names, RIGHT)
    assert grade("class") == 0
    decide("*,late_percent,20,\n")
    assert grade("class") == 0
    assert scores() == {"4711": 4.0, "4712": 5.0}
    with zipfile.ZipFile("grades/feedback.zip") as archive:  # under names that Canvas takes back
        assert b"4 of 5 points" in archive.read("lovelaceada_4711_98765_feedback.html")
    os.rename(tmp_path / "class" / names[0], tmp_path / "class" / names[0].replace("_LATE", ""))
    assert grade("class") == 0  # the same bytes; the teacher took the mark away
    assert scores() == {"4711": 5.0, "4712": 5.0}


def test_what_moodles_worksheet_says_holds_for_runs_without_it(grade, tmp_path):
    for name in ("Ada L_4711", "Emmy N_4712"):
        write(tmp_path / "class", [f"{name}_assignsubmission_file_/a.py"], RIGHT)
    sheet = (
        "Identifier,Full name,Status,Grade,Maximum Grade\n"
        "Participant 4711,Ada L,Submitted for grading - 1 day 12 hours late,,5\n"
        "Participant 4712,Emmy N,Submitted for grading,,5\n"
        "Participant 4713,Zoe Z,No submission,,5\n"
    )
    write(tmp_path, ["sheet.csv"], sheet)
    assert grade("class", "--moodle", "sheet.csv") == 0
    assert scores() == {"4711": 5.0, "4712": 5.0, "4713": -1}
    decide("*,late_percent,20,\n")
    assert grade("class") == 0
    assert scores() == {"4711": 3.5, "4712": 5.0}


def test_cases_of_a_secret_grade_and_go_into_the_archive(grade, small, tmp_path, capsys):
    hand_in(tmp_path / "class", 1)
    secret = read_secret(tmp_path / "course.secret")
    assert Path("course.secret").stat().st_mode & 0o077 == 0
    assert grade("class", "--secret", "course.secret") == 1
    assert "course.secret.cases/questions.json: No such file" in capsys.readouterr().err
    folder = shutil.copytree(small, cases_beside(tmp_path / "course.secret"))
    course = {"format": FORMAT, "public": False, "right": {}}
    (folder / "hidden/course.json").write_text(json.dumps(course), encoding="utf-8")
    assert grade("class", "--secret", "course.secret") == 0
    text = (folder / "questions.json").read_text(encoding="utf-8")
    (folder / "questions.json").write_text(text.replace("2.0", "4.0", 1), encoding="utf-8")
    read_assignment.cache_clear()
    assert grade("class", "--secret", "course.secret") == 1
    assert "the points of `double` was 4.0 and is 2.0. Draw it again" in capsys.readouterr().err
    (folder / "questions.json").write_text(text, encoding="utf-8")
    read_assignment.cache_clear()
    assert main(["autograder", "autograder.zip", "--secret", "course.secret"]) == 0
    assert "anyone can compute" not in capsys.readouterr().err
    assert Path("autograder.zip").stat().st_mode & 0o077 == 0
    with zipfile.ZipFile("autograder.zip") as archive:
        held = archive.read("assignment/hidden/course.json").decode()
        assert json.loads(held) == course
        assert secret not in b"".join(map(archive.read, archive.namelist()))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["missing"], "missing: cannot be read: No such file"),
        (["class", "--jobs", "0"], "--jobs must be"),
        (["class", "--canvas", "no.csv", "Lab"], "no.csv: cannot be read"),
        (["class", "--secret", "no"], "no.cases/questions.json: No such file"),
        (["class", "--out", "class/student00000.py"], "cannot write class/student00000.py"),
    ],
)
def test_a_mistake_is_told_before_the_work(arguments, message, grade, tmp_path, capsys):
    hand_in(tmp_path / "class", 2)
    assert grade(*arguments) in (1, 2)
    assert message in capsys.readouterr().err
    assert not (tmp_path / "grades").exists()


@pytest.mark.parametrize("place", ["grades/canvas.csv", "grades/scores.csv", "book.csv"])
def test_no_result_is_written_over_a_gradebook(place, grade, tmp_path, capsys):
    """Law 5: ``--out`` beside the download, or a link to it, once lost the whole gradebook."""
    hand_in(tmp_path / "class", 1)
    text = "Student,ID,Lab 1 (7),Final\nAda,1,,9\n"
    write(tmp_path, [place], text)
    Path("grades").mkdir(exist_ok=True)
    if place == "book.csv":
        Path("grades/canvas.csv").symlink_to(tmp_path / place)

    assert grade("class", "--canvas", place, "Lab 1") == 1

    err = capsys.readouterr().err
    assert f"{place}: is to be read" in err
    assert "choose another --out" in err
    assert Path(place).read_text(encoding="utf-8") == text


@pytest.mark.slow
def test_a_cluster_gives_the_same_marks(grade, tmp_path):
    """Takes some ten seconds; buys `--cluster`."""
    distributed = pytest.importorskip("distributed")
    expected = hand_in(tmp_path / "class", 3)
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, dashboard_address=":0"
    ) as cluster:
        assert grade("class", "--cluster", cluster.scheduler_address) == 0
    assert scores() == expected


def test_a_cluster_that_is_not_there_is_named(grade, tmp_path, monkeypatch, capsys):
    pytest.importorskip("distributed")
    monkeypatch.setattr("labkit.grading.classroom.rounds.PATIENCE", 0.2)
    hand_in(tmp_path / "class", 1)
    assert grade("class", "--cluster", "tcp://127.0.0.1:9") == 1
    assert "no Dask worker answers at 'tcp://127.0.0.1:9'" in capsys.readouterr().err
