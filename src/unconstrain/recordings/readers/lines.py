"""A text by blocks of whole lines, whatever its encoding and the ends of its lines."""

import codecs
from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import BinaryIO, NamedTuple

from ...base.errors import ReadError

BLOCK_BYTES = 2**21
"""So much of a text is parsed at once."""

LONGEST_LINE = 2**26
"""A line beyond so many bytes is refused."""

HEAD_BYTES = 2**18
"""So much of a text is looked at to find its table, or so many lines if that is more."""

HEAD_LINES = 20

_MARKS = ((codecs.BOM_UTF8, "utf-8"), (codecs.BOM_UTF16_LE, "utf-16-le"), (codecs.BOM_UTF16_BE, "utf-16-be"))


class Lines(NamedTuple):
    """Whole lines as UTF-8, each with a line feed at its end, and the number of the first one, from 0."""

    first: int
    text: bytes

    @property
    def next(self) -> int:
        """Number of the line that comes after."""
        return self.first + self.text.count(b"\n")

    def before(self, line: int | None) -> "Lines":
        """What is left up to a line."""
        kept = None if line is None else max(line - self.first, 0)
        return self if kept is None else Lines(self.first, b"".join(self.text.splitlines(keepends=True)[:kept]))

    def after(self, line: int) -> "Lines":
        """What is left from a line on."""
        skipped = max(line - self.first, 0)
        return Lines(self.first + skipped, self.text.split(b"\n", skipped)[-1] if skipped else self.text)


def lines_of(file: BinaryIO, path: Path) -> Iterator[Lines]:
    """Go through a text, a short block first; a ReadError where a line has no end."""
    first, rest = 0, b""
    for text, is_last in _chunks(file):
        rest += text
        cut = len(rest) if is_last else rest.rfind(b"\n") + 1
        block, rest = rest[:cut], rest[cut:]
        if block:
            found = Lines(first, block if block.endswith(b"\n") else block + b"\n")
            yield found
            first = found.next
        if len(rest) > LONGEST_LINE:
            raise ReadError(f"{path}, line {first + 1}: is longer than 64 MB, expected a row of a table.")


def head_of(blocks: Iterator[Lines]) -> list[Lines]:
    """The first blocks, with enough lines to see what is in the text."""
    head: list[Lines] = []
    for block in blocks:
        head.append(block)
        if block.next >= HEAD_LINES:
            break
    return head


def texts(head: Sequence[Lines]) -> list[str]:
    """The lines to look at in some blocks; those that are not UTF-8 as older programs write them."""
    lines = (line for block in head for line in block.text.split(b"\n")[:-1])
    return [_decoded(line) for line in islice(lines, max(HEAD_LINES, head[0].next if head else 0))]


def _decoded(line: bytes) -> str:
    try:
        return line.decode()
    except UnicodeDecodeError:
        return line.decode("cp1252", errors="replace")


def _chunks(file: BinaryIO) -> Iterator[tuple[bytes, bool]]:
    """Parts of a text as UTF-8 with a line feed at the end of lines, and whether it is the last part."""
    start = file.read(HEAD_BYTES)
    mark, encoding = next(((bom, code) for bom, code in _MARKS if start.startswith(bom)), (b"", "utf-8"))
    decoder = None if encoding == "utf-8" else codecs.getincrementaldecoder(encoding)()
    raw, held = start[len(mark) :], b""
    while True:
        following = file.read(BLOCK_BYTES) if raw or start else b""
        text = held + (raw if decoder is None else decoder.decode(raw, final=not following).encode())
        # Of the two characters that may end a line one may be in this part and the other in the next.
        held = b"\r" if following and text.endswith(b"\r") else b""
        text = text[: len(text) - len(held)]
        yield text.replace(b"\r\n", b"\n").replace(b"\r", b"\n") if b"\r" in text else text, not following
        if not following:
            return
        raw = following
