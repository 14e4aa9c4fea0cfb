"""The scene document: world settings, materials, bodies; one model for the plane and one for space.

Defaults of the engine are not repeated here: a setting that the file leaves out is left to the engine.
Units are SI and stated in each description. Knows no files and no worlds.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import Field, TypeAdapter, model_validator

from carom.scene.bodies import (
    COEFFICIENTS,
    BodyCommon,
    Material,
    MaterialPair,
    PlanarBody,
    PlanarJoint,
    SpatialBody,
    SpatialJoint,
)
from carom.scene.fields import (
    Fraction,
    Name,
    NotNegative,
    Positive,
    Strict,
    Switch,
    Vector2,
    Vector3,
    refuse,
)
from carom.scene.suggest import did_you_mean

#: Version of the scene format that this code reads and writes [1].
SCHEMA_VERSION = 1

Integrator = Literal["trapezoid", "explicit_euler", "semi_implicit_euler", "implicit_midpoint", "rk4"]
Scheme = Literal["fixed_step", "events", "soft_step"]
Solver = Literal[
    "sequential", "pgs", "pgs_matrix", "direct", "lemke", "nncg", "apgd", "enumeration", "exact", "auto"
]  # fmt: skip
OnInaccurate = Literal["ignore", "warn", "raise", "escalate"]
ImpactLaw = Literal["generalized_reflections", "newton", "sequential", "moreau", "poisson"]
EnergyGuard = Literal["warn", "clamp", "raise"]
PlasticArrivals = Literal["at_their_moment", "within_the_step"]
Mixing = Literal["min", "max", "mean", "product", "geometric", "harmonic"]


class EventSettings(Strict):
    """Choices of the scheme "events"."""

    touching: Fraction | None = Field(
        default=None,
        description="Gap up to which bodies touch, over the smaller one's size [1]; 1e-5 when absent.",
    )
    rest_speed_factor: NotNegative | None = Field(
        default=None,
        description="Impacts slower than factor x |gravity| x dt do not bounce [1]; 0.05 when absent.",
    )
    tolerance: NotNegative | None = Field(
        default=None, description="Residual that solves aim at, over |gravity| x dt [1]; 1e-12 when absent."
    )
    slip_stops: Annotated[int, Field(strict=True, ge=0)] | None = Field(
        default=None, description="Stops of slips found per step and island [1]; 16 when absent."
    )
    cap: Annotated[int, Field(strict=True, ge=1)] | None = Field(
        default=None,
        description="Events in a row after which a step's rest is taken at once [1]; derived when absent.",
    )
    overlap: Fraction | None = Field(
        default=None,
        description="Overlap that is projected away, over the smaller body's size [1]; 1e-9 when absent.",
    )
    plastic_arrivals: PlasticArrivals | None = Field(
        default=None,
        description='How contacts that do not bounce arrive: "at_their_moment" when absent, or '
        '"within_the_step", slowed where a flow begins: for heaps.',
    )
    warm_start: Switch | None = Field(
        default=None, description="Whether flows start from the forces before; false when absent."
    )


class SoftSettings(Strict):
    """Choices of the scheme "soft_step"."""

    substeps: Annotated[int, Field(strict=True, ge=1, le=1000)] | None = Field(
        default=None, description="Substeps of a step [1]; 6 when absent."
    )
    hertz: NotNegative | None = Field(
        default=None,
        description="Frequency of the springs between bodies that move [Hz], twice that with obstacles; "
        "38 when absent.",
    )
    damping_ratio: NotNegative | None = Field(
        default=None, description="Damping ratio of the springs [1]; 10 when absent."
    )
    push_speed: NotNegative | None = Field(
        default=None, description="Overlaps are not pushed apart faster than this [m/s]; 3 when absent."
    )
    sleeping: Switch | None = Field(
        default=None,
        description="Whether islands of bodies that rest on obstacles fall asleep; false when absent.",
    )
    sleep_speed: NotNegative | None = Field(
        default=None,
        description="Bodies rest while their surfaces' mean speed is below this [m/s]; 0.01 when absent.",
    )
    sleep_time: NotNegative | None = Field(
        default=None, description="For how long an island must have rested [s]; 0.5 when absent."
    )


class SettingsCommon(Strict):
    """Settings that the plane and space share."""

    dt: Positive | None = Field(default=None, description="Time step [s]; 1/240 when absent.")
    integrator: Integrator | None = Field(default=None, description='Integrator; "trapezoid" when absent.')
    scheme: Scheme | None = Field(
        default=None, description='Time-stepping scheme: "fixed_step" (when absent), "events" or "soft_step".'
    )
    events: EventSettings | None = Field(default=None, description='Choices of the scheme "events".')
    soft: SoftSettings | None = Field(default=None, description='Choices of the scheme "soft_step".')
    solver: Solver | None = Field(
        default=None,
        description='Contact solver; the scheme\'s own when absent: "nncg" | "exact" for "events" | springs '
        'for "soft_step", where "pgs" and "nncg" sweep rigid contacts.',
    )
    iterations: Annotated[int, Field(strict=True, ge=1, le=10_000_000)] | None = Field(
        default=None, description="Most iterations of the solver in a step [1]; 100 when absent."
    )
    tolerance: NotNegative | None = Field(
        default=None,
        description="Residual at which the solver stops [m/s]; 1e-6 when absent, 0 spends all iterations.",
    )
    factorisations: Annotated[int, Field(strict=True, ge=0)] | None = Field(
        default=None, description="Most factorisations of the solver in a step [1]; 2000 when absent."
    )
    impulses: Literal["any", "minimum_norm"] | None = Field(
        default=None, description='Which of several impulses that solve a step; "any" when absent.'
    )
    on_inaccurate: OnInaccurate | None = Field(
        default=None, description='What happens to a solve above the tolerance; "warn" when absent.'
    )
    warm_start: Switch | None = Field(
        default=None, description="Whether a step starts from the last one's impulses; true when absent."
    )
    friction_law: Literal["disc", "box"] | None = Field(
        default=None, description='True Coulomb disc or the notes\' box; "disc" when absent.'
    )
    impact: ImpactLaw | None = Field(
        default=None,
        description='Law of impacts; the scheme\'s own when absent: "newton" for "fixed_step", '
        '"generalized_reflections" for "events".',
    )
    energy_guard: EnergyGuard | None = Field(
        default=None, description='What happens to impacts that would gain energy; "clamp" when absent.'
    )
    rest_speed_factor: NotNegative | None = Field(
        default=None,
        description="Impacts slower than factor x |gravity| x dt do not bounce [1]; 2 when absent.",
    )
    position_correction: Literal["split_impulse", "nudge", "none"] | None = Field(
        default=None, description='How overlap is removed; "split_impulse" when absent.'
    )
    correction_fraction: Fraction | None = Field(
        default=None, description="Fraction of the overlap removed in a step [1]; 0.05 when absent."
    )
    correction_slop: NotNegative | None = Field(
        default=None,
        description="Overlap that is left alone [m]; derived from the smallest size when absent.",
    )
    contact_margin: NotNegative | None = Field(
        default=None, description="Gap below which contacts are looked for [m]; derived when absent."
    )
    friction_mixing: Mixing | None = Field(
        default=None, description='How two friction coefficients combine; "geometric" when absent.'
    )
    restitution_mixing: Mixing | None = Field(
        default=None,
        description='How two coefficients of restitution combine, normal or tangential; "max" when absent.',
    )


class PlanarSettings(SettingsCommon):
    """Settings of a world of the plane."""

    gravity: Vector2 | None = Field(default=None, description="Gravity [m/s^2]; (0, -9.81) when absent.")


class SpatialSettings(SettingsCommon):
    """Settings of a world of space."""

    gravity: Vector3 | None = Field(default=None, description="Gravity [m/s^2]; (0, 0, -9.81) when absent.")


class SceneCommon(Strict):
    """What scenes of the plane and of space have in common."""

    schema_version: Literal[1] = Field(description="Version of this format; 1.")
    name: Annotated[str, Field(max_length=200)] = Field(default="", description="Name of the scene.")
    description: Annotated[str, Field(max_length=10_000)] = Field(
        default="", description="What the scene shows."
    )
    duration: Positive = Field(default=5.0, description="Simulated time of a run when none is asked for [s].")
    materials: dict[Name, Material] = Field(default={}, description="Materials by name.")
    pair: Annotated[list[MaterialPair], Field(max_length=10_000)] = Field(
        default=[], description="Coefficients of pairs of materials, in place of mixing."
    )

    def _check_bodies(self, bodies: list[Any]) -> None:
        """Rules between bodies: materials exist, names are unique, dynamic bodies have a mass."""
        seen: dict[str, int] = {}
        for index, body in enumerate(bodies):
            self._check_body(index, body)
            if body.name in seen:
                raise refuse(
                    f"body.{index}.name",
                    f"name {body.name!r} is taken by body {seen[body.name] + 1}",
                    "choose another",
                )
            seen[body.name] = index

    def _check_joints(self, joints: list[Any]) -> None:
        """Names of joints are unique; their bodies are found when the world is built, copies included."""
        seen: dict[str, int] = {}
        for index, joint in enumerate(joints):
            other = seen.setdefault(joint.name, index)
            if other != index:
                problem = f"name {joint.name!r} is taken by joint {other + 1}"
                raise refuse(f"joint.{index}.name", problem, "choose another")

    def _check_pairs(self) -> None:
        """Rules of pairs: materials exist, something is said, and only once of a pair."""
        seen: dict[frozenset[str], int] = {}
        for index, pair in enumerate(self.pair):
            for name in pair.materials:
                if name not in self.materials:
                    hint = did_you_mean(name, self.materials) or "add it to [materials]"
                    raise refuse(f"pair.{index}.materials", f"unknown material {name!r}", hint)
            if not pair.coefficients():
                remedy = "give one of " + ", ".join(COEFFICIENTS)
                raise refuse(f"pair.{index}", "a pair needs a coefficient", remedy)
            other = seen.setdefault(frozenset(pair.materials), index)
            if other != index:
                problem = f"this pair of materials is that of pair {other + 1}"
                raise refuse(f"pair.{index}.materials", problem, "say it once")

    def _check_body(self, index: int, body: Any) -> None:
        if body.material is not None and body.material not in self.materials:
            hint = did_you_mean(body.material, self.materials) or "add it to [materials]"
            raise refuse(f"body.{index}.material", f"unknown material {body.material!r}", hint)
        material = self.materials.get(body.material) if body.material is not None else None
        has_density = body.density is not None or (material is not None and material.density is not None)
        if body.kind == "dynamic" and body.mass is None and not has_density:
            unit = "kg/m^2" if isinstance(body, PlanarBody) else "kg/m^3"
            remedy = f"give density [{unit}], mass [kg] or a material with density"
            raise refuse(f"body.{index}", "a dynamic body needs its mass or density", remedy)


class PlanarScene(SceneCommon):
    """A scene of the plane: (x, y) and an angle."""

    space: Literal["planar"] = Field(description="planar: (x, y, angle); spatial: (x, y, z, quaternion).")
    world: PlanarSettings = Field(default=PlanarSettings(), description="Settings of the world.")
    body: Annotated[list[PlanarBody], Field(min_length=1, max_length=100_000)] = Field(description="Bodies.")
    joint: Annotated[list[PlanarJoint], Field(max_length=100_000)] = Field(
        default=[], description="Joints between bodies, or of bodies with the world."
    )

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        self._check_bodies(self.body)
        self._check_joints(self.joint)
        self._check_pairs()
        return self


class SpatialScene(SceneCommon):
    """A scene of space: (x, y, z) and a quaternion (w, x, y, z)."""

    space: Literal["spatial"] = Field(description="planar: (x, y, angle); spatial: (x, y, z, quaternion).")
    world: SpatialSettings = Field(default=SpatialSettings(), description="Settings of the world.")
    body: Annotated[list[SpatialBody], Field(min_length=1, max_length=100_000)] = Field(description="Bodies.")
    joint: Annotated[list[SpatialJoint], Field(max_length=100_000)] = Field(
        default=[], description="Joints between bodies, or of bodies with the world."
    )

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        self._check_bodies(self.body)
        self._check_joints(self.joint)
        self._check_pairs()
        return self


SceneDocument = Annotated[PlanarScene | SpatialScene, Field(discriminator="space")]
DOCUMENT: TypeAdapter[PlanarScene | SpatialScene] = TypeAdapter(SceneDocument)

__all__ = [
    "DOCUMENT",
    "SCHEMA_VERSION",
    "BodyCommon",
    "PlanarScene",
    "PlanarSettings",
    "SceneDocument",
    "SpatialScene",
    "SpatialSettings",
]
