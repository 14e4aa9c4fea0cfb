"""Dzhanibekov's wing nut under five integrators

A handle spun about its middle axis turns over again and again. Free rotation has an exact energy: what an
integrator makes of it is its own doing, and the ledger has a line for it. Both Euler forms change a large
part of it, and the second soon turns over at its own pace. The trapezoid rule with its splitting swings in a
band and comes back, Runge and Kutta's fourth order drifts, and the implicit midpoint keeps energy to
rounding, though not the moment of a turn. The same h = 1/50 s for all.
"""

import numpy as np
from matplotlib.figure import Figure

from carom import picture, plotting, spatial

bar, stem = spatial.Capsule(1.0, 0.1), spatial.RoundBox(0.6, 0.06, 0.06, radius=0.05)
handle = spatial.Compound([(bar, (0, 0, 0)), (stem, (0.4, 0, 0))])
runs = {}
for name in ["explicit_euler", "semi_implicit_euler", "trapezoid", "rk4", "implicit_midpoint"]:
    w = spatial.World(gravity=(0, 0, 0), dt=1 / 50, integrator=name)
    w.add_body("nut", handle, density=1000.0, angular_velocity=(5.0, 0.01, 0.02))
    runs[name] = w.run(20.0)

# the picture
figure = Figure(figsize=(11, 4.2), layout="constrained")
left, middle, right = figure.subplots(1, 3, width_ratios=[1, 1.35, 1.35])
for number, (name, run) in enumerate(runs.items()):
    q = run.rotation[:, 0]
    turned = 1 - 2 * (q[:, 2] ** 2 + q[:, 3] ** 2)  # x axis of the body along x
    drift = np.abs(run.ledger.kinetic / run.ledger.kinetic[0] - 1) + 1e-16
    middle.semilogy(run.ledger.time, drift, label=name.replace("_", " "), **plotting.style(number))
    right.plot(run.time, turned, **plotting.style(number))
picture.draw(w, left, colors="#E69F00", azimuth=-65, elevation=25)
middle.set(xlabel="time [s]", ylabel="relative error of the energy [1]")
middle.legend(fontsize="small")
right.set(xlabel="time [s]", ylabel="body's first axis along x [1]")
plotting.save_figure(figure, "dzhanibekov.svg")
