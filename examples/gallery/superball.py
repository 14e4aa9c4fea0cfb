"""Garwin's superball

A ball that keeps its whole energy and turns its slip round at every bounce. Thrown along the floor with
backspin it comes back, and goes on to and fro over the same two places for ever. Impacts are found inside
steps of a hundredth of a second: the bounces are exact whatever the step.
"""

from matplotlib.figure import Figure

from carom import picture, planar, plotting

elastic = {"friction": 2.0, "restitution": 1.0, "tangential_restitution": 1.0}
w = planar.World(scheme="events", dt=1 / 100)
w.add_static("floor", planar.HalfPlane(), **elastic)
w.add_body("ball", planar.Circle(0.06), mass=0.1, inertia=0.4 * 0.1 * 0.06**2, position=(0, 0.5),
           velocity=(0.6, 0), angular_velocity=25.0, **elastic)  # fmt: skip
run = w.run(3.0)

# the picture
runs, figure = {"events": run}, Figure(figsize=(10, 3.6), layout="constrained")
left, right = figure.subplots(1, 2)
picture.draw(w, left, run=run, ghosts=40, view=(-0.5, 0.9, -0.05, 0.62))
left.plot(run.position[:, 1, 0], run.position[:, 1, 1], color="#999999", linewidth=0.7, zorder=1.2)
right.plot(run.time, run.velocity[:, 1, 0], label="velocity along x [m/s]", **plotting.style(1))
spin = run.angular_velocity[:, 1, 0] * 0.06
right.plot(run.time, spin, label="spin times radius [m/s]", **plotting.style(5))
right.set(xlabel="time [s]", ylabel="velocity [m/s]")
right.legend(fontsize="small")
plotting.save_figure(figure, "superball.svg")
