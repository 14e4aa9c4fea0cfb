"""Suggestions for mistyped words: the nearest of the allowed ones, by difflib's similarity ratio."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


def nearest(word: str, allowed: Iterable[str]) -> str | None:
    """The allowed word that is most like `word`, or None when nothing is."""
    words = list(allowed)
    folded = {candidate.casefold().replace("-", "_"): candidate for candidate in words}
    found = difflib.get_close_matches(word.casefold().replace("-", "_"), folded, n=1, cutoff=0.6)
    return folded[found[0]] if found else None


def did_you_mean(word: str, allowed: Iterable[str]) -> str:
    """``did you mean 'friction'?``, or an empty text when nothing is near."""
    found = nearest(word, allowed)
    return f"did you mean {found!r}?" if found is not None else ""
