"""What tests of worlds assert: hashes of the whole state, and places within so many metres."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pneuma._proto import session_pb2 as wire
from pneuma.arrays import Vector
from pneuma.client import Body, World
from pneuma.state import RigidState, SoftState, State, metres


def assert_hash(world: World | State, expected: int | str) -> None:
    """Asserts that a world, or a state, has these bits: an int, or hexadecimal text as `pneuma stats` prints it."""
    __tracebackhide__ = True
    state: State | wire.Stats = world.stats() if isinstance(world, World) else world
    wanted = int(expected, 16) if isinstance(expected, str) else expected
    if state.state_hash != wanted:
        raise AssertionError(
            f"{state.world} at tick {state.tick} has the hash {state.state_hash:#018x}, not {wanted:#018x}"
        )


def point_of(other: object) -> NDArray[np.float64]:
    try:
        return np.asarray(other, np.float64)
    except (TypeError, ValueError):
        hint = ""
        if isinstance(other, (Body, State, World)):
            hint = '; a state has the places: world.state()["ball"], or .rigid["stone"] of a rigid body'
        raise TypeError(f"near compares points, and bodies of a state, not {other!r}{hint}") from None


class near:
    """Equal to a point that is no further away than `within_m`, or to a body whose centre of mass is.

    >>> assert state["ball"] == near((0, 0.5, 0), within_m=0.01)
    >>> assert state["ball"].positions[24] == near((0, 1, 0), within_m=0.01)
    """

    # numpy leaves the comparison to us.
    __array_ufunc__ = None

    def __init__(self, point: Vector, *, within_m: float) -> None:
        self.point = np.asarray(point, np.float64)
        self.within_m = within_m
        if self.point.shape != (3,) or not within_m >= 0.0:
            raise ValueError(f"near takes three numbers and a distance, not {point!r} within {within_m!r} m")
        self._other: Any = None

    def __eq__(self, other: object) -> bool:
        place = other.centre_of_mass if isinstance(other, (SoftState, RigidState)) else point_of(other)
        self._other = place
        return place.shape == (3,) and bool(np.linalg.norm(place - self.point) <= self.within_m)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        text = f"within {self.within_m:g} m of {metres(self.point)}"
        if self._other is None or self._other.shape != (3,):
            return text
        return f"{text}; {metres(self._other)} is {np.linalg.norm(self._other - self.point):.3g} m away"
