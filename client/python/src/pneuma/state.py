"""Where everything is at one tick, as numpy arrays."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, fields
from functools import cache
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from pneuma._proto import session_pb2 as wire
from pneuma.arrays import Floats, Points, floats
from pneuma.errors import PneumaError
from pneuma.named import Named, not_there

Array = NDArray[np.float64]
T = TypeVar("T")


@dataclass(frozen=True, eq=False, repr=False)
class SoftState:
    """A soft body.

    positions: (n, 3), metres, in the mesh's order; float32, or float64 where double precision was asked for.
    velocities: the same in m/s; None where they were not asked for.
    pressure_pa: of the gas, over the outside pressure.
    centre_of_mass, momentum, angular_momentum: (3,), m, kg m/s, kg m^2/s about the origin.
    frozen: it ran away (its numbers left all bounds), and is not simulated until `World.reset`.
    asleep: it is at rest, and not simulated until something moves it.
    """

    name: str
    positions: Floats
    velocities: Floats | None
    volume_m3: float
    area_m2: float
    pressure_pa: float
    temperature_k: float
    moles: float
    kinetic_j: float
    elastic_j: float
    gas_j: float
    gravity_j: float
    centre_of_mass: Array
    momentum: Array
    angular_momentum: Array
    max_speed_m_s: float
    frozen: bool
    asleep: bool

    def __repr__(self) -> str:
        return f"<{self.name} at {metres(self.centre_of_mass)}, {len(self.positions)} vertices{condition(self)}>"


@dataclass(frozen=True, eq=False, repr=False)
class RigidState:
    """A rigid body.

    position: (3,), metres, of the centre of mass. orientation: (4,), w x y z of a unit quaternion.
    velocity, angular_velocity: (3,), m/s and rad/s.
    frozen, asleep: as of a SoftState.
    """

    name: str
    position: Array
    orientation: Array
    velocity: Array
    angular_velocity: Array
    frozen: bool
    asleep: bool

    @property
    def centre_of_mass(self) -> Array:
        """(3,), metres: a rigid body's place."""
        return self.position

    def __repr__(self) -> str:
        return f"<{self.name} at {metres(self.position)}{condition(self)}>"


@dataclass(frozen=True, eq=False, repr=False)
class State:
    """A world at one tick.

    state["ball"] is the soft body of that name; `rigid` has the rigid ones. state_hash is of all of the world's state:
    two runs with the same hash have the same bits.
    """

    world: str
    tick: int
    time_s: float
    state_hash: int
    soft: Mapping[str, SoftState]
    rigid: Mapping[str, RigidState]

    def __getitem__(self, body: str) -> SoftState:
        if body not in self.soft:
            hint = "; it is a rigid body: state.rigid has it" if body in self.rigid else ""
            raise not_there("soft body", body, self.soft, hint)
        return self.soft[body]

    def __contains__(self, body: object) -> bool:
        return body in self.soft

    def __iter__(self) -> Iterator[str]:
        return iter(self.soft)

    def __len__(self) -> int:
        return len(self.soft)

    def __repr__(self) -> str:
        bodies: list[SoftState | RigidState] = [*self.soft.values(), *self.rigid.values()]
        named = ", ".join(f"{body.name}{condition(body, ' (', ')')}" for body in bodies)
        return f"<State of {self.world} at tick {self.tick}: {named}>"


def condition(body: SoftState | RigidState, before: str = ", ", after: str = "") -> str:
    """Whether the body is frozen or asleep, in a word; empty where it is neither."""
    word = "frozen" if body.frozen else "asleep" if body.asleep else ""
    return before + word + after if word else ""


def metres(place: Array) -> str:
    return "(" + ", ".join(f"{number:.3f}" for number in place) + ") m"


def xyz(message: Any) -> Array:
    """(3,) of a Vec3."""
    return np.array([message.x, message.y, message.z])


def rows(data: bytes, number: str) -> Floats:
    """(n, 3) of x y z after x y z."""
    rows: Floats = np.frombuffer(data, number).reshape(-1, 3)
    return rows


@cache
def names_of(kind: Any) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The fields of a dataclass: those that are arrays, and the others."""
    arrays = tuple(each.name for each in fields(kind) if str(each.type) == "Array")
    return arrays, tuple(each.name for each in fields(kind) if each.name not in arrays)


def plain(kind: Callable[..., T], message: Any, **given: Any) -> T:
    """A dataclass whose other fields have the names of the message's; its Vec3 become arrays."""
    arrays, others = names_of(kind)
    for name in arrays:
        if name not in given:
            given[name] = xyz(getattr(message, name))
    for name in others:
        if name not in given:
            given[name] = getattr(message, name)
    return kind(**given)


class Unmade(NamedTuple):
    """What a SoftState is made of. The bytes are copies: a message makes one each time that it is asked."""

    body: Any
    positions: bytes
    velocities: bytes


class SoftStates(Mapping[str, SoftState]):
    """The soft bodies of a state. Each is made of its message when it is first asked for: a loop of steps reads few."""

    __slots__ = ("_bodies", "_number")

    def __init__(self, messages: Iterable[wire.State.Soft], number: str) -> None:
        """number: the type of the coordinates. Raises ValueError where the bytes are no whole vertices."""
        self._bodies: dict[str, SoftState | Unmade] = {}
        self._number = number
        row_bytes = 3 * np.dtype(number).itemsize
        for each in messages:
            unmade = Unmade(each.body, each.positions, each.velocities)
            if len(unmade.positions) % row_bytes or len(unmade.velocities) not in (0, len(unmade.positions)):
                raise ValueError(f"the vertices of {each.body.name} are not whole")
            self._bodies[each.body.name] = unmade

    def __getitem__(self, name: str) -> SoftState:
        if name not in self._bodies:
            raise not_there("soft body", name, self)
        body = self._bodies[name]
        if isinstance(body, Unmade):
            body = plain(
                SoftState,
                body.body,
                positions=rows(body.positions, self._number),
                velocities=rows(body.velocities, self._number) if body.velocities else None,
            )
            self._bodies[name] = body  # the message is needed no more
        return body

    def __contains__(self, name: object) -> bool:
        return name in self._bodies

    def __iter__(self) -> Iterator[str]:
        return iter(self._bodies)

    def __len__(self) -> int:
        return len(self._bodies)

    def __repr__(self) -> str:
        return repr(dict(self))

    # Messages of our own are not known to the pickler.
    def __reduce__(self) -> tuple[type[Named[SoftState]], tuple[str, dict[str, SoftState]]]:
        return Named, ("soft body", dict(self))


def state_of(message: wire.State) -> State:
    """Raises ValueError where the bytes are no whole vertices."""
    rigid = [plain(RigidState, each, orientation=wxyz(each.orientation)) for each in message.rigid_bodies]
    return State(
        world=message.world,
        tick=message.tick,
        time_s=message.time_s,
        state_hash=message.state_hash,
        soft=SoftStates(message.soft_bodies, "<f8" if message.double_precision else "<f4"),
        rigid=Named("rigid body", {body.name: body for body in rigid}),
    )


def wxyz(message: Any) -> Array:
    """(4,) of a Quaternion; one that is all 0 is no rotation."""
    numbers = np.array([message.w, message.x, message.y, message.z])
    return numbers if numbers.any() else np.array([1.0, 0.0, 0.0, 0.0])


def little_endian(points: Points | None, where: str) -> bytes:
    """(n, 3) as doubles, x y z after x y z; nothing of None."""
    if points is None:
        return b""
    array = floats(points, where, "<f8")
    if array.ndim != 2 or array.shape[1] != 3:
        raise PneumaError("INVALID_ARGUMENT", f"have the shape {array.shape}; points have (n, 3)", where)
    return array.tobytes()
