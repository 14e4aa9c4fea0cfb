"""Force chains in a heap of discs

Two hundred discs of three sizes rest in a box. Each line joins two discs that touch, its width the force
between them: weight does not spread evenly, it runs down in chains past discs that carry next to nothing.
Accelerated gradients solve the heap; the certificate says how well.
"""

import numpy as np

from carom import picture, planar, plotting

w, rng = planar.World(dt=1 / 240, iterations=60, on_inaccurate="ignore"), np.random.default_rng(7)
w.add_static("floor", planar.HalfPlane(), friction=0.3)
for x, n in ((-1.0, 1), (1.0, -1)):
    w.add_static(f"wall{n}", planar.HalfPlane(normal=(n, 0)), position=(x, 0), friction=0.3)
for k in range(200):
    place = (-0.85 + 0.19 * (k % 10) + rng.uniform(-0.01, 0.01), 0.12 + 0.2 * (k // 10))
    disc = planar.Circle((0.05, 0.065, 0.08)[k % 3])
    w.add_body(f"disc{k}", disc, density=100.0, position=place, friction=0.3)
runs = {"pour, pgs": w.run(3.5, every=8)}  # with few sweeps, then solved
w.solver, w.tolerance, w.iterations = "apgd", 1e-7, 20000
runs["rest, apgd"] = w.run(0.1)

# the picture
figure = picture.draw(w, colors="#CFE3F2", view=(-1.05, 1.05, -0.05, 1.75), size=(7, 5.8))
force = w.contacts["normal_impulse"] / w.dt
for contact, f in zip(w.contacts, force, strict=True):
    ends = [w.position[contact[side]] if contact[side] > 2 else contact["point"] for side in "ab"]
    figure.axes[0].plot(*np.transpose(ends), color="#B00040", linewidth=5 * f / force.max(), zorder=8)
plotting.save_figure(figure, "force_chains.svg")
