"""Thirty dominoes in a winding row

A toppling wave: each stone strikes the next, rests on it and slides down. The picture is taken while the
wave is half-way, so that every stage of a fall stands beside the others.
"""

from carom import build_scene, picture, plotting

w = build_scene("dominoes")
w.on_inaccurate = "ignore"  # the table below says how accurate it was
runs = {"pgs": w.run(0.62, every=4)}
figure = picture.draw(w, azimuth=-75, elevation=24, zoom=1.7, size=(8, 4.8))
plotting.save_figure(figure, "dominoes.png")
