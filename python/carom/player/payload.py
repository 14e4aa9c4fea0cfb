"""What the page reads: one block of bytes with a table of contents, packed as base64 of gzip.

Layout: the length of the table [4 bytes, little-endian], the table as JSON (UTF-8), then the arrays,
little-endian, each at a multiple of eight. The table names for each array its type, shape, offset and filter:
"delta" stores differences along the first axis (modulo 2^16), "shuffle" all low bytes before all high ones;
both make what changes little compress well. Base64 has no character that ends a script, so names of bodies
cannot either. Parts of a large block are packed each for itself and divided by dots. Knows no run.
"""

from __future__ import annotations

import base64
import gzip
import json
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from carom.errors import CaromError

Array = npt.NDArray[Any]

#: Version of this layout; the page refuses another.
VERSION = 1
#: A block is packed in parts that a browser unpacks at the same time: how many, and no smaller than [bytes].
_MOST_PARTS, _SMALLEST_PART = 4, 1_000_000
_TYPES = {
    "|u1": "u1",
    "<u2": "u2",
    "<u4": "u4",
    "<i4": "i4",
    "<f2": "f2",
    "<f4": "f4",
    "<f8": "f8",
}


class Payload:
    """A table and arrays on their way to a page."""

    def __init__(self) -> None:
        """Nothing yet."""
        self.table: dict[str, Any] = {"format": "carom-replay", "version": VERSION}
        self._arrays: dict[str, tuple[Array, str]] = {}

    def add(self, name: str, values: Array, filtered: str = "") -> None:
        """Adds an array; `filtered` is "", "shuffle" or "delta shuffle", both for numbers of 16 bits."""
        self._arrays[name] = (np.ascontiguousarray(values), filtered)

    def raw(self) -> bytes:
        """The block before it is packed."""
        contents, parts, offset = {}, [], 0
        for name, (values, filtered) in self._arrays.items():
            told = _TYPES[values.dtype.newbyteorder("<").str]
            contents[name] = {"type": told, "shape": list(values.shape), "at": offset, "filter": filtered}
            body = _filtered(values, filtered)
            padding = -len(body) % 8
            parts += [body, bytes(padding)]
            offset += len(body) + padding
        table = encoded({**self.table, "arrays": contents})
        table += b" " * (-(len(table) + 4) % 8)
        return b"".join([len(table).to_bytes(4, "little"), table, *parts])

    def packed(self) -> str:
        """Base64 of gzip, large blocks as parts divided by dots; the same bytes for the same content."""
        raw = self.raw()
        size = max(-(-len(raw) // _MOST_PARTS), _SMALLEST_PART)
        parts = [raw[begin : begin + size] for begin in range(0, len(raw), size)]
        packed = [base64.b64encode(gzip.compress(part, compresslevel=6, mtime=0)) for part in parts]
        return b".".join(packed).decode("ascii")


def encoded(table: Mapping[str, Any]) -> bytes:
    """A table as JSON without NaN, which JSON does not have."""
    try:
        return json.dumps(table, allow_nan=False, separators=(",", ":")).encode("utf-8")
    except ValueError as error:
        raise CaromError(f"replay: a figure of the run is not finite ({error})", field="run") from error


def _filtered(values: Array, filtered: str) -> bytes:
    plain = values.astype(values.dtype.newbyteorder("<"), copy=False)
    if not filtered:
        return plain.tobytes()
    words = plain.view(np.uint16)
    if filtered == "delta shuffle":
        words = np.diff(words, axis=0, prepend=np.zeros((1, *words.shape[1:]), np.uint16))
    flat = words.reshape(-1)
    return (flat & 0xFF).astype(np.uint8).tobytes() + (flat >> 8).astype(np.uint8).tobytes()
