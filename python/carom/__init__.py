"""carom: rigid bodies in the plane and in space that certify what they compute.

>>> from carom import planar
>>> w = planar.World()
>>> floor = w.add_static("floor", planar.HalfPlane())
>>> box = w.add_body("box", planar.Box(1, 1), density=2.0, position=(0, 0.5))
>>> w.step().converged
True

Units are SI throughout; `carom.planar` and `carom.spatial` have the same verbs. What records runs or reads
scene files is loaded when it is first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from carom import _carom, collision, errors, impact, planar, spatial
from carom._certificate import Certificate
from carom._explanation import Explanation, Finding
from carom._friction_problem import FrictionMeasure, FrictionProblem, FrictionSolution
from carom._friction_problem_certificate import FrictionCertificate
from carom._joint import Joint, Reaction
from carom._problem import ContactProblem, Residual, Solution
from carom._report import (
    EventReport,
    GroupReport,
    ImpactReport,
    IslandReport,
    Snapshot,
    StageReport,
    StepReport,
)
from carom._threaded import StepTimes
from carom.errors import (
    BuildError,
    BusyError,
    CaromError,
    EnergyGainError,
    EnergyGainWarning,
    InaccurateError,
    InaccurateWarning,
    RunFileError,
    SceneError,
    SolverError,
    StepError,
    ViewError,
)

if TYPE_CHECKING:
    from carom import gradient
    from carom.advice import Advice, advise
    from carom.comparison import Comparison, compare
    from carom.meshes import load_mesh
    from carom.run import Run
    from carom.scene import Scene, load_scene

__version__: str = _carom.__version__
#: Lines of the energy ledger, in order.
LEDGER_LINES: tuple[str, ...] = tuple(_carom.LEDGER_LINES)
#: Solvers by name.
SOLVERS: tuple[str, ...] = tuple(_carom.SOLVERS)
#: Solvers of friction problems by name.
FRICTION_SOLVERS: tuple[str, ...] = tuple(_carom.FRICTION_SOLVERS)
#: What can happen to a solve above the tolerance.
ON_INACCURATE: tuple[str, ...] = tuple(_carom.ON_INACCURATE)
#: Meaning of the codes of a contact's `status`.
CONTACT_STATUS: tuple[str, ...] = tuple(_carom.CONTACT_STATUS)
#: What a contact does in a step of the scheme "events", by code.
EVENT_KINDS: tuple[str, ...] = tuple(_carom.EVENT_KINDS)

_LATER = {
    "Advice": "carom.advice",
    "advise": "carom.advice",
    "Comparison": "carom.comparison",
    "compare": "carom.comparison",
    "load_mesh": "carom.meshes",
    "Run": "carom.run",
    "Scene": "carom.scene",
    "load_scene": "carom.scene",
}


def build_scene(name: str) -> planar.World | spatial.World:
    """The world of a scene that comes with the engine, by name; `carom scenes` lists them.

    Raises
    ------
    BuildError
        For an unknown name.
    """
    if not any(name == known for known, *_ in _carom.scene_names()):
        raise errors.unknown("scene", str(name), [known for known, *_ in _carom.scene_names()])
    native = _carom.build_scene(name)
    return (
        planar.World._adopt(native)
        if isinstance(native, _carom.PlanarWorld)
        else spatial.World._adopt(native)
    )


def __getattr__(name: str) -> Any:
    if name == "gradient":
        return import_module("carom.gradient")
    if name not in _LATER:
        raise AttributeError(f"module 'carom' has no attribute {name!r}")
    found = getattr(import_module(_LATER[name]), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *_LATER, "gradient"})


__all__ = [
    "CONTACT_STATUS",
    "EVENT_KINDS",
    "FRICTION_SOLVERS",
    "LEDGER_LINES",
    "ON_INACCURATE",
    "SOLVERS",
    "Advice",
    "BuildError",
    "BusyError",
    "CaromError",
    "Certificate",
    "Comparison",
    "ContactProblem",
    "EnergyGainError",
    "EnergyGainWarning",
    "EventReport",
    "Explanation",
    "Finding",
    "FrictionCertificate",
    "FrictionMeasure",
    "FrictionProblem",
    "FrictionSolution",
    "GroupReport",
    "ImpactReport",
    "InaccurateError",
    "InaccurateWarning",
    "IslandReport",
    "Joint",
    "Reaction",
    "Residual",
    "Run",
    "RunFileError",
    "Scene",
    "SceneError",
    "Snapshot",
    "Solution",
    "SolverError",
    "StageReport",
    "StepError",
    "StepReport",
    "StepTimes",
    "ViewError",
    "advise",
    "build_scene",
    "collision",
    "compare",
    "errors",
    "gradient",
    "impact",
    "load_mesh",
    "load_scene",
    "planar",
    "spatial",
]
