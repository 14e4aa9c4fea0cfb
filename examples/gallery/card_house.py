"""A house of cards

Fifteen cards stand on their edges by friction alone, three storeys high. Arrows are the impulses on the
upper card of each pair, all on one scale: they add up storey by storey, and lean inwards by less than the
friction angle. With the coefficient of friction below half the tangent of the angle between two cards no
forces can hold them, and the house slides apart: `exact` finds forces, or says that there are none.
"""

from carom import build_scene, picture, plotting

w = build_scene("card_house")
w.solver, w.tolerance = "exact", 1e-10
run = w.run(1.0)
runs = {"exact": run}
figure = picture.draw(w, impulses=True, zoom=1.15, size=(7.5, 5.6))
plotting.save_figure(figure, "card_house.svg")
