"""Building blocks of the scene models: finite numbers, vectors, rotations, names.

Every number is finite (TOML and JSON readers both let nan and inf through) and no text is taken for a number.
Rotations: in the plane an angle; in space q = [w, x, y, z], or axis and angle, or Euler angles about the
fixed x, then y, then z axis (R = Rz Ry Rx). Knows nothing of files or worlds.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Self

import numpy as np
from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    GetJsonSchemaHandler,
    StringConstraints,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError

Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0)]
NotNegative = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0)]
Fraction = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0, le=1)]
Count = Annotated[int, Field(strict=True, ge=1)]
Index = Annotated[int, Field(strict=True, ge=0, lt=2**32)]
Bits = Annotated[int, Field(strict=True, ge=0, lt=2**32)]
Switch = Annotated[bool, Field(strict=True)]
Vector2 = tuple[Number, Number]
Vector3 = tuple[Number, Number, Number]
Sizes2 = tuple[Positive, Positive]
Sizes3 = tuple[Positive, Positive, Positive]
Name = Annotated[str, StringConstraints(min_length=1, max_length=200, pattern=r"^[^\x00-\x1f\x7f]+$")]

#: Most points that one shape may list in a scene file [1]; larger geometry belongs into a mesh file.
MOST_POINTS = 100_000


def refuse(key: str, problem: str, remedy: str) -> PydanticCustomError:
    """An error for a rule between fields: `key` is the field to point at (dots go deeper)."""
    text = f"{problem}; {remedy}".replace("{", "{{").replace("}", "}}")
    return PydanticCustomError("scene_rule", text, {"key": key, "problem": problem, "remedy": remedy})


class Strict(BaseModel):
    """Base of all scene models: unknown keys are errors, values do not change after checking."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class PlanarRotation(Strict):
    """A turn in the plane, counter-clockwise: a number [rad] or ``{ degrees = ... }``."""

    angle: Number | None = Field(default=None, description="Angle, counter-clockwise [rad].")
    degrees: Number | None = Field(default=None, description="Angle, counter-clockwise [degrees].")

    @model_validator(mode="before")
    @classmethod
    def _from_number(cls, value: Any) -> Any:
        if isinstance(value, dict):
            return value
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            return {"angle": value}
        raise refuse(
            "",
            f"rotation must be an angle, got {value!r}",
            "write rotation = 0.5 [rad] or rotation = { degrees = 30 }",
        )

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        if (self.angle is None) == (self.degrees is None):
            raise refuse(
                "", "rotation needs exactly one of angle, degrees", "write rotation = { degrees = 30 }"
            )
        return self

    @property
    def radians(self) -> float:
        """The angle [rad]."""
        return self.angle if self.angle is not None else math.radians(self.degrees or 0.0)

    def stored(self) -> list[float]:
        """[cos, sin] of the angle, the form in which the core stores a turn."""
        return [math.cos(self.radians), math.sin(self.radians)]

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """The short form beside the table."""
        table = handler.resolve_ref_schema(handler(core)).copy()
        return {"anyOf": [{"type": "number", "description": "Angle, counter-clockwise [rad]."}, table]}


class SpatialRotation(Strict):
    """A rotation from body axes to world axes: ``[w, x, y, z]``, or a table in one of three forms.

    ``{ axis = [0, 0, 1], angle = 0.5 }`` [rad], ``{ axis = [0, 0, 1], degrees = 30 }`` or
    ``{ euler_xyz_degrees = [0, 90, 0] }`` (about the fixed x, then y, then z axis).
    """

    quaternion: tuple[Number, Number, Number, Number] | None = Field(
        default=None, description="Quaternion [w, x, y, z]; brought to unit length."
    )
    axis: Vector3 | None = Field(default=None, description="Axis of the turn, any length [1].")
    angle: Number | None = Field(default=None, description="Angle about the axis [rad].")
    degrees: Number | None = Field(default=None, description="Angle about the axis [degrees].")
    euler_xyz_degrees: Vector3 | None = Field(
        default=None, description="Angles about the fixed x, then y, then z axis [degrees]."
    )

    @model_validator(mode="before")
    @classmethod
    def _from_list(cls, value: Any) -> Any:
        if isinstance(value, dict):
            return value
        if isinstance(value, (list, tuple)):
            return {"quaternion": value}
        raise refuse(
            "",
            f"rotation must be a quaternion or a table, got {value!r}",
            "write rotation = [w, x, y, z] or rotation = { axis = [0, 0, 1], degrees = 30 }",
        )

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        forms = [self.quaternion is not None, self.axis is not None, self.euler_xyz_degrees is not None]
        help_text = "write [w, x, y, z], { axis = [..], degrees = .. } or { euler_xyz_degrees = [..] }"
        if sum(forms) != 1:
            raise refuse("", "rotation needs exactly one of quaternion, axis, euler_xyz_degrees", help_text)
        if (self.axis is not None) != (self.angle is not None or self.degrees is not None):
            raise refuse("", "rotation: axis and its angle belong together", help_text)
        if self.angle is not None and self.degrees is not None:
            raise refuse("degrees", "rotation has both angle and degrees", "give one of them")
        for key, vector in (("quaternion", self.quaternion), ("axis", self.axis)):
            if vector is not None and math.hypot(*vector) < 1e-12:
                raise refuse(key, f"rotation: {key} must not be zero, got {list(vector)}", "give a direction")
        return self

    def stored(self) -> list[float]:
        """Unit quaternion [w, x, y, z], the form in which the core stores a rotation."""
        if self.quaternion is not None:
            length = math.hypot(*self.quaternion)
            return [part / length for part in self.quaternion]
        if self.axis is not None:
            angle = self.angle if self.angle is not None else math.radians(self.degrees or 0.0)
            return axis_angle(self.axis, angle)
        result = [1.0, 0.0, 0.0, 0.0]
        for number, degrees in enumerate(self.euler_xyz_degrees or (0.0, 0.0, 0.0)):
            axis = [0.0, 0.0, 0.0]
            axis[number] = 1.0
            result = quaternion_product(
                axis_angle((axis[0], axis[1], axis[2]), math.radians(degrees)), result
            )
        return result

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """The short form beside the table."""
        table = handler.resolve_ref_schema(handler(core)).copy()
        listed = {
            "type": "array",
            "items": {"type": "number"},
            "minItems": 4,
            "maxItems": 4,
            "description": "Quaternion [w, x, y, z].",
        }
        return {"anyOf": [listed, table]}


def axis_angle(axis: tuple[float, float, float], angle: float) -> list[float]:
    """Unit quaternion [w, x, y, z] of a turn by `angle` [rad] about `axis` (any length)."""
    length = math.hypot(*axis)
    sine = math.sin(angle / 2) / length
    return [math.cos(angle / 2), axis[0] * sine, axis[1] * sine, axis[2] * sine]


def quaternion_product(left: list[float], right: list[float]) -> list[float]:
    """Hamilton product of two quaternions [w, x, y, z]: the turn `right`, then the turn `left`."""
    a, b = np.asarray(left), np.asarray(right)
    scalar = a[0] * b[0] - a[1:] @ b[1:]
    vector = a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])
    return [float(scalar), *(float(part) for part in vector)]
