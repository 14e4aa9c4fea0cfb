"""Four bricks, and how far they reach

Bricks on the edge of a table, each over the one below by the harmonic rule, reach 25/24 of a brick beyond
it. At 0.99 of that they stand; at 1.01 they fall, slowly, as a thing does that all but stands.
"""

from matplotlib.figure import Figure

from carom import picture, planar, plotting

runs, figure = {}, Figure(figsize=(9, 3.8), layout="constrained")
for axes, share in zip(figure.subplots(1, 2, sharey=True), (0.99, 1.01), strict=True):
    w = planar.World(dt=1 / 240, solver="exact", tolerance=1e-10)
    w.add_static("table", planar.Box(2, 0.5), position=(-1, -0.25), friction=0.6)
    ends = [
        share * sum(1 / (2 * (4 - j)) for j in range(k + 1)) for k in range(4)
    ]  # of brick k beyond the edge
    for k, end in enumerate(ends):
        w.add_body(
            f"brick{k}", planar.Box(1, 0.25), mass=1.0, position=(end - 0.5, 0.125 + 0.25 * k), friction=0.6
        )
    label = f"{share} of 25/24"
    runs[label] = w.run(2.0 if share < 1 else 0.9)
    picture.draw(w, axes, run=runs[label], view=(-1.1, 1.4, -0.5, 1.3), ghosts=0 if share < 1 else 5)
    axes.set_title(label, fontsize="medium")
plotting.save_figure(figure, "overhang.svg")
