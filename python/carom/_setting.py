"""Settings of a world as attributes of it. The engine checks what is assigned. Knows no setting by name."""

from __future__ import annotations

from typing import TYPE_CHECKING, Generic, Self, TypeVar, overload

if TYPE_CHECKING:
    from carom._world import World

T = TypeVar("T")


class Setting(Generic[T]):
    """A setting of the world as an attribute; the engine checks what is assigned."""

    def __init__(self, doc: str) -> None:
        self.__doc__ = doc

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    @overload
    def __get__(self, world: None, owner: type) -> Self: ...
    @overload
    def __get__(self, world: World, owner: type) -> T: ...
    def __get__(self, world: World | None, owner: type) -> Self | T:
        if world is None:
            return self
        value: T = world.settings[self.name]
        return value

    def __set__(self, world: World, value: T) -> None:
        world._set(self.name, value)
