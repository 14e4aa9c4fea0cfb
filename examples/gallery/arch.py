"""An arch at its limit thickness

A half-circle of loose stones stands if it is thick enough for a line of thrust to fit inside: Heyman's limit
is 0.106 of the radius (Couplet's problem). At 0.115 the arch stands under its own weight; at 0.095 it opens
hinges at the crown and the haunches, and falls. Nothing in the engine knows of arches: impulses at the
corners of stones find it.
"""

from itertools import pairwise

import numpy as np
from matplotlib.figure import Figure

from carom import picture, planar, plotting

runs, figure = {}, Figure(figsize=(10, 4.6), layout="constrained")
for axes, thickness in zip(figure.subplots(1, 2, sharey=True), (0.115, 0.095), strict=True):
    w = planar.World(dt=1 / 120, solver="exact", tolerance=1e-9)
    w.add_static("ground", planar.HalfPlane(), friction=0.9)
    angles = np.linspace(0, np.pi, 26)
    for k, (a, b) in enumerate(pairwise(angles)):
        ring = [
            (r * np.cos(t), r * np.sin(t)) for r in (1 - thickness / 2, 1 + thickness / 2) for t in (a, b)
        ]
        w.add_body(f"stone{k}", planar.ConvexPolygon(ring), density=2000.0, origin=(0, 0), friction=0.9)
    label = f"thickness {thickness} of the radius"
    runs[label] = w.run(0.6)
    shades = lambda name: ("#C9A66B", "#D9BC8C", "#B98F52")[int(name[5:]) % 3]  # noqa: E731
    picture.draw(
        w, axes, run=runs[label], colors=shades, impulses=thickness > 0.1, view=(-1.3, 1.3, -0.1, 1.3)
    )
    axes.set_title(label, fontsize="medium")
plotting.save_figure(figure, "arch.svg")
