"""The map from keys to lines: right for every spelling that TOML and JSON allow."""

from __future__ import annotations

import json
import tomllib
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from carom.scene.lines import json_lines, line_of, toml_lines

TEXT = '''# comment with [brackets] and "quotes"
title = "a # b [c]" # comment
"quoted key" = 'it''s'
multi = """
line with ] and }
"""
literal = \'\'\'
[not.a.table]
\'\'\'
list = [
  1, # one
  [2, 3],
  { a = 1, b.c = 2 },
]
dotted.key.deep = 1

[table.sub]
x = 1e3
[[body]]
name = "a"
shape = { type = "box", size = [
   1,
   2] }
[[body]]
  [body.shape]
  type = "circle"
[[body.part]]
y = 1
[[body.part]]
y = 2
'''


def test_lines_of_every_toml_spelling() -> None:
    text = TEXT.replace("'it''s'", "'its'")
    tomllib.loads(text)
    lines = toml_lines(text)
    wanted = {
        ("title",): 2, ("quoted key",): 3, ("multi",): 4, ("literal",): 7, ("list",): 10, ("list", 0): 11,
        ("list", 1, 1): 12, ("list", 2, "a"): 13, ("list", 2, "b", "c"): 13, ("dotted", "key", "deep"): 15,
        ("table", "sub", "x"): 18, ("body", 0): 19, ("body", 0, "name"): 20,
        ("body", 0, "shape", "size", 1): 23,
        ("body", 1): 24, ("body", 1, "shape", "type"): 26, ("body", 1, "part", 0, "y"): 28,
        ("body", 1, "part", 1): 29, ("body", 1, "part", 1, "y"): 30,
    }  # fmt: skip
    assert {path: lines[path] for path in wanted} == wanted


def test_missing_key_has_the_line_of_what_holds_it() -> None:
    lines = toml_lines('a = 1\n[[body]]\nname = "x"\n')
    assert line_of(lines, ("body", 0, "mass")) == 2
    assert line_of(lines, ("nothing",)) is None


_SCALARS = st.one_of(st.integers(), st.booleans(), st.text(max_size=8), st.none())
_TREES = st.recursive(
    _SCALARS,
    lambda inner: st.one_of(
        st.lists(inner, max_size=4), st.dictionaries(st.text(max_size=5), inner, max_size=4)
    ),
    max_leaves=25,
)


@given(_TREES)
def test_every_path_of_a_json_text_has_the_line_where_its_value_stands(tree: Any) -> None:
    text = json.dumps(tree, indent=1)
    lines = json_lines(text)
    rows = text.split("\n")
    for path, value in _paths(tree):
        row = rows[lines[path] - 1]
        if isinstance(path[-1], str):
            assert json.dumps(path[-1]) + ":" in row
        elif not isinstance(value, (dict, list)):
            assert json.dumps(value) in row


def _paths(tree: Any, above: tuple[str | int, ...] = ()) -> list[tuple[tuple[str | int, ...], Any]]:
    pairs = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    found = []
    for key, value in pairs:
        found.append(((*above, key), value))
        found += _paths(value, (*above, key))
    return found


@given(st.text(alphabet="ab=[]{}\"'#\n,. \\1", max_size=60))
def test_any_text_that_toml_accepts_is_walked_to_its_end(text: str) -> None:
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return
    lines = toml_lines(text)
    for path, _ in _paths(data):
        assert 1 <= lines[path] <= text.count("\n") + 1
