"""The world in both spaces: bodies, settings, steps, energies, contacts."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from spaces import PLANE, SPACE, Face, both

import carom
from carom import BuildError, planar, spatial

G = 9.81


@both
def test_free_fall_is_exact(face: Face) -> None:
    w = face.world(dt=0.01)
    ball = w.add_body(
        "ball", face.ball(0.1), mass=2.0, position=face.at(1.0, 5.0), velocity=face.at(3.0, 4.0)
    )
    for _ in range(50):
        report = w.step()
    t = 0.5
    assert report.time == pytest.approx(t)
    assert ball.position == pytest.approx(face.at(1 + 3 * t, 5 + 4 * t - G * t * t / 2), abs=1e-12)
    assert ball.velocity == pytest.approx(face.at(3.0, 4 - G * t), abs=1e-12)
    assert report.converged
    assert report.contacts == 0
    assert report.deepest_gap is None
    assert report.worst_contact is None


@both
def test_names_serve_as_indices(face: Face) -> None:
    w = face.stack(3)
    assert w.names == ("floor", "box0", "box1", "box2")
    assert len(w) == 4
    assert "box1" in w
    assert "box9" not in w
    assert [body.name for body in w] == list(w.names)
    box = w["box2"]
    assert box.index == 3
    assert w.position[box].tolist() == list(face.at(0, 2.5))
    w.remove("box0")
    assert box.index == 2
    assert w.names == ("floor", "box1", "box2")
    w.remove(box)
    assert "box2" not in w
    with pytest.raises(BuildError, match="name is not in this world; did you mean 'box1'"):
        _ = box.position


@both
def test_settings_are_attributes(face: Face) -> None:
    w = face.world(solver="lemke", iterations=7, dt=1 / 60)
    assert (w.solver, w.iterations, w.dt) == ("lemke", 7, 1 / 60)
    w.solver = "pgs_matrix"
    w.tolerance = 1e-9
    w.gravity = np.zeros(face.dimension)
    w.impact = carom.impact.Sequential()
    w.contact_margin = 0.01
    assert w.settings["solver"] == "pgs_matrix"
    assert w.settings["tolerance"] == 1e-9
    assert w.gravity == [0.0] * face.dimension
    assert w.impact == "sequential"
    w.contact_margin = None
    assert w.contact_margin is None
    assert set(w.settings) == {
        name for name in dir(type(w)) if type(getattr(type(w), name)).__name__ == "Setting"
    }


@both
def test_one_step_takes_its_own_length(face: Face) -> None:
    w = face.world(dt=0.1)
    w.add_body("p", mass=1.0)
    assert w.step(0.25).dt == 0.25
    assert w.time == 0.25
    assert w.step().dt == 0.1


def test_energies_and_momenta_of_a_known_state() -> None:
    w = planar.World(gravity=(0, -10))
    body = w.add_body(
        "disc", planar.Circle(2.0), mass=3.0, position=(1, 4), velocity=(5, 0), angular_velocity=0.5
    )
    inertia = 0.5 * 3.0 * 4.0
    assert body.inertia == pytest.approx(inertia)
    assert body.kinetic_energy == pytest.approx((0.5 * 3 * 25, 0.5 * inertia * 0.25))
    assert body.kinetic_energy.total == pytest.approx(37.5 + 0.75)
    assert body.momentum.tolist() == [15.0, 0.0]
    assert body.spin_momentum == pytest.approx(3.0)
    assert body.angular_momentum == pytest.approx(1 * 0 - 4 * 15 + 3.0)
    assert w.energy == pytest.approx(
        {"kinetic_translational": 37.5, "kinetic_rotational": 0.75, "potential": 120.0, "total": 158.25}
    )
    assert w.momentum.tolist() == [15.0, 0.0]
    assert w.angular_momentum == pytest.approx(-57.0)


def test_energies_and_momenta_of_a_turned_cuboid() -> None:
    w = spatial.World()
    half = math.sqrt(0.5)
    body = w.add_body(
        "b",
        spatial.Box(1, 2, 3),
        mass=12.0,
        rotation=(half, 0, 0, half),
        angular_velocity=(1, 0, 2),
        position=(1, 0, 0),
    )
    ixx, iyy, izz = 13.0, 10.0, 5.0
    assert np.diag(body.inertia) == pytest.approx([ixx, iyy, izz])
    # a quarter turn about z puts the body's y axis along -x of the world
    assert body.spin_momentum == pytest.approx([iyy * 1, 0, izz * 2])
    assert body.kinetic_energy.rotational == pytest.approx(0.5 * (iyy + izz * 4))
    assert body.inertia_about((1, 0, 0)) == pytest.approx(iyy)
    assert body.inertia_about((0, 0, 3), (1, 3, 0)) == pytest.approx(izz + 12 * 9)
    body.set_momenta((24, 0, 0), (0, 0, 10))
    assert body.velocity.tolist() == [2, 0, 0]
    assert body.angular_velocity == pytest.approx([0, 0, 2])
    assert body.angular_momentum == pytest.approx([0, 0, 10])


@both
def test_points_of_a_moving_body(face: Face) -> None:
    w = face.world()
    turn = 0.3 if face.dimension == 2 else (math.cos(0.15), 0, -math.sin(0.15), 0)
    body = w.add_body(
        "b", face.box(1.0), mass=1.0, position=face.at(2, 3), rotation=turn, velocity=face.at(1, -1),
        angular_velocity=face.spin(2.0 if face.dimension == 2 else -2.0),
    )  # fmt: skip
    point = body.to_world(face.at(0.5, 0.0))
    assert point == pytest.approx(face.at(2 + 0.5 * math.cos(0.3), 3 + 0.5 * math.sin(0.3)), abs=1e-14)
    assert body.to_body(point) == pytest.approx(face.at(0.5, 0.0), abs=1e-14)
    wanted = face.at(1 - 2 * 0.5 * math.sin(0.3), -1 + 2 * 0.5 * math.cos(0.3))
    assert body.velocity_at(point) == pytest.approx(wanted, abs=1e-14)


@both
def test_loads_act_for_one_step_and_impulses_at_once(face: Face) -> None:
    w = face.world(gravity=np.zeros(face.dimension), dt=0.5)
    body = w.add_body("b", face.box(1.0), mass=6.0)
    body.apply_impulse(face.at(3.0, 0.0), at=face.at(0.0, 0.5))
    spin = -3.0 * 0.5 / 1.0 if face.dimension == 2 else (0.0, 3.0 * 0.5 / 1.0, 0.0)
    assert body.velocity == pytest.approx(face.at(0.5, 0.0))
    assert body.angular_velocity == pytest.approx(spin)
    body.velocity = np.zeros(face.dimension)
    body.angular_velocity = np.zeros(3) if face.dimension == 3 else 0.0
    body.apply_force(face.at(12.0, 0.0))
    body.apply_torque(face.spin(4.0))
    w.step()
    w.step()
    assert body.velocity == pytest.approx(face.at(1.0, 0.0))
    assert body.angular_velocity == pytest.approx(face.spin(2.0))


@both
def test_origin_places_the_shape_and_position_its_centre(face: Face) -> None:
    w = face.world()
    parts = [(face.box(1.0), face.at(0, 0)), (face.box(1.0), face.at(1, 0))]
    by_origin = w.add_body("o", face.module.Compound(parts), density=1.0, origin=face.at(4, 0))
    by_centre = w.add_body("c", face.module.Compound(parts), density=1.0, position=face.at(4, 0))
    assert by_origin.mass_properties.center_of_mass == pytest.approx(face.at(0.5, 0))
    assert by_origin.position == pytest.approx(face.at(4.5, 0))
    assert by_centre.position == pytest.approx(face.at(4, 0))


@both
def test_obstacles_do_not_yield(face: Face) -> None:
    w = face.world()
    floor = w.add_static("floor", face.ground())
    plate = w.add_kinematic("plate", face.box(1.0), position=face.at(0, 9), velocity=face.at(2, 0))
    assert (floor.kind, plate.kind) == ("static", "kinematic")
    assert floor.mass == plate.mass == math.inf
    assert floor.kinetic_energy.total == 0.0
    for _ in range(10):
        w.step(0.1)
    assert plate.position == pytest.approx(face.at(2, 9))
    assert floor.position == pytest.approx(face.at(0, 0))


@both
def test_a_particle_touches_nothing_and_does_not_turn(face: Face) -> None:
    w = face.world(dt=0.1)
    w.add_static("floor", face.ground())
    particle = w.add_body("p", mass=0.5, position=face.at(0, 0.01))
    w.step()
    assert particle.shape is None
    assert np.all(np.asarray(particle.inertia) == 0)
    assert particle.position[-1] == pytest.approx(0.01 - 0.5 * G * 0.01)


@both
def test_contacts_carry_the_impulses_that_changed_the_momenta(face: Face) -> None:
    """Per body: m dv = m g h + impulses, over a step with impacts, friction and resting contacts at once."""
    w = face.pile(8, dt=1 / 240)
    gravity = np.array(w.gravity)
    seen: set[int] = set()
    for _ in range(400):
        before = w.velocity.copy()
        w.step()
        contacts = w.contacts
        total = np.zeros_like(before)
        push = contacts["normal"] * contacts["normal_impulse"][:, None] + contacts["friction_impulse"]
        np.add.at(total, contacts["a"], push)
        np.add.at(total, contacts["b"], -push)
        mass = w.mass[1:, None]
        change = mass * (w.velocity[1:] - before[1:] - gravity * w.dt)
        assert np.abs(change - total[1:]).max() < 1e-11 * mass.max()
        seen |= set(contacts["status"].tolist())
    assert seen == {0, 1, 2, 3}, "apart, sticking, slipping and striking contacts all occurred"


@both
def test_contacts_of_a_box_at_rest(face: Face) -> None:
    w = face.stack(1, tolerance=1e-10)
    for _ in range(10):
        w.step()
    contacts = w.contacts
    assert contacts.dtype.names == (
        "a", "b", "id", "point", "normal", "gap", "normal_impulse", "friction_impulse", "slip", "status",
        "friction", "impact_impulse", "kick_normal", "kick_arm", "moment",
    )  # fmt: skip
    assert len(contacts) == 2 ** (face.dimension - 1)
    assert len(set(contacts["id"])) == len(contacts)
    up = np.zeros(face.dimension)
    up[-1] = 1.0
    towards = np.where(contacts["a"] == w["box0"].index, 1.0, -1.0)
    assert contacts["normal"] == pytest.approx(towards[:, None] * up)
    weight = w["box0"].mass * G * w.dt
    assert contacts["normal_impulse"].sum() == pytest.approx(weight, rel=1e-6)
    assert np.abs(contacts["slip"]).max() < 1e-8
    assert {carom.CONTACT_STATUS[code] for code in contacts["status"]} == {"sticks"}
    assert np.abs(contacts["gap"]).max() < 1e-4


@both
def test_the_report_names_the_worst_contact_and_closes_the_books(face: Face) -> None:
    w = face.pile(6, iterations=3)
    lines = dict.fromkeys(carom.LEDGER_LINES, 0.0)
    start = w.energy["total"]
    reasons = set()
    for _ in range(300):
        report = w.step()
        for name, work in report.ledger.items():
            lines[name] += work
        if report.residual > 0:
            assert set(report.worst_contact) <= set(w.names)
        assert abs(report.closure) < 1e-9 * start
        assert report.energy == pytest.approx(w.energy["total"])
        assert report.momentum == pytest.approx(w.momentum.tolist())
        reasons.add(report.stop_reason)
        assert report.converged == (report.stop_reason == "converged")
    assert reasons == {"converged", "out_of_iterations"}
    assert w.ledger == pytest.approx(lines, rel=1e-9, abs=1e-9)
    changes = [work for name, work in lines.items() if name not in ("gravity", "closure")]
    assert w.energy["total"] - start == pytest.approx(sum(changes), abs=1e-9 * start)


@both
def test_collision_groups_and_masks(face: Face) -> None:
    w = face.world()
    w.add_static("floor", face.ground(), collision_groups=0b01)
    meets = w.add_body("meets", face.ball(0.5), mass=1.0, position=face.at(0, 0.5), collision_mask=0b01)
    falls = w.add_body("falls", face.ball(0.5), mass=1.0, position=face.at(3, 0.5), collision_mask=0b10)
    for _ in range(24):
        w.step()
    assert meets.position[-1] == pytest.approx(0.5, abs=1e-4)
    assert falls.position[-1] == pytest.approx(0.5 - 0.5 * G * 0.01, abs=1e-9)


@both
def test_damping_is_exponential(face: Face) -> None:
    w = face.world(gravity=np.zeros(face.dimension), dt=0.1)
    body = w.add_body(
        "b",
        face.ball(1.0),
        mass=1.0,
        velocity=face.at(1, 0),
        angular_velocity=face.spin(1.0),
        linear_damping=2.0,
        angular_damping=3.0,
    )
    w.step()
    assert body.velocity[0] == pytest.approx(math.exp(-0.2))
    assert body.angular_velocity == pytest.approx(np.multiply(face.spin(1.0), math.exp(-0.3)))
    assert (body.linear_damping, body.angular_damping) == (2.0, 3.0)


def test_rotations_in_all_their_forms() -> None:
    w = planar.World()
    body = w.add_body("b", planar.Box(1, 1), mass=1.0, rotation=0.5)
    assert body.angle == pytest.approx(0.5)
    body.rotation = (0.0, 2.0)
    assert body.rotation.tolist() == [0.0, 1.0]
    body.rotation = np.float64(-1.0)
    assert body.angle == pytest.approx(-1.0)
    s = spatial.World()
    ball = s.add_body("b", spatial.Sphere(1), mass=1.0, rotation=(0, 0, 0, 5))
    assert ball.rotation.tolist() == [0, 0, 0, 1]
    with pytest.raises(AttributeError, match="space has no single angle"):
        _ = ball.angle


def test_what_a_body_was_made_of_can_be_read_back() -> None:
    w = spatial.World()
    shape = spatial.RoundCylinder(1.0, 0.3, rounding=0.05)
    body = w.add_body(
        "b",
        shape,
        mass=2.0,
        friction=0.25,
        restitution=0.75,
        collision_groups=6,
        collision_mask=3,
        can_rotate=False,
    )
    assert body.shape == shape
    assert (body.friction, body.restitution, body.collision_groups, body.collision_mask) == (0.25, 0.75, 6, 3)
    assert body.world is w
    assert body == w["b"]
    assert len({body, w["b"]}) == 1


@pytest.mark.parametrize("name", ["bouncing_ball_planar", "bouncing_ball_spatial"])
def test_scenes_of_the_engine(name: str) -> None:
    w = carom.build_scene(name)
    assert isinstance(w, planar.World if name.endswith("planar") else spatial.World)
    w.step()
    assert w.time == w.dt
    with pytest.raises(BuildError, match=f"did you mean '{name}'"):
        carom.build_scene(name + "s")


def test_reprs_say_what_is_there() -> None:
    w = PLANE.stack(2)
    report = w.step()
    assert repr(w) == "<planar.World 3 bodies (1 obstacles), t = 0.00416667 s, solver nncg>"
    assert repr(w["box1"]).startswith("<dynamic body 'box1': box, mass 2 kg, position (")
    assert repr(w["floor"]).startswith("<static body 'floor': half_plane, position (0, 0) m")
    assert "4 contacts, residual" in repr(report)
    assert repr(w.snapshot()).startswith("<Snapshot planar, 3 bodies, t = 0.00416667 s")
    assert repr(w.problem()) == "<planar ContactProblem: 4 contacts between 3 bodies>"
    assert repr(SPACE.world()) == "<spatial.World 0 bodies, t = 0 s, solver nncg>"
    assert repr(planar.Box(1, 2)) == "Box(1, 2)"
    assert repr(planar.HeightField([0, 1], 3)) == "HeightField(heights=[0, 1], width=3)"
    assert repr(carom.impact.Newton()) == "Newton()"
    assert repr(w["box0"].mass_properties).startswith("MassProperties(mass=2 kg, center_of_mass=[0.0, 0.0] m")


def test_a_run_comes_out_of_the_world() -> None:
    w = PLANE.stack(3)
    run = w.run(0.25, solver="lemke", every=6)
    assert len(run.steps) == 60
    assert run.position[:, w["box2"], 1] == pytest.approx(2.5, abs=1e-3)
    assert w.solver is None
    assert w.last_run is run
    contacts = run.contacts.at(t=0.2)
    assert set(contacts["a"].tolist()) | set(contacts["b"].tolist()) == {0, 1, 2, 3}
    assert run.steps.dtype["angular_momentum"].shape == ()
    assert SPACE.stack(1).run(0.02).steps.dtype["angular_momentum"].shape == (3,)


def test_a_failure_inside_a_run_keeps_what_was_done() -> None:
    w = planar.World()
    w.add_body("p", mass=1.0)

    def fails(time: float, position: Any, velocity: Any) -> Any:
        if time > 0.1:
            raise LookupError("the table ends here")
        return np.zeros_like(position)

    w.add_force("table", fails)
    with pytest.raises(LookupError, match="the table ends here"):
        w.run(1.0)
    assert w.last_run is not None
    assert len(w.last_run.steps) == round(0.1 / w.dt)
    assert w.time == pytest.approx(0.1, abs=w.dt)
