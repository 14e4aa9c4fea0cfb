"""A run in which nothing ever touches has a replay like any other."""

from __future__ import annotations

from pathlib import Path

import carom


def test_a_run_without_contacts_is_replayed(tmp_path: Path) -> None:
    run = carom.build_scene("dzhanibekov").run(0.1)
    assert run.contacts.offsets[-1] == 0
    assert run.to_html(tmp_path / "flip.html").stat().st_size > 100_000
