"""A long brick under three models of friction

Bricks of 1 m by 0.2 m lie along x and are launched at 3 m/s in sixteen directions; seen from above.
Coulomb's law slows each against its slip, so they go straight and stop on a circle. The lecture notes' box
limits each tangent of a contact on its own: friction is up to 41 % too strong along the diagonals, and ways
between them bend. Soft steps solve Coulomb's law on stiff springs with one friction point per face: straight
again, to single precision. What games do, a step along the inverse of the mass at the contact and a clamp,
carom does not offer: see the slip direction errors of `slide` in [the race](../../engines.md#the-race).
"""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from carom import plotting, spatial

models = {"disc, fixed_step": {"friction_law": "disc"}, "box, fixed_step": {"friction_law": "box"},
          "disc, soft_step": {"scheme": "soft_step", "dt": 1 / 120}}  # fmt: skip
runs = {}
for label, settings in models.items():
    w = spatial.World(**{"dt": 1 / 240, "iterations": 400, "on_inaccurate": "ignore", **settings})
    w.add_static("floor", spatial.HalfSpace(), friction=0.5, collision_groups=2)
    for k, a in enumerate(np.arange(16) * np.pi / 8):  # they meet the floor and not each other
        w.add_body(f"brick{k}", spatial.Box(1, 0.2, 0.1), density=2000.0, position=(0, 0, 0.05), friction=0.5,
                   velocity=(3 * np.cos(a), 3 * np.sin(a), 0), collision_mask=2)  # fmt: skip
    runs[label] = w.run(1.0, every=4)

# the picture
figure = Figure(figsize=(10, 3.9), layout="constrained")
for axes, (label, run) in zip(figure.subplots(1, 3, sharey=True), runs.items(), strict=True):
    for k in range(16):
        axes.plot(run.position[:, k + 1, 0], run.position[:, k + 1, 1], **plotting.style(k))
        axes.plot(*run.position[-1, k + 1, :2], "o", color=plotting.PALETTE[k % 10], markersize=4)
    axes.add_patch(Circle((0, 0), 9 / 9.81, fill=False, color="#999999"))
    axes.set(title=label, xlabel="x [m]", ylabel="y [m]", aspect="equal")
plotting.save_figure(figure, "brick.svg")
