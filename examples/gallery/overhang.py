"""Four bricks, and how far they reach

Bricks on the edge of a table, each over the one below by the harmonic rule, reach 25/24 of a brick beyond
it. At 0.99 of that they stand; at 1.01 they fall, slowly, as a thing does that all but stands.
"""

from matplotlib.figure import Figure

from carom import picture, planar, plotting

worlds, runs = {}, {}
for share, seconds in ((0.99, 2.0), (1.01, 0.9)):
    w = planar.World(dt=1 / 240, solver="exact", tolerance=1e-10)
    w.add_static("table", planar.Box(2, 0.5), position=(-1, -0.25), friction=0.6)
    for k in range(4):
        end = share * sum(1 / (2 * (4 - j)) for j in range(k + 1))  # beyond the edge
        place = (end - 0.5, 0.125 + 0.25 * k)
        w.add_body(f"brick{k}", planar.Box(1, 0.25), mass=1.0, position=place, friction=0.6)
    worlds[f"{share} of 25/24"], runs[f"{share} of 25/24"] = w, w.run(seconds)

# the picture
figure = Figure(figsize=(9, 3.8), layout="constrained")
for axes, ghosts, (label, run) in zip(figure.subplots(1, 2, sharey=True), (0, 5), runs.items(), strict=True):
    picture.draw(worlds[label], axes, run=run, view=(-1.1, 1.4, -0.5, 1.3), ghosts=ghosts)
    axes.set_title(label, fontsize="medium")
plotting.save_figure(figure, "overhang.svg")
