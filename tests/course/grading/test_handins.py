"""Who handed in what: no name that a student chooses moves a file to another student."""

import base64
import io
import os
import zipfile
from pathlib import Path

import pytest

from labkit.course.grading.files import list_files, read_files
from labkit.course.grading.handins import find_submissions, one_submission
from labkit.support.errors import LabkitError

CLASSES = {
    "canvas": [
        "lovelaceada_4711_98765_answers.ipynb",
        "noetheremmy_LATE_4712_98766_x.py",
        "noetheremmy_LATE_4712_98767_x-1.py",
    ],
    "moodle": [
        "Ada Lovelace_4711_assignsubmission_file_/answers.ipynb",
        "Emmy Noether_4712_assignsubmission_file_a_1_assignsubmission_file_b.py",
    ],
    "gradescope": ["assignment_7_export/submission_4711/a.ipynb", "submission_4712/a/b.py"],
    "folders": ["4711/a.ipynb", "4712.py"],
}


def write(folder, names, text=b"k = 1\n"):
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(text)
    return folder


def pack(path, names):
    with zipfile.ZipFile(path, "w") as archive:
        for name in names:
            archive.writestr(name, "k = 1\n")
    return path


@pytest.mark.parametrize("platform", CLASSES)
def test_each_platform_is_known_by_its_names(platform, tmp_path):
    names = CLASSES[platform]
    for place in (write(tmp_path / "class", names), pack(tmp_path / "class.zip", names)):
        found, remarks = find_submissions(place)
        assert [one.student for one in found] == ["4711", "4712"]
        assert not remarks


def test_what_a_student_calls_a_file_chooses_nothing(tmp_path):
    """Names that once replaced another's submission, or shed the mark for being late."""
    names = [
        "victim_4712_98765_answers.ipynb",
        "mallorym_4711_98768_x_4712_attempt_2099-01-01-00-00-00_answers.ipynb",
        "mallorym_4711_98769_Victim_4712_assignsubmission_file_answers.ipynb",
        "mallorym_LATE_4711_98770_x_4711_attempt_2026-01-01-00-00-00_answers.ipynb",
        "mallorym_4711_98771_victim_4712_98799_answers.ipynb",
    ]
    (mallory, victim), _ = find_submissions(write(tmp_path / "canvas", names))
    assert (mallory.student, len(mallory.files), mallory.late) == ("4711", 4, 1.0)
    assert (victim.student, len(victim.files), victim.late) == ("4712", 1, 0.0)
    assert mallory.feedback_name == "mallorym_4711_98771_feedback.html"
    names = ["Mallory M_4711_assignsubmission_file_Ada L_4712_assignsubmission_file_/a.ipynb"]
    (mallory,), _ = find_submissions(write(tmp_path / "moodle", names))
    assert mallory.student == "4711"
    assert mallory.feedback_name == "Mallory M_4711_assignsubmission_file_/feedback.html"


def test_of_two_uploads_with_one_name_the_newest_counts(read, tmp_path):
    folder = write(tmp_path / "class", ["ada_LATE_1_12_a.py", "emmy_2_13_a.py"], b"new = 1\n")
    write(folder, ["ada_1_9_a.py"], b"old = 1\n")
    found, _ = find_submissions(folder)
    assert read(found[0])[0] == {"a.py": "new = 1\n"}
    assert [one.late for one in found] == [1.0, 0.0]


def test_a_class_of_two_layouts_is_refused_with_the_way_out(tmp_path):
    folder = write(tmp_path / "class", ["ada_4711_98765_a.py", "emmy.py"])
    with pytest.raises(LabkitError, match=r"emmy\.py is not; use --layout canvas or --layout fold"):
        find_submissions(folder)
    found, remarks = find_submissions(folder, layout="canvas")
    assert [one.student for one in found] == ["4711"]
    assert remarks == [f"{folder}: emmy.py belongs to no student; skipped"]
    found, _ = find_submissions(folder, layout="folders")
    assert [one.student for one in found] == ["ada_4711_98765_a", "emmy"]
    with pytest.raises(
        LabkitError, match=r"no file name fits the moodle layout \(for example ada_4711_98765_a\.py"
    ):
        find_submissions(folder, layout="moodle")


def test_one_folder_around_all_is_not_taken_for_a_student(tmp_path):
    write(tmp_path / "class", ["lab 1/ada/a.py", "lab 1/emmy/a.py"])
    with pytest.raises(
        LabkitError, match=r"all files are in one folder, lab 1\. .*--student lab 1"
    ):
        find_submissions(tmp_path / "class")
    assert len(find_submissions(tmp_path / "class/lab 1")[0]) == 2


def test_marks_and_leftovers_are_nobodys_work(tmp_path):
    folder = write(tmp_path, ["ada.py", "grades/code/ada.py", ".git/a.py", "emmy/__pycache__/x.py"])
    write(folder, ["notes.txt"])
    (folder / "link.py").symlink_to(folder / "ada.py")
    found, remarks = find_submissions(folder, out=folder / "grades")
    assert [one.student for one in found] == ["ada"]
    assert remarks == [f"{folder}: notes.txt belongs to no student; skipped"]


ZIP64 = base64.b64decode(  # a file that claims to lie beyond 2⁶³
    "UEsDBBQAAAAAAMg6d10kTBtgBQAAAAUAAAAEAAAAYS5weWsgPSAxUEsBAhQDFAAAAAAAyDp3XSRMG2AFAAAABQAAAAQA"
    "DAAAAAAAAAAAAIAB/////2EucHkBAAgA/v////////9QSwUGAAAAAAEAAQA+AAAAJwAAAAAA"
)


def packed(count):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for number in range(count):
            archive.writestr(f"{number}.py", "k = 1")
    return buffer.getvalue()


@pytest.mark.parametrize(
    "data", [b"", b"PK\x03\x04", ZIP64, packed(1) + b"PK\1\2" * 90_000]
)
def test_a_damaged_archive_costs_itself_alone(data, read, tmp_path):
    folder = write(tmp_path / "class", ["ada/a.py", "emmy/a.py"])
    (folder / "ada/work.zip").write_bytes(data)
    (ada, _), _ = find_submissions(folder)
    files, unread = read(ada)
    assert list(files) == ["a.py"]
    assert len(unread) == 1
    assert unread[0].startswith("work.zip cannot be read: ")


def test_what_is_too_large_is_named_and_the_rest_is_read(read, tmp_path):
    folder = write(tmp_path / "class", ["ada/a.py"])
    with (folder / "ada/large.ipynb").open("wb") as file:
        file.truncate(33 << 20)
    with zipfile.ZipFile(folder / "ada/bomb.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("b.py", b" " * (64 << 20))
    for name in "edc":  # the oldest one is too much for all together
        with zipfile.ZipFile(folder / f"ada/{name}.zip", "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("x.ipynb", b'{"cells": []}' + b" " * (20 << 20))
        os.utime(folder / f"ada/{name}.zip", (ord("z") - ord(name),) * 2)
    files, unread = read(one_submission(folder, "ada"))
    assert set(files) == {"ada/a.py", "ada/c.zip/x.ipynb", "ada/d.zip/x.ipynb"}
    lost = {"ada/large.ipynb", "ada/bomb.zip", "ada/e.zip"}
    assert {line.partition(" ")[0] for line in unread} == lost


def test_the_grader_holds_no_more_than_is_read(tmp_path):
    for path in write(tmp_path / "ada", ["a.py", "b.py", "c.py"]).iterdir():
        os.truncate(path, 20 << 20)
    found, unread = read_files(list_files(tmp_path / "ada"))
    assert (len(found), len(unread)) == (2, 1)


def test_names_of_any_bytes_are_printable(read, tmp_path):
    odd = os.fsencode(tmp_path) + b"/\xff\x1b[2J.py"
    try:
        Path(os.fsdecode(odd)).write_bytes(b"k = 1")
    except OSError:
        pytest.skip("this file system takes no such name")
    (found,), _ = find_submissions(tmp_path)
    assert found.student.isprintable()
    assert read(found)[0]


@pytest.mark.parametrize(
    ("name", "message"),
    [("missing", "cannot be read: No such file"), ("text.txt", "is no folder and no zip archive"),
     ("ada.py", "say whose it is: --student NAME"), ("empty", "nothing was handed in")],
)  # fmt: skip
def test_what_is_no_class_is_refused(name, message, tmp_path):
    (tmp_path / "empty").mkdir()
    write(tmp_path, ["text.txt", "ada.py"])
    with pytest.raises(LabkitError, match=message):
        find_submissions(tmp_path / name)
