"""A double pendulum

Two bars on hinges, released from the side. Joints hold their gap to rounding; the line of the second bar's
end never repeats. Beside it, the ledger: kinetic energy from gravity's work and back, closed to rounding.
"""

from matplotlib.figure import Figure

from carom import build_scene, picture, plotting

w = build_scene("double_pendulum_planar")
run = w.run(6.0)
runs, figure = {"events": run}, Figure(figsize=(10, 4.4), layout="constrained")
left, right = figure.subplots(1, 2)
picture.draw(w, left, run=run, ghosts=14, view=(-2.2, 2.2, -2.3, 1.6))
turn, place = run.rotation[:, -1], run.position[:, -1]
for end in (0.5, -0.5):
    left.plot(place[:, 0] + end * turn[:, 0], place[:, 1] + end * turn[:, 1], linewidth=0.6, color="#D55E00")
right.plot(run.ledger.time, run.ledger.energy, label="kinetic + potential", **plotting.style(0))
right.plot(run.ledger.time, run.ledger.kinetic, label="kinetic", **plotting.style(5))
right.set(xlabel="time [s]", ylabel="energy [J]")
right.legend(fontsize="small", title=f"closed to {abs(run.ledger.closure).max():.0e} J")
plotting.save_figure(figure, "double_pendulum.svg")
