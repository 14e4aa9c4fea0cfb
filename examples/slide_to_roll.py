"""A sphere slides, slows by friction, and rolls: v = 5/7 v0, at t = 2 v0 / (7 mu g)."""

from carom import spatial

w = spatial.World(dt=1 / 1000, tolerance=1e-10)
w.add_static("table", spatial.HalfSpace(normal=(0, 0, 1)), friction=0.2)
w.add_body(
    "ball", spatial.Sphere(0.1), density=1000.0, position=(0, 0, 0.1), velocity=(5, 0, 0), friction=0.2
)

run = w.run(1.0)
print(run)
print("velocity", w["ball"].velocity, "m/s; rolling would be", 5 * 5 / 7)
assert abs(w["ball"].velocity[0] - 25 / 7) < 1e-6
assert abs(w["ball"].angular_velocity[1] * 0.1 - 25 / 7) < 1e-6
