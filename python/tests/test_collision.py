"""Single collisions piece by piece (items 16-19), detection, rays, in both spaces."""

from __future__ import annotations

import math

import numpy as np
import pytest
from spaces import PLANE, SPACE, Face, both

from carom import BuildError, collision, planar, spatial
from carom.collision import Side


@both
def test_detection_of_two_balls(face: Face) -> None:
    a, b = face.ball(1.0), face.ball(0.5)
    (found,) = collision.detect(a, face.at(0, 1.4), b, face.at(0, 0))
    assert found.gap == pytest.approx(-0.1)
    assert found.normal == pytest.approx(face.at(0, 1)), "from b to a"
    assert found.point == pytest.approx(face.at(0, 0.45)), "midway between the surfaces"
    assert collision.detect(a, face.at(0, 1.6), b, face.at(0, 0)) == []
    assert collision.detect(a, face.at(0, 1.6), b, face.at(0, 0), margin=0.2)[0].gap == pytest.approx(0.1)


@both
def test_detection_of_a_box_on_a_floor(face: Face) -> None:
    turn = 0.0 if face.dimension == 2 else (1, 0, 0, 0)
    found = collision.detect(face.box(1.0), (face.at(0, 0.49), turn), face.ground(), face.at(0, 0))
    assert len(found) == 2 ** (face.dimension - 1)
    assert [c.gap for c in found] == pytest.approx([-0.01] * len(found))
    assert len({c.feature for c in found}) == len(found)


@both
def test_closest_points_and_rays(face: Face) -> None:
    near = collision.nearest(face.ball(1.0), face.at(5, 0), face.ball(1.0), face.at(0, 0))
    assert near is not None
    assert near.gap == pytest.approx(3.0)
    assert near.point_a == pytest.approx(face.at(4, 0))
    assert near.normal == pytest.approx(face.at(1, 0))
    assert collision.nearest(face.ball(1.0), face.at(5, 0), face.ball(1.0), face.at(0, 0), reach=1.0) is None
    origins = [face.at(-5, 0), face.at(-5, 0.5), face.at(-5, 2)]
    distances, normals = collision.raycast(face.ball(1.0), face.at(0, 0), origins, face.at(3, 0))
    assert distances == pytest.approx([4.0, 5 - math.sqrt(0.75), math.inf])
    assert normals[0] == pytest.approx(face.at(-1, 0))
    assert normals[2].tolist() == [0.0] * face.dimension
    distances, _ = collision.raycast(face.ball(1.0), face.at(0, 0), face.at(-5, 0), face.at(1, 0), reach=2.0)
    assert distances.tolist() == [math.inf]


def test_the_five_steps_of_a_rod_on_the_ground() -> None:
    """A rod of length 1 falls with its end on the ground: m_eff = 1/(1/m + r^2/I) = m/4."""
    mass, inertia, arm = 3.0, 3.0 / 12, np.array([0.5, 0.0])
    rod = Side(arm=arm, velocity=(0, -2), inverse_mass=1 / mass, inverse_inertia=1 / inertia)
    assert collision.offset((1.5, 0), (1.0, 0)).tolist() == [0.5, 0.0]
    speed = collision.normal_velocity((0, 1), rod, None)
    effective = collision.effective_mass((0, 1), rod, None)
    assert speed == -2.0
    assert effective == pytest.approx(mass / 4)
    gamma = collision.normal_impulse(speed, 0.5, effective)
    assert gamma == pytest.approx(1.5 * mass / 4 * 2)
    impulse = gamma * np.array([0, 1])
    velocity, spin = collision.apply_impulse(rod, impulse)
    assert velocity == pytest.approx([0, -2 + gamma / mass])
    assert spin == pytest.approx(0.5 * gamma / inertia)
    assert collision.linear_response(rod, impulse) == pytest.approx(velocity)
    assert collision.angular_response(rod, impulse) == pytest.approx(spin)
    after = collision.collide(rod, None, (0, 1), 0.5)
    assert after.velocity_a == pytest.approx(velocity)
    assert after.angular_velocity_a == pytest.approx(spin)
    assert after.impulse == pytest.approx(gamma)
    left = 0.5 * mass * velocity @ velocity + 0.5 * inertia * spin**2
    assert 0.5 * mass * 4 - left == pytest.approx(collision.energy_lost(speed, 0.5, effective))
    assert collision.normal_impulse(1.0, 0.5, effective) == 0.0


def test_effective_mass_in_space_is_the_formula() -> None:
    draw = np.random.default_rng(3)
    for _ in range(20):
        n = draw.normal(size=3)
        n /= np.linalg.norm(n)
        sides, total = [], 0.0
        for _ in range(2):
            root = draw.normal(size=(3, 3))
            inverse_inertia, inverse_mass, arm = root @ root.T, draw.uniform(0.1, 2), draw.normal(size=3)
            sides.append(Side(arm, None, None, inverse_mass, inverse_inertia))
            lever = np.cross(arm, n)
            total += inverse_mass + float(lever @ inverse_inertia @ lever)
        assert collision.effective_mass(n, *sides) == pytest.approx(1 / total, rel=1e-12)


@both
def test_the_pieces_are_what_a_world_does(face: Face) -> None:
    """Two turned, spinning boxes with one contact: the pieces predict the world's impact (no friction)."""
    w = face.world(gravity=np.zeros(face.dimension), dt=1e-6)
    d = face.dimension
    turn = math.pi / 4 if d == 2 else (0.9, 0.1, 0.3, -0.2)
    corner = w.add_body(
        "corner", face.box(1.0), mass=2.0, position=face.at(0.1, 1.2), rotation=turn, velocity=face.at(0, -3),
        angular_velocity=0.5 if d == 2 else (0.5, -1, 0.2), friction=0.0, restitution=0.5,
    )  # fmt: skip
    block = w.add_body("block", face.box(1.0), mass=5.0, friction=0.0, restitution=0.5)
    shape = corner.shape
    pose = (corner.position, corner.rotation)
    lowest = min(c.gap for c in collision.detect(shape, pose, face.box(1.0), block.position, margin=1.0))
    corner.position = corner.position - np.array(face.at(0, lowest))
    pose = (corner.position, corner.rotation)
    contacts = collision.detect(shape, pose, face.box(1.0), block.position, margin=1e-9)
    assert len(contacts) == 1
    contact = contacts[0]
    sides = Side.of(corner, contact.point), Side.of(block, contact.point)
    wanted = collision.collide(*sides, contact.normal, 0.5)
    assert wanted.impulse > 1.0
    w.step()
    assert corner.velocity == pytest.approx(wanted.velocity_a, abs=1e-4)
    assert corner.angular_velocity == pytest.approx(wanted.angular_velocity_a, abs=1e-4)
    assert block.velocity == pytest.approx(wanted.velocity_b, abs=1e-4)
    assert block.angular_velocity == pytest.approx(wanted.angular_velocity_b, abs=1e-4)
    assert w.contacts["normal_impulse"].sum() == pytest.approx(wanted.impulse, rel=1e-4)


def test_both_modules_have_the_pieces() -> None:
    assert planar.collision is spatial.collision is collision


def test_wrong_arguments_say_what_helps() -> None:
    ball = Side(inverse_mass=1.0)
    with pytest.raises(
        BuildError, match=r"direction must have length 1, got \(0, 2\); divide it by its length"
    ):
        collision.effective_mass((0, 2), ball, None)
    with pytest.raises(BuildError, match=r"normal must be 2 or 3 numbers, got \(1,\); give \(x, y\) or"):
        collision.normal_velocity((1,), ball, None)
    with pytest.raises(BuildError, match=r"a.arm must be 2 numbers, got \(1, 2, 3\)"):
        collision.effective_mass((0, 1), Side(arm=(1, 2, 3)), None)
    with pytest.raises(BuildError, match=r"a.inverse_mass must be finite and >= 0, got -1.0; give 1/mass"):
        collision.effective_mass((0, 1), Side(inverse_mass=-1), None)
    with pytest.raises(BuildError, match=r"restitution must be in \[0, 1\], got 2.0"):
        collision.collide(ball, None, (0, 1), 2)
    with pytest.raises(BuildError, match=r"shape_b.type must be a shape of the planar world, got 'sphere'"):
        collision.detect(PLANE.ball(1), (0, 0), SPACE.ball(1), (0, 0))
    with pytest.raises(BuildError, match="pose_b must be of the same space as pose_a"):
        collision.detect(PLANE.ball(1), (0, 0), SPACE.ball(1), (0, 0, 0))
    with pytest.raises(BuildError, match="directions must not have length 0"):
        collision.raycast(PLANE.ball(1), (0, 0), (1, 1), (0, 0))
    with pytest.raises(BuildError, match=r"shape.radius must be finite and > 0, got -1"):
        collision.raycast(planar.Circle(-1), (0, 0), (1, 1), (0, 1))
