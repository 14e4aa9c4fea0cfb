"""A table on four legs

Eight kilograms off the middle of a table: infinitely many shares among four legs carry it. Asked for the
impulses of least norm, `exact` returns the one answer that depends neither on the order of contacts nor on
the steps before; the resultant of all answers is the same. Arrows are the impulses on the feet and on the
load.
"""

from carom import build_scene, picture, plotting

w = build_scene("four_leg_table")
w.solver, w.impulses, w.tolerance = "exact", "minimum_norm", 1e-10
runs = {"exact, minimum norm": w.run(0.5)}
figure = picture.draw(w, impulses=True, azimuth=-50, elevation=16, zoom=1.35, size=(7.5, 4.8))
plotting.save_figure(figure, "four_legs.png")
