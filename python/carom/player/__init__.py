"""The replay page of a run: its payload, the page itself, pictures and films.

>>> from carom import planar
>>> w = planar.World()
>>> _ = w.add_body("ball", planar.Circle(0.5), density=1.0, position=(0, 1))
>>> run = w.run(0.1, every=4)
>>> path = run.to_html(getfixture("tmp_path") / "ball.html")  # doctest: +SKIP
"""

from carom.player.encode import MAX_BYTES
from carom.player.page import notebook_frame, page_of, write_page
from carom.player.words import EXPLAIN_SECONDS

__all__ = ["EXPLAIN_SECONDS", "MAX_BYTES", "notebook_frame", "page_of", "write_page"]
