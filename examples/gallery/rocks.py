"""Rocks on a terrain

Forty convex rocks tumble into a valley of triangles. What to look at is what does not happen: no rock sinks
through the mesh or trips over its inner edges, and the ledger closes to rounding while hundreds of contacts
come and go.
"""

from carom import build_scene, picture, plotting

w = build_scene("rocks_on_terrain")
w.solver, w.on_inaccurate = "pgs", "ignore"  # the table below says how accurate it was
runs = {"pgs": w.run(2.5, every=12)}
figure = picture.draw(w, elevation=32, azimuth=-60, zoom=1.15, size=(8, 5.2))
plotting.save_figure(figure, "rocks.png")
