"""Any file: its packing, its format, its bounds."""

import gzip
import io
import sys
import tarfile
import zipfile

import pytest

from labkit.logs import lines, read_log
from labkit.support.errors import LogError
from labkit.support.extras import MissingExtraError


def zipped(members, method=zipfile.ZIP_DEFLATED):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", method) as archive:
        for name, text in members.items():
            archive.writestr(name, text)
    return buffer.getvalue()


def tarred(content):
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w") as archive:
        member = tarfile.TarInfo("run.csv")
        member.size = len(content)
        archive.addfile(member, io.BytesIO(content))
    return buffer.getvalue()


PACKINGS = {
    "plain": lambda text: text.encode(),
    "bom": lambda text: b"\xef\xbb\xbf" + text.encode(),
    "windows": lambda text: text.replace("\n", "\r\n").encode(),
    "gzip": lambda text: gzip.compress(text.encode()) + 100 * b"\0",
    "two gzip members": lambda text: (
        gzip.compress(text[:100].encode()) + gzip.compress(text[100:].encode())
    ),
    "zip": lambda text: zipped({"run.log": text}),
    "stored zip": lambda text: zipped({"run.log": text}, zipfile.ZIP_STORED),
    "zip from a Mac": lambda text: zipped({"a/": "", "__MACOSX/._run": "x", "a/run.log": text}),
}


@pytest.mark.parametrize("packing", PACKINGS)
def test_packing_and_format_are_told_from_the_content(save, run, packing):
    log = read_log(save(PACKINGS[packing](run), "run.csv"), strict=True)
    assert (len(log), log.format, log.name) == (5, "carmen", "run")
    assert repr(log) == "Log(run: 5 scans, carmen, odometry)"


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("intel.log.gz", "intel"),
        ("a.b.g2o.zip", "a.b"),
        ("run.tsv", "run"),
        (".log", ".log"),
        ("run-2.1", "run-2.1"),
    ],
)
def test_the_name_of_a_run_goes_without_suffixes(save, run, name, expected):
    assert read_log(save(run, name)).name == expected


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "f: the file is empty"),
        (gzip.compress(b" \n\n", mtime=0), "f: the file is empty"),
        (
            b"\x7fELF\0\0\0",
            r"f: unknown format, the file begins with '\\x7fELF.*'; labkit",
        ),
        (b"header:\n  seq: 1\nranges: [1.0, 2.0]\n", "'header:': is it printed by `rostopic echo`"),
        (b'{"data": [1.0, 2.0, 3.0]}\n', "is it JSON. write a scan a line, each an object"),
        (b'{"ranges": [1.0, 2.0, 3.0, 4.0]}\n', "rows of 4 numbers; if they are ranges, name"),
        (
            b'[\n {\n  "ranges": [\n   3.29,\n   3.3\n  ]\n }\n]\n',
            "begins with '\\[': does a list go on",
        ),
        (b"[1.5 2.5 3.5\n 1.5 2.5 3.5 4.5\n 1.5]\n", "does a list go on in the next line"),
        (b"[[1.0, 2.0, 3.0, 4.0], [2.0, 2.0, 2.0, 2.0]]\n", "is it a list of lists"),
        (
            b"17,0,laser,-2.0,2.0,0.1,1.5,1.6\n",
            "'laser' stands among its numbers: name the columns",
        ),
        (tarred(b"1,2,3,4\n5,6,7,8\n"), "f: cannot be read: it is a tar archive; unpack it"),
        (gzip.compress(tarred(b"1,2\n")), "f: cannot be read: it is a tar archive; unpack it"),
        (b"Dear reader,\n", r"f: unknown format, .*'Dear reader,'; .*from_ranges"),
        (
            zipped({"a": "x", "b": "y"}),
            "f: cannot be read: the archive holds 2 files, expec",
        ),
        (
            b"ODOM 1 2 3 0 0 0 5.0 host 6.0\n",
            r"f: a carmen log .*; it holds ODOM \(1 lines\); labkit",
        ),
        (
            b"PARAM x\nFLASER 180\n",
            "scan; 1 damaged, the first is 2: 2 fields.*; it holds",
        ),
        (b"VERTEX_SE2 0 0 0 0\n", "a g2o log without any scan; .*, g2o with ROBOTLASER1"),
        (b"x,y\n", r"a points log without any scan; it holds x \(column\), y \(column\); labkit"),
    ],
)
def test_a_file_without_a_scan(save, content, message):
    with pytest.raises(LogError, match=message):
        read_log(save(content, "f"))


def test_a_pointer_of_git_lfs_is_no_bag(save):
    pointer = save("version https://git-lfs.github.com/spec/v1\nsize 12\n", "run.bag")
    with pytest.raises(
        LogError, match=r"run.bag: unknown format, .*, which `git lfs pull` fetches"
    ):
        read_log(pointer)


def test_paths_with_nothing_to_read(tmp_path):
    for path, problem in (
        (tmp_path / "gone.log", "No such"),
        (tmp_path, ""),
        ("a\0b", "null"),
        (300 * "a", "too long"),
    ):
        with pytest.raises(LogError, match=f"cannot be read: .*{problem}"):
            read_log(path)


@pytest.mark.parametrize("packing", ["plain", "gzip", "zip"])
def test_a_file_that_is_too_large_is_refused_with_the_way_out(save, run, packing, monkeypatch):
    path = save(PACKINGS[packing](run))
    size = len(run.encode())
    monkeypatch.setattr(lines, "MAX_BYTES", size)
    assert len(read_log(path)) == 5
    monkeypatch.setattr(lines, "MAX_BYTES", size - 1)
    with pytest.raises(LogError, match=rf"more than {size - 1} bytes, unpacked; cut it in pieces"):
        read_log(path)


@pytest.mark.parametrize(
    ("log", "module", "package", "extra"),
    [("killian", "rtbdata", "rtb-data", "killian"), ("run.bag", "rosbags", "rosbags", "ros")],
)
def test_a_missing_package_is_named_with_its_remedy(monkeypatch, log, module, package, extra):
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(
        MissingExtraError, match=rf'{package}, .* install "icp-course-lab\[{extra}\]"$'
    ):
        read_log(log)
