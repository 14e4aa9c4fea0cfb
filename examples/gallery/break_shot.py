"""A break shot

A cue ball at 6 m/s breaks a rack of fifteen on a cloth: balls slide, roll and strike each other and four
cushions. The white band on each ball shows its turning. Blows run through touching balls by generalized
reflections, so the rack bursts symmetrically until rounding and friction tell sides apart; the ledger tells
how many joules the cloth, the cushions and the balls' restitution took.
"""

from carom import build_scene, picture, plotting

w = build_scene("billiard_break_spatial")
w.impact = "generalized_reflections"
runs = {"pgs, generalized reflections": w.run(0.55, every=4)}
felt = {name: "#2E7D5B" for name in w.names if name == "bed"} | {"cue": "#FAFAF5"}
figure = picture.draw(w, colors=felt, view=(0.45, 0, 0.03, 0.62), azimuth=-118, elevation=30, size=(8, 4.8))
plotting.save_figure(figure, "break_shot.png")
