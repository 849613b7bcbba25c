import os
from pathlib import Path

import pytest

from labkit.support.errors import WriteError
from labkit.support.files import atomic_write, refuse_unwritable


def test_text_and_bytes(tmp_path):
    with atomic_write(tmp_path / "note.txt") as file:
        file.write("größer\n")
    assert (tmp_path / "note.txt").read_bytes() == "größer\n".encode()
    with atomic_write(str(tmp_path / "note.txt"), "wb") as file:
        file.write(b"\0")
    assert (tmp_path / "note.txt").read_bytes() == b"\0"
    assert os.listdir(tmp_path) == ["note.txt"]


def write_half(path, interruption=KeyboardInterrupt):
    with atomic_write(path) as file:
        file.write("half")
        raise interruption


@pytest.mark.parametrize("interruption", [KeyboardInterrupt, ValueError])
@pytest.mark.parametrize("before", [None, "as it was"])
def test_an_interruption_leaves_things_as_they_were(tmp_path, interruption, before):
    path = tmp_path / "note.txt"
    if before is not None:
        path.write_text(before)
    with pytest.raises(interruption):
        write_half(path, interruption)
    assert os.listdir(tmp_path) == ([] if before is None else ["note.txt"])
    assert before is None or path.read_text() == before


def test_a_full_disk_is_a_write_error(tmp_path):
    path = tmp_path / "note.txt"
    with (
        pytest.raises(WriteError, match=r"cannot write .*note\.txt: No space left on device"),
        atomic_write(path),
    ):
        raise OSError(28, "No space left on device")
    assert os.listdir(tmp_path) == []


def test_paths_that_cannot_be_written(tmp_path):
    (tmp_path / "file").touch()
    places = {
        tmp_path: "it is a directory; name a file in it",
        tmp_path / "gone" / "out": f"the directory {tmp_path / 'gone'} does not exist; make it",
        tmp_path / "file" / "out": "file does not exist; make it first",
        tmp_path / (300 * "b"): "its name is too long; choose a shorter one",
        Path(os.devnull): "it is a device or a pipe; name a file",
    }
    for path, reason in places.items():
        with pytest.raises(WriteError) as raised, atomic_write(path):
            pytest.fail("the block must not run")
        assert str(raised.value).startswith(f"cannot write {path}: ")
        assert reason in str(raised.value)
        with pytest.raises(WriteError) as refused:
            refuse_unwritable(path)
        assert str(refused.value) == str(raised.value)


@pytest.mark.parametrize("check", [refuse_unwritable, write_half])
@pytest.mark.parametrize("before", [None, "mine"])
def test_what_is_write_protected_is_not_written(tmp_path, monkeypatch, check, before):
    """The file or its folder, where a new one and a file to be replaced are made."""
    path = tmp_path / "note.txt"
    if before is not None:
        path.write_text(before)
        monkeypatch.setattr(os, "access", lambda place, mode: place != path)
        with pytest.raises(WriteError, match=r"note\.txt: it is write-protected"):
            check(path)
    monkeypatch.setattr(os, "access", lambda place, mode: place != tmp_path)
    with pytest.raises(WriteError, match=rf"note\.txt: the directory .*{tmp_path.name} may not be"):
        check(path)
    assert [file.read_text() for file in tmp_path.iterdir()] == [before] * (before is not None)


def test_links_are_followed_and_permissions_kept(tmp_path):
    target, link = tmp_path / "target", tmp_path / "link"
    target.touch()
    target.chmod(0o640)
    link.symlink_to(target)
    with atomic_write(link) as file:
        file.write("through")
    assert link.is_symlink()
    assert target.read_text() == "through"
    assert target.stat().st_mode & 0o777 == 0o640
