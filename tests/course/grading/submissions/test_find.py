"""Whose a file is, however the class was downloaded, and that reading it stays within bounds."""

import io
import os
import zipfile
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from labkit import se2
from labkit.course.grading.submissions import find_submissions, one_submission
from labkit.course.grading.submissions import submission as submission_module
from labkit.errors import LabkitError

SOURCE = b"def f(): return 1\n"
CLASSES = {
    "a folder for each student": {
        "ada/answers.ipynb": ("ada", "answers.ipynb"),
        "ada/week 3/mine.py": ("ada", "week 3/mine.py"),
        "emmy/answers.ipynb": ("emmy", "answers.ipynb"),
    },
    "a file for each student": {
        "ada.ipynb": ("ada", "ada.ipynb"),
        "emmy.py": ("emmy", "emmy.py"),
    },
    "Canvas": {
        "lovelaceada_4711_98765_answers.ipynb": ("4711", "answers.ipynb"),
        "lovelaceada_4711_98766_mine.py": ("4711", "mine.py"),
        "noetheremmy_LATE_815_98767_my_answers.ipynb": ("815", "my_answers.ipynb"),
    },
    "Moodle": {
        "Ada Lovelace_4711_assignsubmission_file_/answers.ipynb": ("4711", "answers.ipynb"),
        "Emmy Noether_815_assignsubmission_file/a.py": ("815", "a.py"),
    },
    "Moodle without folders": {
        "Ada Lovelace_4711_assignsubmission_file_my answers.ipynb": ("4711", "my answers.ipynb"),
        "Ada Lovelace_4711_assignsubmission_file_mine.py": ("4711", "mine.py"),
        "Emmy Noether_815_assignsubmission_file_a.py": ("815", "a.py"),
    },
    "Blackboard": {
        "Lab 1_ada_attempt_2026-11-21-23-55-10_answers.ipynb": ("ada", "answers.ipynb"),
        "Lab 1_emmy_attempt_2026-11-21-23-55-11_mine.py": ("emmy", "mine.py"),
    },
    "D2L": {
        "1234-567 - Ada Lovelace - Nov 21, 2026 1155 PM/answers.ipynb": ("1234", "answers.ipynb"),
        "1235-567 - Emmy - Nov 21, 2026 905 AM/lib/mine.py": ("1235", "lib/mine.py"),
    },
    "nbgrader": {
        "submitted/ada/lab1/answers.ipynb": ("ada", "lab1/answers.ipynb"),
        "submitted/emmy/lab1/answers.ipynb": ("emmy", "lab1/answers.ipynb"),
    },
}
LEFT_BEHIND = [
    "README.txt",
    ".DS_Store",
    "Thumbs.db",
    "__MACOSX/ada/._answers.ipynb",
    "ada/.ipynb_checkpoints/answers.ipynb",
]


def lay_out(folder, names):
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(SOURCE)
    return folder


def pack(path, names, data=SOURCE):
    with zipfile.ZipFile(path, "w") as archive:
        for name in names:
            archive.writestr(name, data)
    return path


def whose(submissions):
    return {(one.student, file) for one in submissions for file in one.read()[0]}


@pytest.mark.parametrize("layout", CLASSES)
@pytest.mark.parametrize("packed", [False, True])
def test_every_layout_in_a_folder_and_in_an_archive(tmp_path, layout, packed):
    expected = CLASSES[layout]
    names = [*expected, *(LEFT_BEHIND if layout != "nbgrader" else [])]
    path = pack(tmp_path / "class.zip", names) if packed else lay_out(tmp_path, names)
    found = find_submissions(path)
    assert [one.student for one in found] == sorted({student for student, _ in expected.values()})
    assert whose(found) == set(expected.values())


WRAPPED = {
    "folders": ["lab 1/ada/a.py", "lab 1/emmy/a.py"],
    "folders beside what can hold no answer": [
        "desktop.ini",
        "notes.pdf",
        "lab 1/ada/a.ipynb",
        "lab 1/emmy/a.ipynb",
        "lab 1/Thumbs.db",
        "lab 1/readme.txt",
        "lab 1/helpers.py",
    ],
    "notebooks": ["lab 1/ada.ipynb", "lab 1/emmy.ipynb", "lab 1/readme.txt"],
    "scripts": ["lab 1/ada.py", "lab 1/emmy.py"],
    "archives": ["lab 1/ada.zip", "lab 1/emmy.zip"],
    "Canvas": ["class/ada_1_10_a.ipynb", "class/emmy_2_11_a.ipynb", "class/kurt_3_text.html"],
    "Moodle": ["class/Ada_1_assignsubmission_file_/a.py"],
    "Moodle without folders": ["class/Ada_1_assignsubmission_file_a.py"],
    "nbgrader": ["submitted/ada/lab 1/a.ipynb", "submitted/ada/lab 2/a.ipynb"],
}
STUDENTS = {
    "folders beside what can hold no answer": ["ada", "emmy", "helpers"],
    "Canvas": ["1", "2"],
    "Moodle": ["1"],
    "Moodle without folders": ["1"],
    "nbgrader": ["ada"],
}


@pytest.mark.parametrize("layout", WRAPPED)
def test_an_archive_with_one_folder_around_the_class(tmp_path, layout):
    found = find_submissions(pack(tmp_path / "class.zip", WRAPPED[layout]))
    assert [one.student for one in found] == STUDENTS.get(layout, ["ada", "emmy"])


@pytest.mark.parametrize("layout", sorted(WRAPPED.keys() - {"notebooks", "scripts", "archives"}))
def test_a_folder_with_one_folder_around_the_class(tmp_path, layout):
    found = find_submissions(lay_out(tmp_path, WRAPPED[layout]))
    assert [one.student for one in found] == STUDENTS.get(layout, ["ada", "emmy"])


def test_archives_in_an_archive_are_the_students(tmp_path):
    inner = packed([("answers.ipynb", SOURCE)])
    found = find_submissions(pack(tmp_path / "class.zip", WRAPPED["archives"], inner))
    assert whose(found) == {(name, f"{name}.zip/answers.ipynb") for name in ("ada", "emmy")}


@pytest.mark.parametrize(
    "names",
    [
        ["ada/a.py"],
        ["ada/hw/answers.ipynb"],
        ["ada/hw/answers.ipynb", "ada/figures/1.png", "ada/lib/mine.py"],
        ["ada/answers.ipynb", "ada/mine.py"],
        ["ada/answers.ipynb", "ada/work.zip"],
        ["ada/answers.ipynb", "ada/old/answers.ipynb"],
    ],
)
@pytest.mark.parametrize("is_packed", [False, True])
def test_one_student_alone_keeps_the_name(tmp_path, names, is_packed):
    path = pack(tmp_path / "c.zip", names) if is_packed else lay_out(tmp_path / "c", names)
    assert [one.student for one in find_submissions(path)] == ["ada"]


def test_one_file_goes_by_its_name(tmp_path):
    assert find_submissions(lay_out(tmp_path, ["x/a.py"]) / "x/a.py")[0].student == "a"


def test_a_folder_of_one_students_parts_is_no_class(tmp_path):
    """It may be one all the same, so the instructor is told."""
    remarks = []
    names = ["ada l/part-1.ipynb", "ada l/part-2.ipynb", "ada l/mine.py"]
    (ada,) = find_submissions(lay_out(tmp_path / "class", names), remarks)
    assert set(ada.read()[0]) == {"part-1.ipynb", "part-2.ipynb", "mine.py"}
    (remark,) = remarks
    assert "part-1.ipynb and 1 more are taken for the work of one student, 'ada l'" in remark
    assert remark.endswith("if not, --student 'ada l' says so")
    find_submissions(lay_out(tmp_path / "two", ["ada/a.ipynb", "ada/mine.py"]), remarks)
    find_submissions(lay_out(tmp_path / "two", ["emmy/a.ipynb", "emmy/b.ipynb"]), remarks)
    assert len(remarks) == 1


@pytest.mark.parametrize(
    ("older", "newer"),
    [
        (
            "Lab_ada_attempt_2026-11-21-23-55-10_old.py",
            "Lab_ada_attempt_2026-11-22-00-01-00_new.py",
        ),
        (
            "7-567 - Ada L - Nov 21, 2026 1155 AM/old.py",
            "7-567 - Ada L - Nov 21, 2026 105 PM/new.py",
        ),
        ("7-5 - Ada - Nov 30, 2026 1155 PM/old.py", "7-5 - Ada - Dec 1, 2026 1201 AM/new.py"),
    ],
)
def test_of_two_attempts_the_newer_one_counts(tmp_path, older, newer):
    found = find_submissions(pack(tmp_path / "class.zip", [newer, older]))
    assert [file for _, file in whose(found)] == ["new.py"]
    assert found[0].read().unread == ("it was handed in 2 times; the newest attempt counts",)


def test_no_name_takes_another_participants_number(tmp_path):
    forged = "Eve_4712_assignsubmission_file__4711_assignsubmission_file_"
    upload = "Eve_4711_assignsubmission_file_x_4712_assignsubmission_file_a.py"
    honest = "Ada_4712_assignsubmission_file_/a.py"
    found = find_submissions(lay_out(tmp_path, [f"{forged}/a.py", upload, honest]))
    assert [one.student for one in found if one.platform] == ["4712"]
    assert [file.name for one in found if one.platform for _, file in one.files] == [honest]
    assert {one.student for one in found} == {"4712", forged, upload.removesuffix(".py")}


def test_of_nbgraders_course_what_was_submitted_is_graded(tmp_path):
    lay_out(tmp_path, ["source/lab1/a.ipynb", "release/lab1/a.ipynb", "nbgrader_config.py"])
    lay_out(tmp_path, [f"submitted/{who}/{lab}/a.py" for who in "xy" for lab in ("l1", "l2")])
    lay_out(tmp_path, ["submitted/z/l2/a.py"])
    remarks = []
    assert {one.student for one in find_submissions(tmp_path, remarks)} == set("xyz")
    assert remarks[0].endswith("submitted: this is graded, of nbgrader's course folder")
    assert remarks[1].endswith(
        "l1, l2, which are taken for one; grade one of them with --within l1"
    )
    found = find_submissions(tmp_path, within="l1")
    assert whose(found) == {("x", "a.py"), ("y", "a.py")}
    assert [one.student for one in found] == ["x", "y", "z"]
    with pytest.raises(LabkitError, match="no student has a folder 'l3' to look into; found"):
        find_submissions(tmp_path, within="l3")


def test_nbgraders_folder_holds_students_by_definition(tmp_path):
    names = ["submitted/ada/lab1/a.ipynb", "submitted/ada/lab2/a.ipynb"]
    lay_out(tmp_path, names)
    for path in (tmp_path, tmp_path / "submitted"):
        assert whose(find_submissions(path)) == {("ada", "lab1/a.ipynb"), ("ada", "lab2/a.ipynb")}


def test_a_folder_around_the_class_may_have_any_name(tmp_path):
    odd = tmp_path / os.fsdecode(b"cl\xff")
    lay_out(odd, ["ada/a.py", "emmy/a.py"])
    (odd / "kurt").mkdir()
    assert [one.student for one in find_submissions(tmp_path)] == ["ada", "emmy", "kurt"]


OUTPUTS = ["verdicts.jsonl", "scores.csv", "index.html", "students/ada.html"]


@pytest.mark.parametrize("wrapped", ["", "class/"])
def test_verdicts_are_no_student(tmp_path, wrapped):
    lay_out(tmp_path, [f"{wrapped}ada/a.py", f"{wrapped}emmy/a.py"])
    lay_out(tmp_path / "grades", [*OUTPUTS, "autograder.zip"])
    lay_out(tmp_path / wrapped / "older", OUTPUTS)
    remarks = []
    found = find_submissions(tmp_path, remarks, out=tmp_path / "grades")
    assert [one.student for one in found] == ["ada", "emmy"]
    assert remarks == [f"{tmp_path}: {wrapped}older/ is left out: an earlier run wrote it"]


def test_a_place_for_verdicts_is_no_student_before_there_are_any(tmp_path):
    lay_out(tmp_path, ["ada/a.py", "emmy/a.py"])
    (tmp_path / "results/grades").mkdir(parents=True)
    found = find_submissions(tmp_path, out=tmp_path / "results/grades")
    assert [one.student for one in found] == ["ada", "emmy"]


def test_verdicts_right_beside_the_students_files(tmp_path):
    lay_out(tmp_path, ["ada/a.py", "emmy/a.py", *OUTPUTS])
    found = find_submissions(tmp_path, out=tmp_path)
    assert [one.student for one in found] == ["ada", "emmy"]


def test_no_students_work_is_taken_for_verdicts(tmp_path):
    lay_out(tmp_path, ["ada/a.py", "ada/verdicts.jsonl", "emmy/a.py", "kurt.py"])
    remarks = []
    found = find_submissions(tmp_path, remarks, out=tmp_path / "emmy")
    assert [one.student for one in found] == ["ada", "kurt"]
    (remark,) = remarks
    assert remark.startswith(f"{tmp_path}: emmy/a.py is not graded, since verdicts go to emmy/;")


def test_names_late_marks_and_platforms_are_kept(tmp_path):
    ada, emmy = find_submissions(lay_out(tmp_path, CLASSES["Canvas"]))
    assert (ada.name, ada.platform, ada.late) == ("lovelaceada", "canvas", False)
    assert (emmy.name, emmy.platform, emmy.late) == ("noetheremmy", "canvas", True)


def test_of_two_uploads_the_newer_one_counts(tmp_path):
    for upload, copy in enumerate(("", "-1", "-10", "-2"), start=98765):
        name = f"lovelaceada_4711_{upload}_answers{copy}.py"
        (tmp_path / name).write_bytes(f"copy = '{copy}'".encode())
    (ada,) = find_submissions(tmp_path)
    note = "answers.py was uploaded 4 times; the newest counts, answers-2.py"
    assert ada.read() == ({"answers.py": b"copy = '-2'"}, (note,))


@pytest.mark.parametrize(
    "names",
    [
        ["2024_1_2_ada.ipynb", "2024_1_2_emmy.ipynb"],  # a number of two uploads
        ["a_1_2_ada.ipynb", "b_1_3_emmy.ipynb"],  # a number of two users
        ["lab_1_2_ada.ipynb", "lab_1_3_bob.ipynb", "lab_2_3_emmy.ipynb"],
    ],
)
def test_names_that_only_look_like_canvas_go_by_file(tmp_path, names):
    remarks = []
    found = find_submissions(lay_out(tmp_path, names), remarks)
    assert whose(found) == {(name.removesuffix(".ipynb"), name) for name in names}
    assert "have a number in common that Canvas gives once" in remarks[0]
    find_submissions(lay_out(tmp_path / "canvas", CLASSES["Canvas"]), remarks)
    assert len(remarks) == 1


def test_two_parts_are_no_two_uploads(tmp_path):
    """Nor is a lone number one of the student's: a helper is imported by its plain name."""
    names = ["LATE_4711_98770_part-1.py", "LATE_4711_98771_part-2.py", "4711_98772_helper-1.py"]
    lay_out(tmp_path, [f"lovelaceada_{name}" for name in names])
    (ada,) = find_submissions(tmp_path)
    files, notes = ada.read()
    assert list(files) == ["part-1.py", "part-2.py", "helper.py"]
    assert notes == ()


@pytest.mark.parametrize(
    ("names", "files"),
    [
        (["x.ipynb", "x/x.ipynb"], ["x.ipynb", "x/x.ipynb"]),
        (["x.ipynb", "x.py", "x.zip"], ["x.ipynb", "x.py", "x.zip/a.py"]),
        (
            ["A_1_assignsubmission_file_/a.py", "A_1_assignsubmission_onlinetext_/a.py"],
            ["A_1_assignsubmission_file_/a.py", "A_1_assignsubmission_onlinetext_/a.py"],
        ),
    ],
)
def test_two_files_of_one_name_are_both_read(tmp_path, names, files):
    lay_out(tmp_path, names)
    if "x.zip" in names:
        pack(tmp_path / "x.zip", ["a.py"])
    (one,) = find_submissions(tmp_path)
    assert one.read() == (dict.fromkeys(files, SOURCE), ())


def test_a_folder_as_one_submission(tmp_path):
    lay_out(tmp_path, ["answers.ipynb", "lib/mine.py"])
    one = one_submission(tmp_path, "ada")
    assert one.student == "ada"
    assert set(one.read()[0]) == {"answers.ipynb", "lib/mine.py"}
    assert one_submission(tmp_path / "answers.ipynb").student == "answers"


def test_an_archive_that_a_student_handed_in(tmp_path):
    inner = io.BytesIO()
    with zipfile.ZipFile(inner, "w") as archive:
        archive.writestr("answers.ipynb", SOURCE)
        archive.writestr("notes.pdf", b"x")
    (tmp_path / "lovelaceada_4711_98765_work.zip").write_bytes(inner.getvalue())
    (tmp_path / "noetheremmy_815_98766_work.zip").write_bytes(b"PK\x03\x04broken")
    ada, emmy = find_submissions(tmp_path)
    assert ada.read() == ({"work.zip/answers.ipynb": SOURCE}, ())
    files, notes = emmy.read()
    assert not files
    assert "work.zip cannot be unpacked" in notes[0]


def test_a_file_in_an_archive_takes_the_place_of_no_other(tmp_path):
    lay_out(tmp_path, ["ada/answers.ipynb"])
    for name in ("old.zip", "older.zip"):
        pack(tmp_path / "ada" / name, ["answers.ipynb"], name)
    (ada,) = find_submissions(tmp_path)
    assert ada.read() == (
        {
            "answers.ipynb": SOURCE,
            "old.zip/answers.ipynb": b"old.zip",
            "older.zip/answers.ipynb": b"older.zip",
        },
        (),
    )


def test_an_archive_too_much_is_left_out_whole(tmp_path, monkeypatch):
    lay_out(tmp_path, ["ada/a.py"])
    pack(tmp_path / "ada/b.zip", ["b.py"], b"#" * 1500)
    pack(tmp_path / "ada/c.zip", ["c.py", "d.py"], b"#" * 300)
    monkeypatch.setattr(submission_module, "MAX_TOGETHER", 3000)
    files, notes = find_submissions(tmp_path)[0].read()
    assert set(files) == {"a.py", "b.zip/b.py"}
    assert notes[0].startswith("c.zip holds too much")
    monkeypatch.setattr(submission_module, "MAX_TOGETHER", len(SOURCE))
    files, notes = find_submissions(tmp_path)[0].read()
    assert set(files) == {"a.py"}
    assert "the files are too large together; b.zip is not read" in notes


def test_nothing_to_grade_is_said(tmp_path):
    (tmp_path / "lovelaceada_4711_98765_report.pdf").write_bytes(b"%PDF")
    (one,) = find_submissions(tmp_path)
    assert one.read() == (
        {},
        ("there is no notebook (.ipynb) or script (.py) in it; found report.pdf",),
    )


def test_what_no_student_is_made_of_is_named(tmp_path):
    lay_out(tmp_path, ["ada.ipynb", "emmy.pdf", "kurt.rar", ".DS_Store", "desktop.ini"])
    remarks = []
    assert [one.student for one in find_submissions(tmp_path, remarks)] == ["ada"]
    (remark,) = remarks
    assert remark.startswith(f"{tmp_path}: passed over, as no notebook (.ipynb)")
    assert remark.endswith(": emmy.pdf, kurt.rar; convert or unpack what is a student's work")


def test_many_that_are_passed_over_are_counted(tmp_path):
    names = ["class/ada/a.py", "class/emmy/a.py", *(f"{k}.pdf" for k in range(9))]
    remarks = []
    found = find_submissions(pack(tmp_path / "class.zip", names), remarks)
    assert [one.student for one in found] == ["ada", "emmy"]
    assert ": 0.pdf, 1.pdf, 2.pdf, 3.pdf, 4.pdf, ... (9 in all); convert" in remarks[0]


def test_what_is_too_large_is_not_read(tmp_path, monkeypatch):
    monkeypatch.setattr(submission_module, "MAX_FILE", 1000)
    lay_out(tmp_path, ["ada/small.py"])
    (tmp_path / "ada/large.py").write_bytes(b"#" * 1001)
    with zipfile.ZipFile(tmp_path / "ada/bomb.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.py", b"#" * 100_000)
    files, notes = find_submissions(tmp_path)[0].read()
    assert files == {"small.py": SOURCE}
    assert "large.py has 0 MiB, at most 0 are read" in notes[0]
    assert "bomb.zip holds too much" in notes[1]


def test_links_are_not_followed(tmp_path):
    secret = tmp_path / "secret.py"
    secret.write_bytes(b"answers = 42")
    lay_out(tmp_path / "class", ["ada/mine.py"])
    os.symlink(secret, tmp_path / "class/ada/theirs.py")
    os.symlink(tmp_path, tmp_path / "class/ada/all")
    assert whose(find_submissions(tmp_path / "class")) == {("ada", "mine.py")}


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("wrapped", ["", "submitted/"])
def test_a_student_whose_folder_holds_nothing_is_in_the_class(tmp_path, packed, wrapped):
    moodle = "Ada Lovelace_4711_assignsubmission_file_"
    folders = ["emmy", moodle, "__MACOSX", ".git"]
    if packed:
        path = pack(tmp_path / "class.zip", [f"{wrapped}kurt/a.py"])
        with zipfile.ZipFile(path, "a") as archive:
            for folder in (wrapped, *(f"{wrapped}{each}/" for each in folders)):
                if folder:
                    archive.writestr(zipfile.ZipInfo(folder), b"")
    else:
        path = lay_out(tmp_path / "class", [f"{wrapped}kurt/a.py"])
        for folder in folders:
            (path / wrapped / folder).mkdir()
        os.symlink(tmp_path, path / wrapped / "emmy" / "all")
        os.symlink(tmp_path, path / wrapped / "linked")
    found = find_submissions(path)
    linked = [] if packed else ["linked"]
    assert [one.student for one in found] == ["4711", "emmy", "kurt", *linked]
    nothing = "there is no notebook (.ipynb) or script (.py) in it; found nothing"
    for one in found:
        if one.student != "kurt":
            assert one.read() == ({}, (f"{nothing}, and links are not followed",))
    assert found[0].platform == "moodle"


def test_names_that_are_no_text_can_be_printed(tmp_path):
    (tmp_path / os.fsdecode(b"ad\xff\n.py")).write_bytes(SOURCE)
    (one,) = find_submissions(tmp_path)
    assert one.student.isprintable()
    assert one.student.encode()
    assert one.read()[1] == ()


def test_two_names_that_are_no_text_are_two_students(tmp_path):
    names = [b"ad\xff", b"ad\xfe", "ad\u202e".encode(), "ad\u202d".encode(), "ad\ufffd".encode()]
    for name in names:
        (tmp_path / os.fsdecode(name)).mkdir()
        (tmp_path / os.fsdecode(name) / "a.py").write_bytes(SOURCE)
    found = find_submissions(tmp_path)
    assert len({one.student for one in found}) == len(names)
    assert all(one.student.isprintable() for one in found)


def test_what_cannot_be_read_is_named(tmp_path):
    with pytest.raises(LabkitError, match="no such file or folder"):
        find_submissions(tmp_path / "missing")
    with pytest.raises(LabkitError, match="nothing was handed in; name a notebook"):
        find_submissions(tmp_path)
    (tmp_path / "ada.pdf").write_bytes(b"%PDF")
    with pytest.raises(LabkitError, match=r"nothing was handed in; .*; found ada\.pdf$"):
        find_submissions(tmp_path)
    (tmp_path / "class.zip").write_bytes(b"not a zip")
    with pytest.raises(LabkitError, match=r"class\.zip: .* cannot be read as a zip archive"):
        find_submissions(tmp_path / "class.zip")


MOST = 4 << 20


def packed(members, how=zipfile.ZIP_DEFLATED):
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w", how) as file:
        for name, data in members:
            file.writestr(name, data)
    return archive.getvalue()


@pytest.mark.parametrize("how", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_a_packing_that_cannot_be_bounded_is_refused(how):
    """A thousand bytes of bzip2 unpack to a gigabyte, and all at once."""
    with pytest.raises(LabkitError, match="packed in a rare way"):
        submission_module.unzip("bomb.zip", packed([("a.py", bytes(1 << 20))], how), MOST)


def test_an_archive_of_thousands_of_scripts_is_refused():
    with pytest.raises(LabkitError, match=r"^many\.zip holds 3000 notebooks and scripts"):
        submission_module.unzip("many.zip", packed([(f"{i}.py", b"") for i in range(3000)]), MOST)


def test_an_archive_in_an_archive_is_read_and_one_below_is_not():
    below = packed([("c.py", SOURCE), ("d.zip", packed([("e.py", SOURCE)]))])
    data = packed([("b.zip", below), ("f.py", b"")])
    found, left = submission_module.unzip("a.zip", data, MOST)
    assert found == {"f.py": b"", "b.zip/c.py": SOURCE}
    assert MOST - 5000 < left < MOST - len(below) - len(SOURCE)
    many = packed([(f"{k}.zip", packed([(f"{i}.py", b"") for i in range(90)])) for k in range(30)])
    for data, why in (
        (many, r"^a\.zip holds 20\d\d notebooks"),
        (packed([("b.zip", packed([("c.py", bytes(MOST))]))]), r"^a\.zip/b\.zip holds too much"),
        (
            packed([("b.zip", packed([(f"{i}", b"") for i in range(8000)]))]),
            r"^a\.zip/b\.zip holds too",
        ),
        (packed([(f"{i}", b"") for i in range(8000)]), r"^a\.zip holds too much: 32 MiB"),
    ):
        with pytest.raises(LabkitError, match=why):
            submission_module.unzip("a.zip", data, MOST)


@settings(max_examples=400)
@given(st.lists(st.tuples(st.integers(0, 10_000), st.integers(0, 255)), min_size=1, max_size=6))
def test_a_damaged_archive_is_named_whatever_is_wrong_with_it(changes):
    data = bytearray(packed([("answers-ü.py", SOURCE * 9), ("b/c.ipynb", bytes(range(256)))]))
    for place, value in changes:
        data[place % len(data)] = value
    with suppress(LabkitError):
        submission_module.unzip("damaged.zip", bytes(data), MOST)


def test_a_whole_repository_is_read_from_its_answers_on(tmp_path):
    """More files than are read: those that define what is asked come first, labkit's never."""
    lab = tmp_path / "ada"
    names = [f"book/_static/{k}.css" for k in range(300)] + [f"book/{k}.py" for k in range(250)]
    lay_out(lab, [*names, "tools/mine.py", "notebooks/assignment.ipynb"])
    (lab / "labkit").mkdir()
    for place in ("labkit/se2.py", "copy.py"):
        (lab / place).write_bytes(Path(se2.__file__).read_bytes())
    (lab / "labkit/icp.py").write_text("def icp(): return 'changed by hand'", "utf-8")
    (lab / "notebooks/assignment.ipynb").write_text('"def double(x):", "def negate(x):"', "utf-8")
    (lab / "tools/mine.py").write_text("def double(x): return 2 * x", "utf-8")
    files, unread = one_submission(lab).read({"double", "negate"})
    assert list(files)[:2] == ["notebooks/assignment.ipynb", "tools/mine.py"]
    assert not any(name.startswith("labkit") or name == "copy.py" for name in files)
    assert len(files) == 200
    assert unread == (
        "252 notebooks and scripts were handed in, 200 are read; book/52.py is the first that is "
        "not",
    )


def test_nothing_but_what_was_handed_out_is_said(tmp_path):
    (tmp_path / "ada").mkdir()
    (tmp_path / "ada/se2.py").write_bytes(Path(se2.__file__).read_bytes().replace(b"\n", b"\r\n"))
    files, (note,) = one_submission(tmp_path / "ada").read()
    assert not files
    assert note.startswith("there is nothing in it but what was handed out")
