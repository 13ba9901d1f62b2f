"""The engine in one's own process: worlds without a server or a socket, with the same bits as the server's.

>>> from pneuma import engine
>>> world = engine.World("bouncing-ball")
>>> world["ball"].kick((3, 0, 0))
>>> world.step(60)["ball"].centre_of_mass

`Worlds` steps many worlds of one scene on all cores, and shows them as arrays.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Coroutine, Mapping
from typing import Any, Literal, TypeVar, cast, get_args

import numpy as np
from numpy.typing import NDArray

from pneuma import aio
from pneuma._proto import session_pb2 as wire
from pneuma.aio.connection import Connection, reply_in
from pneuma.arrays import Vector, floats
from pneuma.blocking import Blocking, LoopThread, waits
from pneuma.client import Body
from pneuma.errors import PneumaError
from pneuma.named import Named
from pneuma.messages import whole
from pneuma.native import need_native
from pneuma.scene import Source, fill_source

need_native()
from pneuma import _native  # noqa: E402

T = TypeVar("T")
Array = NDArray[np.float64]

#: What `Worlds` can show.
Shown = Literal["positions", "velocities", "centres_of_mass", "mean_velocities", "pressures_pa", "volumes_m3"]
#: What it costs little to show.
shown_unless_said: tuple[Shown, ...] = ("centres_of_mass", "mean_velocities", "pressures_pa", "volumes_m3")


class InProcess:
    """Answers the requests of `pneuma.aio` at once, where a connection would ask a server."""

    def __init__(self, source: Source, threads: int) -> None:
        self.native = _native.World(made_of(source), whole(threads, "threads", least=1))

    async def call(self, request: wire.ClientMessage, expected: type[T]) -> T:
        request.request_id = 1
        return reply_in(wire.ServerMessage.FromString(self.native.answer(request.SerializeToString())), expected)


class AtOnce(LoopThread):
    """Runs what never waits, in the caller's thread."""

    def __init__(self) -> None:
        pass

    def run(self, work: Coroutine[Any, Any, T]) -> T:
        try:
            work.send(None)
        except StopIteration as done:
            return cast(T, done.value)
        raise AssertionError("waits for something that nobody does")


class World(Blocking[aio.World]):
    """A world of a built-in scene, a `Scene`, a dict like its JSON form, JSON, or a file (a path that ends in .json).

    threads: how many step it, 1 to 1,024. The bits are the same with any number.

    It steps, tells and changes as a paused world of a server does. What takes a server it does not have: branches,
    snapshots, `rewind`, streams, recordings, the page. Several threads may use it at once: they wait for each other.
    """

    __slots__ = ("_native",)

    def __init__(self, scene: Source, *, threads: int = 1) -> None:
        connection = InProcess(scene, threads)
        self._native = connection.native
        # It has of a Connection what the methods below ask for.
        unnamed = aio.World(cast(Connection, connection), "", "")
        super().__init__(unnamed, AtOnce())
        unnamed.name = self.stats().world

    step = waits(aio.World.step)
    run_until = waits(aio.World.run_until)
    state = waits(aio.World.state)
    stats = waits(aio.World.stats)
    scene = waits(aio.World.scene)
    edit = waits(aio.World.edit)
    raycast = waits(aio.World.raycast)
    nearest = waits(aio.World.nearest)
    bodies_in_box = waits(aio.World.bodies_in_box)
    set_state = waits(aio.World.set_state)
    reset = waits(aio.World.reset)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Saves the scene as JSON. Raises PneumaError where the path does not end in .json: world files take a server."""
        if os.path.splitext(os.fspath(path))[1] != ".json":
            raise PneumaError("UNSUPPORTED", "a world file takes a server; a path that ends in .json does not", "save")
        self.scene().save(path)

    @property
    def name(self) -> str:
        """Its scene's."""
        return self._inner.name

    @property
    def tick(self) -> int:
        """Ticks done since it was made; a reset does not set them back."""
        return self._native.tick

    @property
    def state_hash(self) -> int:
        """Of all of its state, as `State.state_hash`."""
        return self._native.state_hash

    @property
    def gravity(self) -> Vector:
        """(x, y, z), m/s^2; setting it is an edit."""
        return self._thread.run(self._inner.get_gravity())

    @gravity.setter
    def gravity(self, gravity: Vector) -> None:
        self._thread.run(self._inner.set_gravity(gravity))

    def __getitem__(self, body: str) -> Body:
        """A soft or rigid body, by its name."""
        return Body(self._inner[body], self._thread)


class Worlds:
    """Many worlds of one scene, stepped on all cores while other threads of Python run.

    scene: as of `World`.
    shown: which of the arrays below are wanted. Positions and velocities are of vertices, and cost the most.
    threads: how many step them, 1 to 1,024; all cores unless given. The bits are the same with any number.

    The arrays have a row a world. Each step and reset writes the same arrays anew: copy what you keep.

    positions, velocities: (count, N, 3) float32, m and m/s, of the vertices of all soft bodies; `rows` tells whose.
    centres_of_mass, mean_velocities: (count, bodies, 3), m and m/s: of soft bodies and then rigid ones, as `bodies`.
    pressures_pa, volumes_m3: (count, soft bodies): of the gas, over the outside pressure; of the skin.
    frozen: (count, bodies). Such a body ran away, and is not simulated until its world is reset.
    ticks: (count,), since the world's last reset.
    """

    def __init__(
        self,
        scene: Source,
        count: int = 1024,
        *,
        shown: Collection[Shown] | Shown = shown_unless_said,
        threads: int | None = None,
    ) -> None:
        shown = [shown] if isinstance(shown, str) else shown
        unknown = set(shown) - set(get_args(Shown))
        if unknown:
            raise PneumaError("INVALID_ARGUMENT", f"{', '.join(sorted(unknown))}: not among {get_args(Shown)}", "shown")
        threads = len(os.sched_getaffinity(0)) if threads is None else whole(threads, "threads", least=1)
        count = whole(count, "count", least=1)
        self._native = _native.Worlds(made_of(scene), count, threads, set(shown))
        names, counts = self._native.body_names, self._native.vertex_counts
        ends = np.cumsum([0, *counts]).tolist()
        self.count = count
        self.tick_s = self._native.tick_s
        self.bodies: tuple[str, ...] = tuple(names)
        self.colliders: tuple[str, ...] = tuple(self._native.collider_names)
        self.rows: Mapping[str, slice] = Named(
            "soft body", {name: slice(begin, end) for name, begin, end in zip(names, ends[:-1], ends[1:])}
        )
        self.frozen: NDArray[np.bool_] = self._native.frozen
        self.ticks: NDArray[np.uint64] = self._native.ticks

    def step(
        self,
        ticks: int = 1,
        *,
        impulses: object = None,
        moles: object = None,
        collider_velocities: object = None,
        collider_angular_velocities: object = None,
    ) -> None:
        """Acts on every world, steps it, and writes the arrays. What is None is not done.

        ticks: 0 acts and shows, without a step.
        impulses: (count, bodies, 3), N s, each to a whole body before the first tick.
        moles: (count, soft bodies), mol, what the gas holds then, whatever leaked before; NaN leaves a body as it is.
            A body that the scene gives no gas takes NaN alone.
        collider_velocities, collider_angular_velocities: (count, colliders, 3), m/s and rad/s, from now on; three NaN
            leave a collider as it is.

        A frozen body takes no impulse, and one whose gas burst takes no moles. Raises PneumaError where one of these
        cannot be; it names the world, and the others may have been stepped.
        """
        given = {
            "impulses": impulses,
            "moles": moles,
            "collider_velocities": collider_velocities,
            "collider_angular_velocities": collider_angular_velocities,
        }
        arrays = (None if numbers is None else floats(numbers, name) for name, numbers in given.items())
        self._native.step(whole(ticks, "step.ticks"), *arrays)

    def reset(self, which: object = None) -> None:
        """Puts worlds back to the scene's start: those of which `which`, (count,) of bool, is true; None: all.

        Raises PneumaError where `which` has another shape, or numbers: indices are refused.
        """
        self._native.reset(np.ones(self.count, np.bool_) if which is None else which)

    def state_hashes(self) -> NDArray[np.uint64]:
        """(count,): of all of each world's state, as `State.state_hash`."""
        return self._native.state_hashes()

    @property
    def positions(self) -> NDArray[np.float32]:
        return given(self._native.positions, "positions")

    @property
    def velocities(self) -> NDArray[np.float32]:
        return given(self._native.velocities, "velocities")

    @property
    def centres_of_mass(self) -> Array:
        return given(self._native.centres_of_mass, "centres_of_mass")

    @property
    def mean_velocities(self) -> Array:
        return given(self._native.mean_velocities, "mean_velocities")

    @property
    def pressures_pa(self) -> Array:
        return given(self._native.pressures_pa, "pressures_pa")

    @property
    def volumes_m3(self) -> Array:
        return given(self._native.volumes_m3, "volumes_m3")

    def __len__(self) -> int:
        return self.count

    def __repr__(self) -> str:
        return f"<{self.count} Worlds of {', '.join(self.bodies)}>"


def given(array: T | None, name: Shown) -> T:
    if array is None:
        raise PneumaError("FAILED_PRECONDITION", f"they are not shown: ask for them by shown=[..., '{name}']", name)
    return array


def made_of(source: Source) -> bytes:
    request = wire.CreateWorld()
    fill_source(request, source)
    made: bytes = request.SerializeToString()
    return made
