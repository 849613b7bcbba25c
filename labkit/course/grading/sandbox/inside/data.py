"""Plain data: what a student's function returned made into it, and its bytes on the wire.

`plain` runs in the box, on objects that may lie about themselves: exact types are taken by
their own methods' results only as bytes, and the grader rebuilds every value from those. A
frame is the same on both sides: a head of fixed size, a JSON tree, raw array bytes:

``b"LAB1" | length of the tree (u32) | length of the raw bytes (u64) | tree | raw bytes``

There is nothing to execute (no pickle) and nothing that inflates (no zip), and the reader
trusts nothing: each length is checked before anything of that length is read or made. In
the tree a list is a tuple, ``{"d": [[key, value], ...]}`` a dict, ``{"a": [dtype, shape]}``
an array, whose bytes follow in the order of the tree.
"""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Callable
from typing import Any

import numpy as np

from labkit.course.grading.sandbox.inside.imports import StandIn

MAX_NODES = 50_000
MAX_NESTING = 12
MAX_TEXT = 10_000
SEQUENCES = (tuple, list, range)

HEAD = struct.Struct("<4sIQ")
MAGIC = b"LAB1"
ADD_SCIPY = b"scipy"  # an order to the zygote, which answers when it has imported it
DTYPES = {name: np.dtype(name) for name in ("<f8", "<i8", "|b1")}
MAX_TREE = 1 << 20
MAX_REQUEST = 1 << 30  # what the grader sends is its own, and may be larger
MAX_DEPTH = 16
MAX_DIMENSIONS = 8
MAX_INTEGER = 1 << 63
PLAIN = (bool, float, type(None))

to_json = json.JSONEncoder(separators=(",", ":")).encode


class NotDataError(TypeError):
    """A value that is no data; the message says what it is and what to return instead."""


class TooMuchError(ValueError):
    """A value beyond what one question may return."""


class WireError(ValueError):
    """Bytes that are no frame, or a frame beyond its bounds."""


class TooLargeError(WireError):
    """A value that no frame can hold."""


def plain(value: Any, most: int) -> Any:
    """Turn a returned value into what `pack` can send.

    Numbers of any kind become float, int or bool; arrays float64, int64 or bool; lists
    and named tuples become tuples.

    Parameters
    ----------
    value : object
        What the student's function returned.
    most : int
        How many bytes of arrays and text it may hold.

    Raises
    ------
    NotDataError
        If it is, or holds, anything but numbers, strings, None, arrays, tuples and dicts.
    TooMuchError
        If it is larger than `most`, or too deeply nested.

    Examples
    --------
    >>> plain([np.float32(0.5), np.int8(3)], most=1000)
    (0.5, 3)
    """
    return _Plain(most).of(value, 0)


class _Plain:
    def __init__(self, most: int) -> None:
        self.left = most
        self.nodes = 0

    def spend(self, count: int) -> None:
        self.left -= count
        self.nodes += 1
        if self.left < 0 or self.nodes > MAX_NODES:
            raise TooMuchError("returned more data than an answer to this question can need")

    def of(self, value: Any, depth: int) -> Any:
        self.spend(8)
        if depth > MAX_NESTING:
            raise TooMuchError(f"returned data nested deeper than {MAX_NESTING} levels")
        if isinstance(value, np.ndarray):
            return self.array(value)
        if isinstance(value, SEQUENCES):
            self.spend(8 * len(value))
            return tuple([self.of(item, depth + 1) for item in value])
        if isinstance(value, dict):
            return {self.key(key): self.of(item, depth + 1) for key, item in value.items()}
        return self.single(value)

    def single(self, value: Any) -> Any:
        if value is None:
            return None
        conversions: tuple[tuple[Any, Callable[[Any], Any]], ...] = (
            ((bool, np.bool_), bool),
            ((int, np.integer), self.integer),
            ((float, np.floating), float),
            (str, self.text),
        )
        for kinds, convert in conversions:
            if isinstance(value, kinds):
                return convert(value)
        raise NotDataError(f"returned {described(value)}; return numbers, arrays or tuples")

    def text(self, value: str) -> str:
        if len(value) > MAX_TEXT:
            raise TooMuchError(f"returned a text of {len(value)} characters")
        self.spend(len(value))
        return str(value)

    def integer(self, value: Any) -> int:
        number = int(value)
        if not -(1 << 63) <= number < 1 << 63:
            raise TooMuchError("returned an integer of more than 64 bits")
        return number

    def key(self, key: Any) -> str:
        if not isinstance(key, str):
            raise NotDataError(
                f"returned a dict with {described(key)} as a key; its keys must be strings"
            )
        self.spend(len(key))
        return str(key)

    def array(self, value: Any) -> Any:
        array = np.asarray(value)
        self.spend(int(array.size) * 8)
        if array.ndim > 8:
            raise NotDataError(f"returned an array of {array.ndim} dimensions")
        if array.dtype.kind in "fiub":
            if array.dtype.kind == "u" and array.size and int(array.max()) >= 1 << 63:
                raise TooMuchError("returned an integer of more than 64 bits")
            kind = {"f": "<f8", "i": "<i8", "u": "<i8", "b": "|b1"}[array.dtype.kind]
            with np.errstate(all="ignore"):
                return np.array(array, dtype=kind, order="C")
        if array.dtype.kind == "c":
            raise NotDataError("returned complex numbers; return real ones (`.real`?)")
        raise NotDataError(
            f"returned an array of dtype {array.dtype}, which holds no numbers; "
            f"are its rows of different length?"
        )


def described(value: Any) -> str:
    """What a value is, with its article: "a generator", "an Ellipsis".

    Examples
    --------
    >>> described(iter(()))
    'a tuple_iterator'
    """
    if isinstance(value, StandIn):
        return f"what stands in for {value.__name__}, which does not exist while grading"
    if callable(value) and not isinstance(value, type):
        return "a function, uncalled (are its brackets missing?)"
    name = str(type(value).__name__)[:60]
    return f"{'an' if name[:1].lower() in 'aeiou' else 'a'} {name}"


def pack(value: Any, most: int = MAX_TREE) -> bytes:
    """Put plain data into a frame.

    Parameters
    ----------
    value : Value
        Numbers, strings, None, float64/int64/bool arrays, tuples and dicts of these.
    most : int
        Bytes that the tree may take: all but the arrays.

    Returns
    -------
    bytes

    Raises
    ------
    TypeError
        If `value` is, or holds, anything else.
    TooLargeError
        If the tree is longer than a reader takes.

    Examples
    --------
    >>> len(pack({"R": np.eye(2), "converged": True}))
    100
    """
    raw: list[bytes] = []
    tree = to_json(_to_tree(value, raw, 0)).encode()
    if len(tree) > most:
        raise TooLargeError(f"it takes {len(tree)} bytes besides its arrays; {most} fit")
    return b"".join((HEAD.pack(MAGIC, len(tree), sum(map(len, raw))), tree, *raw))


def from_bytes(text: bytes) -> Any:
    """Any bytes as an array that a frame takes as it is; `to_bytes` brings them back."""
    return np.frombuffer(text, dtype="|b1")


def to_bytes(array: Any) -> bytes:
    """The bytes of an array."""
    return bytes(array.tobytes())


def receive(read: Callable[[int], bytes], most: int, most_tree: int = MAX_TREE) -> tuple[Any, int]:
    """Read one frame: its value, arrays fresh and writable, and its length in bytes.

    Parameters
    ----------
    read : callable
        Gives exactly as many bytes as it is asked for.
    most, most_tree : int
        Bytes that the frame and its tree may take.

    Raises
    ------
    WireError
        If what arrives is no frame, or a longer one.
    """
    tree_length, raw_length = lengths(read(HEAD.size), most, most_tree)
    body = read(tree_length + raw_length)
    return rebuild(body, tree_length), HEAD.size + len(body)


def rebuild(body: bytes, tree_length: int) -> Any:
    """Rebuild the data from what follows the head; `WireError` where it holds none."""
    view = memoryview(body)
    try:
        tree = json.loads(str(view[:tree_length], "utf-8"))
    except (ValueError, RecursionError):
        raise WireError("the tree is no JSON") from None
    reader = _Reader(view[tree_length:])
    value = reader.value(tree, 0)
    if reader.offset != len(reader.raw):
        raise WireError(f"{len(reader.raw) - reader.offset} bytes belong to no array")
    return value


def lengths(head: bytes, most: int, most_tree: int = MAX_TREE) -> tuple[int, int]:
    """The lengths of tree and raw bytes that a head states, if they and it fit in `most`.

    Raises
    ------
    WireError
        If this is no head; `TooLargeError` if the frame would be longer than `most`.
    """
    if len(head) != HEAD.size:
        raise WireError(f"a head of {len(head)} bytes, not {HEAD.size}")
    magic, tree_length, raw_length = HEAD.unpack(head)
    if magic != MAGIC:
        raise WireError("no frame begins here")
    if tree_length > most_tree or HEAD.size + tree_length + raw_length > most:
        raise TooLargeError(f"a frame of {tree_length} + {raw_length} bytes; {most} fit")
    return tree_length, raw_length


def _to_tree(value: Any, raw: list[bytes], depth: int) -> Any:
    if depth > MAX_DEPTH:
        raise TooLargeError(f"it is nested deeper than {MAX_DEPTH} levels")
    kind = type(value)
    if kind is str or kind in PLAIN:
        return value
    if kind is int:
        if -MAX_INTEGER <= value < MAX_INTEGER:
            return value
        raise TooLargeError("an integer needs more than 64 bits")
    if kind is tuple:
        return [_to_tree(item, raw, depth + 1) for item in value]
    if kind is dict:
        if not set(map(type, value)) <= {str}:
            raise TypeError("a key of a dict is no string")
        return {"d": [[key, _to_tree(item, raw, depth + 1)] for key, item in value.items()]}
    if kind is np.ndarray and value.dtype.str in DTYPES and value.ndim <= MAX_DIMENSIONS:
        raw.append(value.tobytes())
        return {"a": [value.dtype.str, list(value.shape)]}
    raise TypeError(f"{kind.__name__} is no plain data")


class _Reader:
    """Turns a tree back into values, taking the bytes of its arrays in order."""

    def __init__(self, raw: memoryview) -> None:
        self.raw = raw
        self.offset = 0

    def value(self, node: Any, depth: int) -> Any:
        if depth > MAX_DEPTH:
            raise WireError(f"nested deeper than {MAX_DEPTH} levels")
        kind = type(node)
        if kind is str:  # a lone surrogate would break whoever writes it to a file
            return node if node.isascii() else node.encode("utf-8", "replace").decode()
        if kind in PLAIN:
            return node
        if kind is int:
            if -MAX_INTEGER <= node < MAX_INTEGER:
                return node
            raise WireError("an integer of more than 64 bits")
        if kind is list:
            return tuple([self.value(item, depth + 1) for item in node])
        if kind is dict and len(node) == 1:
            ((name, content),) = node.items()
            if name == "a" and type(content) is list and len(content) == 2:
                return self.array(*content)
            if name == "d" and type(content) is list:
                return dict([self.pair(item, depth + 1) for item in content])
        raise WireError("a node of no known kind")

    def pair(self, item: Any, depth: int) -> tuple[str, Any]:
        if type(item) is not list or len(item) != 2 or type(item[0]) is not str:
            raise WireError("an entry of a dict is no pair")
        return self.value(item[0], depth), self.value(item[1], depth)

    def array(self, dtype: Any, shape: Any) -> Any:
        if type(dtype) is not str or dtype not in DTYPES:
            raise WireError("an array of no known dtype")
        if type(shape) is not list or len(shape) > MAX_DIMENSIONS:
            raise WireError("an array of no possible shape")
        if not all(type(size) is int and 0 <= size <= MAX_INTEGER >> 16 for size in shape):
            raise WireError("an array of no possible shape")
        start, size = self.offset, math.prod(shape) * DTYPES[dtype].itemsize
        self.offset += size
        if self.offset > len(self.raw):
            raise WireError("an array longer than the bytes sent")
        try:
            return np.frombuffer(self.raw[start : self.offset], DTYPES[dtype]).reshape(shape).copy()
        except ValueError:
            raise WireError("an array of no possible shape") from None
