"""Seven objects between walls, and the pattern of A

The lecture notes' example: seven bodies of different shapes settle between two walls. Beside it stands A = J
M⁻¹ Jᵀ of their contacts. A square is coloured where two contacts share a body that can move: walls and
floor, which cannot, couple nothing. The chains of touching bodies that you see in the left picture are the
blocks that you see in the right one.
"""

from matplotlib.figure import Figure

from carom import build_scene, picture, plotting

w = build_scene("seven_objects")
w.solver = "auto"
run = w.run(4.0)
runs = {"auto": run}
problem = w.problem()
figure = Figure(figsize=(11, 5.6), layout="constrained")
left, right = figure.subplots(1, 2)
picture.draw(w, left, impulses=True, view=(-1.75, 1.75, -0.15, 2.3))
for number, contact in enumerate(w.contacts):
    left.annotate(str(number), contact["point"], fontsize=7, zorder=9,
                  bbox={"boxstyle": "circle,pad=0.15", "facecolor": "white", "linewidth": 0.5})  # fmt: skip
plotting.matrix_picture(run, right, step=len(run) - 1)
plotting.save_figure(figure, "seven_objects.svg")
