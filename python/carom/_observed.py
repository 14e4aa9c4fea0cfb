"""What is known of a world's state: contacts, events, energy, momenta, and the books."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from carom import _carom
from carom._report import GroupReport
from carom._space import Floats, Records, Space, frozen
from carom.errors import refused


class Observed:
    """The part of a world that tells of its state and of its last step."""

    __slots__ = ()
    _space: ClassVar[Space]
    if TYPE_CHECKING:
        _native: Any

    @property
    def contacts(self) -> Records:
        """Contacts of the last step: a structured array, empty before the first.

        Fields
        ------
        a, b : rows of the two bodies
        id : names the contact from step to step
        point, normal : (d,) at the step's start [m]; unit normal from b to a
        gap : distance of the surfaces at the step's start [m], negative for overlap
        normal_impulse : on a along the normal, over the whole step [N s]
        friction_impulse : (d,) on a, world axes [N s]
        slip : (d,) velocity of a's point against b's across the normal, after the step [m/s]
        status : index into ``carom.CONTACT_STATUS``: apart, sticks, slips, strikes
        friction : coefficient of the pair [1]
        impact_impulse : (d,) what of the impulse is the impacts' at the step's start, on a, world axes [N s]
        kick_normal : (d,) unit normal with which the persistent contact acted
        kick_arm : (d,) from a's centre of mass to the point where it acted [m]; 0 for none
        moment : (1 | 3,) rolling and spinning friction on a, world axes, over the whole step [N m s]
        """
        packed: Records = self._native.contacts().view(self._space.contact_type)
        return packed

    @property
    def event_log(self) -> Records:
        """What the contacts did in the last step, act by act: a structured array, empty before the first step
        and for the scheme "fixed_step".

        Fields
        ------
        act : number of the flow or round of impacts that it is part of; those of one body increase with time
        kind : index into ``carom.EVENT_KINDS``: flow, flow_to_end (friction against the slip at its end),
            impact, rest_cut (an approach too slow to bounce), fallback_impact, fallback_flow, slowed and
            closing (plastic arrivals within the step)
        time, length : when it began, how long it lasted [s]; 0 for impacts
        a, b : rows of the two bodies
        id : names the contact from step to step
        point, normal : (d,) where it acted, half-way through a flow [m]; unit normal from b to a there
        arm_a, arm_b : (d,) from the centres of mass to where the impulse acted [m]
        gap : when it began [m]
        impulse : (d,) on a, world axes [N s]
        moment : (1 | 3,) rolling and spinning friction on a, world axes [N m s]
        friction, restitution, tangential_restitution : coefficients of the pair [1]
        """
        packed: Records = self._native.events().view(self._space.event_type)
        return packed

    @property
    def energy(self) -> dict[str, float]:
        """Energies of all dynamic bodies [J]; potential is zero at the world's origin."""
        translational, rotational, potential = self._native.energy()
        return {
            "kinetic_translational": translational,
            "kinetic_rotational": rotational,
            "potential": potential,
            "total": translational + rotational + potential,
        }

    @property
    def momentum(self) -> Floats:
        """(d,) float64 array, sum of m v [kg m/s]."""
        return frozen(np.array(self._native.momenta()[0]))

    @property
    def angular_momentum(self) -> Any:
        """Sum of x x p + I w about the world's origin, a float | (3,) float64 array [kg m^2/s]."""
        return self._space.plain_spin(self._native.momenta()[1])

    @property
    def ledger(self) -> dict[str, float]:
        """Work by cause since the world began, and the closure [J]."""
        return dict(zip(_carom.LEDGER_LINES, self._native.ledger(), strict=True))

    @property
    def ledger_groups(self) -> dict[str, tuple[str, ...] | None]:
        """Groups of bodies with books of their own: names of their bodies by group, None for all that move.

        Setting them begins their books anew; ``{}`` ends them. Each step's report then has energy, momentum
        and angular momentum by cause for each group (``report.groups``), `group_ledgers` their sums. Groups
        may overlap; those that divide the world add up to it. Snapshots do not have them.

        Raises
        ------
        BuildError
            For a group's name that is empty, or a body that is not there, named twice or an obstacle; the old
            groups stay then.
        """
        return {name: None if of is None else tuple(of) for name, of in self._native.groups()}

    @ledger_groups.setter
    def ledger_groups(self, groups: Mapping[str, Iterable[str] | None]) -> None:
        remedy = "give names of groups, each with names of bodies or None, e.g. {'pile': ['box1', 'box2']}"
        if not isinstance(groups, Mapping):
            raise refused(None, "ledger_groups", "must be a mapping", groups, remedy)
        told: list[tuple[str, list[str] | None]] = []
        for name, of in groups.items():
            plain = None if of is None or isinstance(of, str) else [str(body) for body in of]
            if isinstance(of, str) or not isinstance(name, str):
                raise refused(None, "ledger_groups", "must name lists of bodies", groups, remedy)
            told.append((name, plain))
        self._native.set_groups(told)

    @property
    def group_ledgers(self) -> dict[str, GroupReport]:
        """Books of the `ledger_groups` since these were set; energies and momenta after the last step."""
        return {group.name: group for group in map(GroupReport._told, self._native.group_ledgers())}
