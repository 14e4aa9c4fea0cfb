"""The site: Sphinx over these pages, with furo; nothing of it asks anything of the network.

Formulas are typeset in the page by KaTeX from `_static/katex` (ADR 15). Built by `make docs`.
"""

import re
import tomllib
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx

ROOT = Path(__file__).resolve().parent.parent

project = "carom"
author = "The carom developers"
copyright = "the carom developers; MIT OR Apache-2.0"
release = version = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["package"]["version"]

extensions = ["myst_parser", "sphinx.ext.autodoc"]
exclude_patterns = ["gallery/made/cards.md", "_made", "screenshots"]
suppress_warnings = ["myst.header", "ref.python"]
nitpicky = False

myst_enable_extensions = ["dollarmath", "attrs_block"]
myst_heading_anchors = 4
myst_dmath_double_inline = True

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
default_role = "code"
python_maximum_signature_line_length = 100
add_module_names = False

html_theme = "furo"
html_title = "carom"
html_static_path = ["_static"]
html_css_files = ["katex/katex.min.css", "carom.css"]
html_js_files = [("katex/katex.min.js", {"defer": "defer"}), ("carom.js", {"defer": "defer"})]
html_show_sphinx = False
html_copy_source = False
html_show_sourcelink = False
html_theme_options = {
    "sidebar_hide_name": False,
    "light_css_variables": {"color-brand-primary": "#0a5c9a", "color-brand-content": "#0a5c9a"},
    "dark_css_variables": {"color-brand-primary": "#6cc0f5", "color-brand-content": "#6cc0f5"},
}
html_math_renderer = "katex"
pygments_style = "friendly"
pygments_dark_style = "monokai"


def _inline(writer: Any, node: nodes.math) -> None:
    writer.body.append(writer.starttag(node, "span", "", CLASS="tex"))
    writer.body.append(f"{writer.encode(node.astext())}</span>")
    raise nodes.SkipNode


def _block(writer: Any, node: nodes.math_block) -> None:
    writer.body.append(writer.starttag(node, "div", "", CLASS="tex display"))
    writer.body.append(f"{writer.encode(node.astext())}</div>")
    raise nodes.SkipNode


#: What docstrings write, and reStructuredText would take for markup: bars and lone stars.
_MARKUP = ((re.compile(r"(?<![\w|])\|(?=[\w(])"), r"\\|"), (re.compile(r"(?<=\s)\*(?=\w)"), r"\\*"))


#: Headings of a docstring's sections; below them stand "names : meaning", or a name and its meaning below it.
_SECTIONS = ("Attributes", "Parameters", "Fields", "Returns", "Raises", "Warns", "Yields")


def _docstring(app: Sphinx, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:
    """Sections become lists; bars and lone stars outside code are formulas, no markup."""
    plain = [_escaped(line) for line in lines]
    lines[:] = []
    within = False
    for number, line in enumerate(plain):
        below = plain[number + 1] if number + 1 < len(plain) else ""
        if line in _SECTIONS and set(below) == {"-"}:
            lines += ["", f".. rubric:: {line}", ""]
            within = True
        elif within and set(line) == {"-"}:
            continue
        elif within and line and not line.startswith(" "):
            if " : " in line:
                names, meaning = line.split(" : ", 1)
                lines.append(f"- **{names}** : {meaning}")
            elif below.startswith(" "):
                lines.append(f"- **{line}** :")
            else:
                within = False
                lines += ["", line]
        else:
            lines.append(f"  {line.strip()}" if within and line else line)


def _escaped(line: str) -> str:
    parts = re.split(r"(``.+?``|`[^`]+`)", line)
    for k in range(0, len(parts), 2):
        for pattern, put in _MARKUP:
            parts[k] = pattern.sub(put, parts[k])
        if k and parts[k][:1].isalnum():
            parts[k] = "\\ " + parts[k]
    return "".join(parts)


def setup(app: Sphinx) -> dict[str, bool]:
    """Formulas as KaTeX wants them; docstrings that hold bars."""
    app.add_html_math_renderer("katex", inline_renderers=(_inline, None), block_renderers=(_block, None))
    app.connect("autodoc-process-docstring", _docstring)
    return {"parallel_read_safe": True}
