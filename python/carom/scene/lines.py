"""Where each key of a TOML or JSON text stands: key path -> line number.

``tomllib`` and ``json`` give values without positions, and an error without a line is hard to act on. The
scanner below reads text that one of them has *already accepted*, so it may be lax: it knows strings,
comments, brackets, keys and headers, and leaves every other rule of the grammar to the parser that ran
before it.

Grammar of TOML: https://toml.io/en/v1.0.0; of JSON: RFC 8259. Knows nothing of scenes.
"""

from __future__ import annotations

import json
from collections.abc import Mapping

KeyPath = tuple[str | int, ...]

_BARE_END = frozenset(" \t\r\n=:.,]}#")


class _Scanner:
    """Walks one text and notes the line of every key and of every array item."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.at = 0
        self.line = 1
        self.lines: dict[KeyPath, int] = {}

    def peek(self) -> str:
        return self.text[self.at] if self.at < len(self.text) else ""

    def skip(self, count: int) -> str:
        """Moves on by `count` characters and returns them, counting line ends."""
        piece = self.text[self.at : self.at + count]
        self.at += len(piece)
        self.line += piece.count("\n")
        return piece

    def blank(self) -> None:
        """Moves over white space, line ends and comments."""
        while self.at < len(self.text):
            here = self.text[self.at]
            if here in " \t\r\n":
                self.skip(1)
            elif here == "#":
                end = self.text.find("\n", self.at)
                self.skip((len(self.text) if end < 0 else end) - self.at)
            else:
                return

    def string(self) -> str:
        """A quoted string of either format, standing at its opening quote; returns its value."""
        quote = self.peek()
        triple = self.text.startswith(quote * 3, self.at)
        closing = quote * 3 if triple else quote
        begin = self.at
        self.skip(len(closing))
        while self.at < len(self.text):
            if quote == '"' and self.peek() == "\\":
                self.skip(2)
            elif self.text.startswith(closing, self.at):
                self.skip(len(closing))
                while triple and self.peek() == quote:  # up to two more quotes belong to the string
                    self.skip(1)
                break
            else:
                self.skip(1)
        raw = self.text[begin : self.at]
        if quote == '"' and not triple:
            try:
                return str(json.loads(raw))
            except ValueError:  # \U escapes exist in TOML alone; the raw form still names the key
                pass
        return raw[len(closing) : -len(closing)]

    def key(self) -> str:
        if self.peek() in "\"'":
            return self.string()
        begin = self.at
        while self.at < len(self.text) and self.text[self.at] not in _BARE_END:
            self.at += 1
        return self.text[begin : self.at]

    def dotted(self) -> list[str]:
        """A dotted key such as ``world.gravity``."""
        parts = [self.key()]
        self.blank()
        while self.peek() == ".":
            self.skip(1)
            self.blank()
            parts.append(self.key())
            self.blank()
        return parts

    def note(self, path: KeyPath, line: int) -> None:
        """Remembers the line of a path and of those above it that have none yet."""
        for length in range(1, len(path) + 1):
            self.lines.setdefault(path[:length], line)

    def value(self, path: KeyPath) -> None:
        self.blank()
        self.note(path, self.line)
        here = self.peek()
        if here == "{":
            self.table(path)
        elif here == "[":
            self.array(path)
        elif here and here in "\"'":
            self.string()
        else:
            while self.at < len(self.text) and self.text[self.at] not in "\r\n,]}#":
                self.at += 1

    def table(self, path: KeyPath) -> None:
        self.skip(1)
        while True:
            self.blank()
            while self.peek() == ",":
                self.skip(1)
                self.blank()
            if self.peek() in ("}", ""):
                self.skip(1)
                return
            before, line = self.at, self.line
            keys = self.dotted()
            self.note((*path, *keys), line)
            if self.peek() in ("=", ":"):
                self.skip(1)
                self.value((*path, *keys))
            if self.at == before:  # cannot happen in accepted text; guards against a loop without end
                self.skip(1)

    def array(self, path: KeyPath) -> None:
        self.skip(1)
        index = 0
        while True:
            self.blank()
            if self.peek() in ("]", ""):
                self.skip(1)
                return
            if self.peek() == ",":
                self.skip(1)
                continue
            self.value((*path, index))
            index += 1

    def headed(self, names: list[str], counts: dict[KeyPath, int], is_array: bool) -> KeyPath:
        """The path that a ``[header]`` or ``[[header]]`` opens; arrays of tables get their running index."""
        path: KeyPath = ()
        for depth, name in enumerate(names):
            path = (*path, name)
            if is_array and depth == len(names) - 1:
                counts[path] = counts.get(path, -1) + 1
            if path in counts:
                path = (*path, counts[path])
        return path

    def document(self) -> None:
        """A whole TOML document."""
        counts: dict[KeyPath, int] = {}
        prefix: KeyPath = ()
        while True:
            self.blank()
            if not self.peek():
                return
            before, line = self.at, self.line
            if self.peek() == "[":
                is_array = self.text.startswith("[[", self.at)
                self.skip(2 if is_array else 1)
                self.blank()
                prefix = self.headed(self.dotted(), counts, is_array)
                self.note(prefix, line)
                self.skip(2 if is_array else 1)
            else:
                path = (*prefix, *self.dotted())
                self.note(path, line)
                self.skip(1)
                self.value(path)
            if self.at == before:
                self.skip(1)


def toml_lines(text: str) -> Mapping[KeyPath, int]:
    """Line (from 1) of every key and array item of a TOML text that ``tomllib`` accepts."""
    scanner = _Scanner(text)
    scanner.document()
    return scanner.lines


def json_lines(text: str) -> Mapping[KeyPath, int]:
    """Line (from 1) of every key and array item of a JSON text that ``json`` accepts."""
    scanner = _Scanner(text)
    scanner.value(())
    return scanner.lines


def line_of(lines: Mapping[KeyPath, int], path: KeyPath) -> int | None:
    """The line of `path`, or of the nearest path above it that has one; None for the document itself."""
    for length in range(len(path), 0, -1):
        if path[:length] in lines:
            return lines[path[:length]]
    return None
