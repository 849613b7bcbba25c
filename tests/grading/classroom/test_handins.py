"""Who handed in what: no name that a student chooses moves a file to another student."""

import base64
import os
import shutil
import zipfile
from pathlib import Path

import pytest

from labkit.grading.classroom import handins
from labkit.grading.classroom.handins import (
    LAYOUTS,
    find_submissions,
    list_files,
    one_submission,
    read_files,
)
from labkit.support.errors import LabkitError

# What a platform puts before the name of a student's file, and after it in a folder of its own.
PLATFORMS = {
    "canvas": "{name}_{number}_98765_",
    "canvas, late": "{name}_LATE_{number}_98765_",
    "canvas, without names": "anon_{number}a_98765_",
    "moodle": "{name}_{number}_assignsubmission_file_/",
    "moodle, in one folder": "{name}_{number}_assignsubmission_file_",
    "gradescope": "submission_{number}/",
    "gradescope, with its folder": "assignment_7_export/submission_{number}/",
    "folders": "{number}/",
    "folders of nbgrader": "submitted/{number}/lab1/",
}
STUDENTS = {"ada": 4711, "mallory": 4712}
ODD = (
    "answers.ipynb",
    "ada_4711_98799_answers.ipynb",
    "LATE_4711_98799_answers.py",
    "x_4711_attempt_2099-01-01-00-00-00_answers.ipynb",
    "Ada_4711_assignsubmission_file_/answers.ipynb",
    "submission_4711/answers.py",
    "assignment_7_export/submission_4711/answers.py",
    "submitted/4711/lab1/answers.py",
    "4711.zip",
    "\x1b[2J\u202e.py",
    "\udcff.py",
    "é*+=.py",
)


def write(folder, names, text="k = 1\n"):
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return folder


def pack(path, names):
    with zipfile.ZipFile(path, "w") as archive:
        for name in names:
            archive.writestr(name, "k = 1\n")
    return path


def told(handed_in):
    """What is known of each student of a class in which all files are somebody's."""
    found, lost, remarks = find_submissions(handed_in)
    assert not remarks
    assert not lost
    assert all(file.name.isprintable() for one in found for file in one.files)
    return [(one.student, one.name, one.late, one.feedback_name, len(one.files)) for one in found]


@pytest.mark.parametrize("platform", PLATFORMS)
def test_what_a_student_calls_a_file_chooses_nothing(platform, tmp_path):
    """Law: whatever a file is called, what is known of its student is as with a plain name."""
    part = PLATFORMS[platform]
    ada, mallory = (part.format(name=name, number=number) for name, number in STUDENTS.items())
    plain = told(write(tmp_path / "plain", [f"{ada}a.py", f"{mallory}a.py"]))
    assert [one[0][:4] for one in plain] == ["4711", "4712"]
    assert {one[2] for one in plain} == {
        float("late" in platform) if "canvas" in platform else None
    }
    for place, odd in enumerate(ODD):
        name = mallory + (odd if part.endswith("/") else odd.replace("/", "_"))
        names = [f"{ada}a.py", name]
        assert told(write(tmp_path / f"{place}", names)) == plain
        if odd.isprintable() and "nbgrader" not in platform:
            assert told(pack(tmp_path / f"{place}.zip", names)) == plain


def test_each_layout_is_tried_and_described():
    names = {platform.partition(",")[0].partition(" ")[0] for platform in PLATFORMS}
    page = Path(__file__).parents[3].joinpath("book/instructors.md").read_text("utf-8")

    assert names == LAYOUTS.keys()
    assert all(f"| `{name}` |" in page for name in LAYOUTS)


def test_the_archive_of_a_class_is_opened_once(tmp_path, monkeypatch):
    found, _, _ = find_submissions(pack(tmp_path / "class.zip", ["ada.py", "emmy.py"]))
    monkeypatch.setattr(zipfile, "ZipFile", None)
    assert [read_files(one.files)[1] for one in found] == [(), ()]


def test_of_two_uploads_with_one_name_the_newest_counts(read, tmp_path):
    folder = write(tmp_path / "class", ["ada_LATE_1_12_a.py", "emmy_2_13_a.py"], "new = 1\n")
    write(folder, ["ada_1_9_a.py", "zoe_LATE_3_14_a.py", "zoe_3_15_b.py"], "old = 1\n")
    found, _, _ = find_submissions(folder)
    assert read(found[0])[0] == {"a.py": "new = 1\n"}
    assert [one.late for one in found] == [1.0, 0.0, 1.0]


def test_files_are_read_from_old_to_new(read, tmp_path):
    folder = write(tmp_path, ["ada/a.py", "ada/b.py", "ada/c.py"], "k = 1\n") / "ada"
    for name, seconds in (("b.py", 2e9), ("a.py", 3e9), ("c.py", 1e9)):
        os.utime(folder / name, (seconds, seconds))

    files, _ = read(one_submission(folder, "ada"))

    assert list(files) == ["c.py", "b.py", "a.py"]


def test_an_archive_is_read_from_old_to_new(read, tmp_path):
    with zipfile.ZipFile(tmp_path / "work.zip", "w") as archive:
        for name, year in (("b.py", 2025), ("a.py", 2026), ("c.py", 2024)):
            archive.writestr(zipfile.ZipInfo(name, (year, 1, 1, 0, 0, 0)), "k = 1\n")
    (tmp_path / "ada").mkdir()
    (tmp_path / "work.zip").rename(tmp_path / "ada/work.zip")
    files, _ = read(one_submission(tmp_path / "ada", "ada"))
    assert [name[-4:] for name in files] == ["c.py", "b.py", "a.py"]


def test_a_class_of_two_layouts_is_refused_with_the_way_out(tmp_path):
    folder = write(tmp_path / "class", ["ada_4711_98765_a.py", "emmy.py"])
    with pytest.raises(LabkitError, match=r"emmy\.py is not; use --layout canvas or --layout fold"):
        find_submissions(folder)
    found, lost, _ = find_submissions(folder, layout="canvas")
    assert [one.student for one in found] == ["4711"]
    assert lost == ["emmy.py"]
    found, _, _ = find_submissions(folder, layout="folders")
    assert [one.student for one in found] == ["ada_4711_98765_a", "emmy"]
    with pytest.raises(
        LabkitError, match=r"no file name fits the moodle layout \(for example ada_4711_98765_a\.py"
    ):
        find_submissions(folder, layout="moodle")


def test_one_folder_around_all_is_not_taken_for_a_student(tmp_path):
    write(tmp_path / "class", ["lab 1/ada/a.py", "lab 1/emmy/a.py"])
    with pytest.raises(
        LabkitError, match=r"all files are in one folder, lab 1\. .*--layout folders"
    ):
        find_submissions(tmp_path / "class")
    assert len(find_submissions(tmp_path / "class/lab 1")[0]) == 2
    assert told(tmp_path / "class/lab 1/ada/a.py")[0][0] == "a"


def test_marks_and_leftovers_are_nobodys_work(tmp_path):
    folder = write(tmp_path, ["ada.py", "grades/code/ada.py", ".git/a.py", "emmy/__pycache__/x.py"])
    write(folder, ["notes.txt"])
    (folder / "link.py").symlink_to(folder / "ada.py")
    (folder / "zoe").mkdir()
    found, lost, remarks = find_submissions(folder, out=folder / "grades")
    assert [(one.student, len(one.files)) for one in found] == [("ada", 1), ("emmy", 0), ("zoe", 0)]
    assert not lost
    assert f"{folder}: notes.txt belongs to no student; skipped" in remarks
    assert [one for one in remarks if "empty" in one] == [
        f"{folder}: {name} is an empty folder" for name in ("emmy", "zoe")
    ]


@pytest.mark.parametrize("is_zipped", [False, True])
def test_an_empty_folder_is_a_student_without_files(is_zipped, tmp_path):
    """Law 5: in an archive it is a name alone."""
    folder = write(tmp_path / "class", ["Ada L_4711_assignsubmission_file_/a.py"])
    (folder / "Kim Li_4710_assignsubmission_file_").mkdir()
    if is_zipped:
        folder = Path(shutil.make_archive(str(folder), "zip", folder))

    found, lost, remarks = find_submissions(folder)

    assert [(one.name, len(one.files)) for one in found] == [("Kim Li", 0), ("Ada L", 1)]
    assert not lost
    assert remarks == [f"{folder}: Kim Li_4710_assignsubmission_file_ is an empty folder"]


@pytest.mark.parametrize("name", ["Ada_L", "_", "Lovelace_4712_Ada", "O'Neill_Ada-Maria"])
def test_a_name_in_moodle_may_hold_what_stands_between_its_parts(name, tmp_path):
    """Law 5: joined, and by the platform's own number."""
    folder = write(
        tmp_path, [f"{name}_4711_assignsubmission_file_/x_1_assignsubmission_file_/a.py"]
    )

    ((student, shown, *_),) = told(folder)

    assert (student, shown) == ("4711", name)


@pytest.mark.parametrize("name", ["Ada_L", "_", "Lovelace_4712_Ada"])
def test_a_name_in_moodles_flat_download_may_hold_it_too(name, tmp_path):
    folder = write(tmp_path, [f"{name}_4711_assignsubmission_file_a_1.py"])

    ((student, shown, *_),) = told(folder)

    assert (student, shown) == ("4711", name)


@pytest.mark.parametrize("is_zipped", [False, True])
def test_a_file_of_the_largest_size_is_read_and_no_larger_one(is_zipped, tmp_path, monkeypatch):
    monkeypatch.setattr(handins, "MAX_FILE", 10)
    folder = write(tmp_path / "class", ["ada/a.py"], "k = 123456")
    write(folder, ["ada/b.py"], "k = 1234567")
    if is_zipped:
        folder = Path(shutil.make_archive(str(folder), "zip", folder))

    (ada,), *_ = find_submissions(folder, layout="folders")
    files, unread = read_files(ada.files)

    assert files == {"a.py": b"k = 123456"}
    assert len(unread) == 1


def test_a_flat_file_that_could_be_two_students_is_refused(tmp_path):
    """Law 5: in a name with "_" nobody can tell the platform's number from the student's."""
    part = "assignsubmission_file"
    folder = write(tmp_path, [f"Ada_4711_{part}_a.py", f"A_B_4713_{part}_C_4712_{part}_a.py"])

    with pytest.raises(LabkitError, match="some files are named as moodle names them, but A_B_"):
        find_submissions(folder)


METADATA = """---
submission_77:
  :submitters:
  - :name: Ada Lovelace
    :sid: '4711'
    :email: ada@x.org
  - :name: "Emmy Noether"
    :sid: '815'
    :email:
  :created_at: 2026-11-20 10:00:00.000000000 Z
  :history:
  - :id: 76
    :email: not@x.org
submission_78:
  :submitters:
  - :name: Grace Hopper
    :email: grace@x.org
  - :name: Kurt Gödel
"""


@pytest.mark.parametrize("is_zipped", [False, True])
def test_gradescope_s_export_is_joined_with_its_people_and_groups(is_zipped, tmp_path):
    """Law 5: one hand-in is that of all its members."""
    files = [f"assignment_7_export/submission_{number}/a.py" for number in (77, 78, 79)]
    folder = write(tmp_path / "class", files)
    write(folder, ["assignment_7_export/submission_metadata.yml"], METADATA)
    if is_zipped:
        with zipfile.ZipFile(tmp_path / "class.zip", "w") as archive:
            for path in folder.rglob("*.*"):
                archive.write(path, path.relative_to(folder))
        folder = tmp_path / "class.zip"

    found, _, _ = find_submissions(folder)

    people = {one.student: one.name for one in found}
    assert people == {
        "79": "79",
        "815": "Emmy Noether",
        "Kurt Gödel": "Kurt Gödel",
        "ada@x.org": "Ada Lovelace",
        "grace@x.org": "Grace Hopper",
    }


ZIP64 = base64.b64decode(  # a file that claims to lie beyond 2⁶³
    "UEsDBBQAAAAAAMg6d10kTBtgBQAAAAUAAAAEAAAAYS5weWsgPSAxUEsBAhQDFAAAAAAAyDp3XSRMG2AFAAAABQAAAAQA"
    "DAAAAAAAAAAAAIAB/////2EucHkBAAgA/v////////9QSwUGAAAAAAEAAQA+AAAAJwAAAAAA"
)


@pytest.mark.parametrize("data", [b"", b"PK\x03\x04", ZIP64, b"PK\1\2" * 90_000])
def test_a_damaged_archive_costs_itself_alone(data, read, tmp_path):
    folder = write(tmp_path / "class", ["ada/a.py", "emmy/a.py"])
    (folder / "ada/work.zip").write_bytes(data)
    (ada, _), _, _ = find_submissions(folder)
    files, unread = read(ada)
    assert list(files) == ["a.py"]
    assert len(unread) == 1
    assert unread[0].startswith("work.zip cannot be read: ")


def test_a_hand_in_without_code_is_told_by_its_files(read, tmp_path):
    ada = one_submission(write(tmp_path / "ada", ["report.pdf"]), "ada")
    says = "no notebook (.ipynb) or script (.py) was handed in, only report.pdf"
    assert read(ada) == ({}, [says])


def test_what_is_too_large_is_named_and_the_rest_is_read(read, tmp_path):
    folder = write(tmp_path / "class", ["ada/a.py"])
    with (folder / "ada/large.ipynb").open("wb") as file:
        file.truncate(65 << 20)
    with zipfile.ZipFile(folder / "ada/bomb.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("b.py", b" " * (65 << 20))
    for name in "edc":
        with zipfile.ZipFile(folder / f"ada/{name}.zip", "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("x.ipynb", b'{"cells": []}' + b" " * (40 << 20))
    files, unread = read(one_submission(folder, "ada"))
    assert set(files) == {"ada/a.py", *(f"ada/{name}.zip/x.ipynb" for name in "cde")}
    lost = {"ada/large.ipynb", "ada/bomb.zip/b.py"}
    assert {line.partition(" ")[0] for line in unread} == lost
    for name in ("bomb", "c", "d"):  # the grader holds no more than is read
        os.truncate(folder / f"ada/{name}.zip", 40 << 20)
    found, unread = read_files(list_files(folder / "ada"))
    assert (len(found), len(unread)) == (4, 2)


@pytest.mark.parametrize(
    ("name", "message"),
    [("missing", "cannot be read: No such file"), ("text.txt", "is no folder, zip archive, note"),
     ("empty", "nothing was handed in")],
)  # fmt: skip
def test_what_is_no_class_is_refused(name, message, tmp_path):
    (tmp_path / "empty").mkdir()
    write(tmp_path, ["text.txt"])
    with pytest.raises(LabkitError, match=message):
        find_submissions(tmp_path / name)
