"""The joints of a world: points, distances and poses that are held."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar, cast

from carom._adding import attributed, checked_name
from carom._body import Body
from carom._joint import Joint, joint_arguments
from carom._space import Space

if TYPE_CHECKING:
    from carom._world import World


class Jointed:
    """The part of a world that has joints."""

    __slots__ = ()
    _space: ClassVar[Space]
    if TYPE_CHECKING:
        _native: Any

    def add_point_joint(
        self,
        name: str,
        a: str | Body,
        b: str | Body | None = None,
        *,
        point: Any = None,
        anchor_a: Any = None,
        anchor_b: Any = None,
        collide: bool = False,
    ) -> Joint:
        """Holds a point of a at a point of b, or of the world: a hinge in the plane, a ball joint in space.

        Parameters
        ----------
        name : unlike that of any other joint
        a, b : bodies; without b the world itself
        point : (d,) place of the world where both are held now [m]; or
        anchor_a, anchor_b : (d,) points in the axes of the bodies' shapes, from the shapes' origins [m]; of
            the world a place [m]; where one is left out, it is where the other is
        collide : whether a and b collide with each other

        Raises
        ------
        BuildError
            Naming joint, field, value and remedy; anchors that are more than 1 % of the bodies' size apart
            are refused, smaller distances are closed by the first step. Nothing is added then.

        Constraint and rows: theory chapter 9.
        """
        return self._join({"kind": "point", **{k: v for k, v in locals().items() if k != "self"}})

    def add_distance_joint(
        self,
        name: str,
        a: str | Body,
        b: str | Body | None = None,
        *,
        anchor_a: Any = None,
        anchor_b: Any = None,
        length: float | None = None,
        collide: bool = False,
    ) -> Joint:
        """Keeps the distance of two points, as a rod without mass does.

        Parameters
        ----------
        anchor_a, anchor_b : as for `add_point_joint`; the centres of mass when absent
        length : [m]; the present distance when absent

        Raises
        ------
        BuildError
            As `add_point_joint`.
        """
        return self._join({"kind": "distance", **{k: v for k, v in locals().items() if k != "self"}})

    def add_fixed_joint(
        self,
        name: str,
        a: str | Body,
        b: str | Body | None = None,
        *,
        point: Any = None,
        anchor_a: Any = None,
        anchor_b: Any = None,
        collide: bool = False,
    ) -> Joint:
        """Keeps the present relative pose of a and b, or of a and the world, as a weld does.

        Parameters
        ----------
        point, anchor_a, anchor_b : where its force acts, as for `add_point_joint`; a's centre of mass when
            all are absent

        Raises
        ------
        BuildError
            As `add_point_joint`, and for bodies that nothing turns.
        """
        return self._join({"kind": "fixed", **{k: v for k, v in locals().items() if k != "self"}})

    def _join(self, given: dict[str, Any]) -> Joint:
        bodies = {key: g.name if isinstance(g := given[key], Body) else g for key in ("a", "b")}
        given = given | bodies
        checked_name(given["name"], "joint")
        with attributed(given):
            self._native.add_joint(given["name"], joint_arguments(given, self._space))
        return self._joint(given["name"])

    def remove_joint(self, name: str | Joint) -> None:
        """Removes a joint.

        Raises
        ------
        BuildError
            When there is no such joint.
        """
        self._native.remove_joint(name.name if isinstance(name, Joint) else name)

    @property
    def joints(self) -> dict[str, Joint]:
        """The joints by name, in the order in which they were added."""
        return {name: self._joint(name) for name in self._native.joint_names()}

    def _joint(self, name: str) -> Joint:
        return Joint(cast("World", self), name)
