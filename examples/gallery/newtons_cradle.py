"""Newton's cradle under four impact laws

One ball swings in against four that hang touching. Newton's, Moreau's and Poisson's laws share the blow
among all contacts at once, so all five balls move; generalized reflections send it through the row, and only
the last ball leaves. Momentum and, elastic as the balls are, energy are the same in all four: rigid bodies
do not say which is right, so the law is a choice of its own. Real cradles do what the last panel shows. (A
fifth law, `sequential`, gives the same there, but resolves collisions one by one and knows no strings: the
engine refuses it here by name.)
"""

from matplotlib.figure import Figure

from carom import picture, planar, plotting

runs, figure = {}, Figure(figsize=(9, 7.4), layout="constrained")
panels = figure.subplots(2, 2, sharex=True, sharey=True).flat
for law, axes in zip(["newton", "moreau", "poisson", "generalized_reflections"], panels, strict=True):
    w = planar.World(scheme="events", dt=1 / 240, impact=law)
    for k in range(5):
        x, y, v = (-0.3, -0.9539392, 0.0) if k == 0 else (0.1 * k, -1.0, 0.0)
        w.add_body(f"ball{k}", planar.Circle(0.05), mass=1.0, position=(x, y), restitution=1.0, friction=0.0)
        w.add_distance_joint(f"string{k}", f"ball{k}", anchor_a=(0, 0), anchor_b=(0.1 * k, 0))
    runs[law] = w.run(0.85)
    picture.draw(w, axes, run=runs[law], ghosts=5, view=(-0.5, 0.9, -1.1, 0.04))
    speeds = ", ".join(f"{v:.2f}" for v in w.velocity[:, 0])
    axes.set_title(f"{law.replace('_', ' ')}: {speeds} m/s", fontsize="medium")
plotting.save_figure(figure, "newtons_cradle.svg")
