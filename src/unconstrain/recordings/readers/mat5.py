"""MATLAB's files of version 5, read in bounds.

SciPy's reader can be brought down by damaged bytes, so this one reads what recordings are made of, and every length
is checked against the bytes there are: numbers, text, cells and structs. The format is described in MathWorks'
*MAT-File Format*, "Level 5 MAT-File Format". Sparse matrices, objects and functions are left out.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

HEADER = 128
"""Bytes before the first element: text, then version and byte order."""

MATRIX, COMPRESSED = 14, 15
CELL, STRUCT, CHAR = 1, 2, 4
NUMBERS = range(6, 16)
COMPLEX = 0x0800

KINDS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
"""NumPy's names for the types of numbers."""

TEXTS = {1: "latin-1", 2: "latin-1", 16: "utf-8"}
"""Encodings of the types of text; all others hold two bytes for each character."""

LARGEST_RATIO = 1100
"""What zlib packs is unpacked to no more than so many times its size: it cannot be more."""

DEEPEST = 32


class Element(NamedTuple):
    """A piece of a file: its type, and its bytes."""

    kind: int
    data: memoryview


def read_mat5(content: bytes) -> dict[str, Any]:
    """The variables of a file: arrays, words, mappings (a struct), lists (cells and arrays of structs).

    Raises
    ------
    ValueError
        If the bytes do not say what they should.
    """
    order = {b"IM": "<", b"MI": ">"}.get(content[126:HEADER])
    if order is None:
        raise ValueError("neither version 5 nor 7.3")
    variables = {}
    for element in _elements(memoryview(content)[HEADER:], order):
        if element.kind == COMPRESSED:
            unpacked = zlib.decompressobj().decompress(element.data, LARGEST_RATIO * len(element.data) + 1)
            element = next(_elements(memoryview(unpacked), order), Element(0, memoryview(b"")))
        if element.kind == MATRIX:
            name, value = _matrix(element.data, order, 0)
            variables[name] = value
    return variables


def _elements(data: memoryview, order: str) -> Iterator[Element]:
    """The elements one after the other."""
    at = 0
    while at + 8 <= len(data):
        kind, size = struct.unpack_from(f"{order}II", data, at)
        start = at + 8
        if kind >> 16:  # a small one has its size beside its type, and its bytes where the size would be
            kind, size, start = kind & 0xFFFF, kind >> 16, at + 4
        if start + size > len(data):
            raise ValueError("it ends in the middle of a variable")
        yield Element(kind, data[start : start + size])
        at = start + size if kind == COMPRESSED else at + 8 + (0 if start == at + 4 else -(-size // 8) * 8)


def _matrix(data: memoryview, order: str, depth: int) -> tuple[str, Any]:
    """Name and value of a variable, a member of a cell, or a field of a struct; None for what is left out."""
    if depth > DEEPEST:
        raise ValueError("its structs are nested too deep")
    parts = _elements(data, order)
    head = next(parts, None)
    if head is None or len(head.data) < 8:  # an empty member
        return "", None
    flags = struct.unpack_from(f"{order}I", head.data)[0]
    shape = tuple(_numbers(_next(parts), order).astype(np.int64).tolist())
    name = bytes(_next(parts).data).decode("latin-1")
    if min(shape, default=0) < 0 or len(shape) > DEEPEST:
        raise ValueError("a variable has no shape")
    return name, _value(parts, flags, shape, order, depth)


def _value(parts: Iterator[Element], flags: int, shape: tuple[int, ...], order: str, depth: int) -> Any:
    kind = flags & 0xFF
    if kind == CELL:
        return [_matrix(part.data, order, depth + 1)[1] for part in parts if part.kind == MATRIX]
    if kind == STRUCT:
        return _structs(parts, order, depth)
    if kind == CHAR:
        return _text(next(parts, Element(1, memoryview(b""))))
    if kind not in NUMBERS or flags & COMPLEX:
        return None
    numbers = _numbers(next(parts, Element(9, memoryview(b""))), order)
    if math.prod(shape) != len(numbers):
        raise ValueError("a variable has more or fewer numbers than its shape says")
    return numbers.reshape(shape, order="F")


def _structs(parts: Iterator[Element], order: str, depth: int) -> list[dict[str, Any]]:
    width = int(_numbers(_next(parts), order)[:1].sum())
    if not 0 < width <= 4096:
        raise ValueError("a struct has no names of fields")
    text = bytes(_next(parts).data)
    names = [text[at : at + width].split(b"\0")[0].decode("latin-1") for at in range(0, len(text), width)]
    values = [_matrix(part.data, order, depth + 1)[1] for part in parts if part.kind == MATRIX]
    return [
        dict(zip(names, values[at : at + len(names)], strict=False)) for at in range(0, len(values), len(names) or 1)
    ]


def _next(parts: Iterator[Element]) -> Element:
    part = next(parts, None)
    if part is None:
        raise ValueError("it ends in the middle of a variable")
    return part


def _numbers(element: Element, order: str) -> Any:
    kind = KINDS.get(element.kind)
    if kind is None:
        raise ValueError(f"numbers of a type that does not exist ({element.kind})")
    kind = f"{order}{kind}"
    return np.frombuffer(element.data, kind, len(element.data) // np.dtype(kind).itemsize)


def _text(element: Element) -> str:
    encoding = TEXTS.get(element.kind, "utf-16")
    return bytes(element.data).decode(encoding, "replace")
