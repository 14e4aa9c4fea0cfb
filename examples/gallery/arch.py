"""An arch at its limit thickness

A half-circle of loose stones stands if it is thick enough for a line of thrust to fit inside: Heyman's limit
is 0.106 of the radius (Couplet's problem). At 0.115 the arch stands under its own weight; at 0.095 it opens
hinges at the crown and the haunches, and falls. Nothing in the engine knows of arches: impulses at the
corners of stones find it.
"""

import numpy as np
from matplotlib.figure import Figure

from carom import picture, planar, plotting

worlds, runs, angles = {}, {}, np.linspace(0, np.pi, 26)
for thickness in (0.115, 0.095):
    w = planar.World(dt=1 / 120, solver="exact", tolerance=1e-9)
    w.add_static("ground", planar.HalfPlane(), friction=0.9)
    for k in range(25):
        ring = [(r * np.cos(a), r * np.sin(a))
                for r in (1 - thickness / 2, 1 + thickness / 2) for a in angles[k : k + 2]]  # fmt: skip
        w.add_body(f"stone{k}", planar.ConvexPolygon(ring), density=2000.0, origin=(0, 0), friction=0.9)
    label = f"thickness {thickness} of the radius"
    worlds[label], runs[label] = w, w.run(0.6)

# the picture
figure = Figure(figsize=(10, 4.6), layout="constrained")
stones = {f"stone{k}": ("#C9A66B", "#D9BC8C", "#B98F52")[k % 3] for k in range(25)}
for axes, (label, run) in zip(figure.subplots(1, 2, sharey=True), runs.items(), strict=True):
    stands = label.startswith("thickness 0.115")
    picture.draw(worlds[label], axes, run=run, colors=stones, impulses=stands, view=(-1.3, 1.3, -0.1, 1.3))
    axes.set_title(label, fontsize="medium")
plotting.save_figure(figure, "arch.svg")
