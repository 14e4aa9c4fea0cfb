"""A thousand on one: a stack under five solvers

Nine boxes of 1 kg carry one of 1000 kg, with 100 iterations a step for whoever sweeps. `pgs` passes weight
on by small shares: the heavy box sinks through all the others. Accelerated methods hold longer and lean or
burst. `exact` solves every step, and so does `auto`, which begins as `pgs` does and goes on where the
residual asks for it. The panels show the stacks after two seconds; the curves say how far each step was from
the contact law, in m/s. No solver is wrong silently: the three bad ones tell of it from their first steps
on.
"""

from matplotlib.figure import Figure

import carom
from carom import picture, planar, plotting


def stack():
    w = planar.World(dt=1 / 60, tolerance=1e-8, iterations=100, on_inaccurate="ignore")
    w.add_static("floor", planar.HalfPlane(), friction=0.5)
    for k in range(10):
        w.add_body(f"box{k}", planar.Box(1, 1), mass=1.0 if k < 9 else 1000.0, position=(0, 0.5 + k))
    return w


solvers = ["pgs", "nncg", "apgd", "exact", "auto"]
found = carom.compare(stack, solvers, t=2.0)

# the picture
runs, figure = found.runs, Figure(figsize=(11, 4.6), layout="constrained")
*panels, right = figure.subplots(1, 6, width_ratios=[1, 1, 1, 1, 1, 3.2])
colors = {"box9": "#D55E00"} | {f"box{k}": "#56B4E9" for k in range(9)}
for number, (solver, axes) in enumerate(zip(solvers, panels, strict=True)):
    run = runs[solver]
    picture.draw(stack(), axes, run=run, view=(-1.6, 1.6, -0.4, 10.6), colors=colors)
    axes.set_title(f"{solver}\ntop sank {10 - run.position[-1, 10, 1] - 0.5:.1e} m", fontsize=8)
    axes.set(xticks=[], xlabel="", ylabel="y [m]" if number == 0 else "")
    residual = run.steps["residual"] + 1e-16
    right.semilogy(run.steps["time"], residual, label=solver, **plotting.style(number))
right.set(xlabel="time [s]", ylabel="residual [m/s]")
right.legend(fontsize="small")
plotting.save_figure(figure, "heavy_top.svg")
