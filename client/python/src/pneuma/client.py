"""The client whose calls wait. Each is the one of `pneuma.aio` of the same name, where it is described."""

from __future__ import annotations

import functools
from collections.abc import Callable, Coroutine
from typing import TYPE_CHECKING, Any, ParamSpec, Self, TypeVar

from pneuma import aio
from pneuma._proto import session_pb2 as wire
from pneuma.aio import opening
from pneuma.arrays import Vector
from pneuma.blocking import Blocking, LoopThread, gives, waits, waits_for
from pneuma.errors import PneumaError, at_a_blocks_end
from pneuma.frames import Frame
from pneuma.notebook import table_of
from pneuma.state import State
from pneuma.touch import Touch

if TYPE_CHECKING:
    from pneuma.aio import recorder as aio_recorder

P = ParamSpec("P")
Reply = TypeVar("Reply")
Told = TypeVar("Told", bound=aio.Subscription)


class Grab(Blocking[aio.Grab]):
    __doc__ = aio.Grab.__doc__
    __slots__ = ()

    move = waits(aio.Grab.move)
    release = waits(aio.Grab.release)

    @property
    def body(self) -> str:
        return self._inner.body

    @property
    def vertex(self) -> int:
        return self._inner.vertex

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, raised: BaseException | None, trace: object) -> None:
        with at_a_blocks_end(raised):
            self.release()


class Body(Blocking[aio.Body]):
    __doc__ = aio.Body.__doc__
    __slots__ = ()

    kick = waits(aio.Body.kick)
    change = waits(aio.Body.change)
    place = waits(aio.Body.place)
    place_vertices = waits(aio.Body.place_vertices)
    grab = waits_for(Grab, aio.Body.grab)

    @property
    def name(self) -> str:
        return self._inner.name


class Subscription(Blocking[Told]):
    """What a server tells of a world unasked, from `open` to `close`."""

    __slots__ = ()

    def open(self) -> Self:
        """Subscribes, if it has not yet."""
        self._thread.run(self._inner.open())
        return self

    @property
    def subscribed(self) -> wire.Subscribed:
        """What the server made of the request: rate_hz, max_error_m. Raises PneumaError before the stream has begun."""
        return self._inner.subscribed

    def close(self) -> None:
        """Unsubscribes."""
        self._thread.call_soon(self._inner.close)

    def __iter__(self) -> Self:
        return self

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __del__(self) -> None:
        self.close()


class Stream(Subscription[aio.Stream]):
    __doc__ = aio.Stream.__doc__
    __slots__ = ()

    next = waits(aio.Stream.next)

    def __next__(self) -> Frame:
        frame = self.next()
        if frame is None:
            raise StopIteration
        return frame


class TouchStream(Subscription[aio.TouchStream]):
    __doc__ = aio.TouchStream.__doc__
    __slots__ = ()

    take = waits(aio.TouchStream.take)
    next = waits(aio.TouchStream.next)

    @property
    def dropped(self) -> int:
        """Touches that there was no room for."""
        return self._inner.dropped

    def __next__(self) -> Touch:
        touch = self.next()
        if touch is None:
            raise StopIteration
        return touch


class Recorder(Blocking["aio_recorder.Recorder"]):
    """A recording under way, made by `World.record`. It ends by `close`, or as a block at the block's end.

    The first write that fails ends it: the file holds what was written before. `step` raises the error, or else `close`.
    """

    __slots__ = ()

    @property
    def frames(self) -> int:
        """How many were recorded. After a write that failed, the last ones of them are not in the file."""
        return self._inner.frames

    def step(self, ticks: int = 1) -> State:
        """Steps the paused world, no faster than it is recorded: no frame is lost. Returns the state at the last tick.

        Raises PneumaError where the world has done some of the ticks, and the recording has not:
        - A frame does not come: UNAVAILABLE.
        - The file cannot be written. The recording has ended then.
        """
        __tracebackhide__ = True
        return self._thread.run(self._inner.step(ticks))

    def close(self) -> None:
        """Waits for the frame of the world's last tick, and ends the file.

        Raises PneumaError where a write failed, unless `step` has raised that. Once closed, does nothing.
        """
        self._thread.run(self._inner.close())

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, raised: BaseException | None, trace: object) -> None:
        with at_a_blocks_end(raised):
            self.close()


class World(Blocking[aio.World]):
    __doc__ = aio.World.__doc__
    __slots__ = ()

    step = waits(aio.World.step)
    run_until = waits(aio.World.run_until)
    pause = waits(aio.World.pause)
    resume = waits(aio.World.resume)
    reset = waits(aio.World.reset)
    rewind = waits(aio.World.rewind)
    state = waits(aio.World.state)
    stats = waits(aio.World.stats)
    scene = waits(aio.World.scene)
    edit = waits(aio.World.edit)
    set_state = waits(aio.World.set_state)
    destroy = waits(aio.World.destroy)
    save = waits(aio.World.save)
    snapshot = waits(aio.World.snapshot)
    raycast = waits(aio.World.raycast)
    nearest = waits(aio.World.nearest)
    bodies_in_box = waits(aio.World.bodies_in_box)
    stream = gives(Stream, aio.World.stream)
    record = waits_for(Recorder, aio.World.record)
    touches = gives(TouchStream, aio.World.touches)

    @property
    def name(self) -> str:
        return self._inner.name

    @property
    def gravity(self) -> Vector:
        """(x, y, z), m/s^2; setting it is an edit."""
        return self._thread.run(self._inner.get_gravity())

    @gravity.setter
    def gravity(self, gravity: Vector) -> None:
        self._thread.run(self._inner.set_gravity(gravity))

    @property
    def url(self) -> str:
        """The page of the world."""
        return self._inner.url

    def show(self) -> str:
        """Opens the world's page in a browser, that of the variable BROWSER where it is set. Returns its address."""
        return self._inner.show()

    def branch(self, *, tick: int | None = None, name: str = "", paused: bool = False, owned: bool = False) -> World:
        """A second world of this one, as it is or as it was at `tick`. `owned`: it ends with this connection."""
        branch = self._inner.branch(tick=tick, name=name, paused=paused, owned=owned)
        return World(self._thread.run(branch), self._thread)

    def __getitem__(self, body: str) -> Body:
        """A soft or rigid body, by its name."""
        return Body(self._inner[body], self._thread)

    def _repr_html_(self) -> str:
        """In a notebook: its bodies, and a link to its page."""
        return table_of(self.stats(), self.url)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, raised: BaseException | None, trace: object) -> None:
        with at_a_blocks_end(raised):
            self.destroy()


class Server(Blocking[aio.Server]):
    __doc__ = aio.Server.__doc__
    __slots__ = ()

    world = waits_for(World, aio.Server.world)
    restore = waits_for(World, aio.Server.restore)
    worlds = waits(aio.Server.worlds)

    def call(self, request: wire.ClientMessage, expected: type[Reply]) -> Reply:
        """Any request of the protocol (`pneuma.wire`), whose reply is an `expected`. Raises PneumaError."""
        return self._thread.run(self._inner.call(request, expected))

    def __getitem__(self, name: str) -> World:
        """A world that is there; where it is not, the first request says NOT_FOUND."""
        return World(self._inner[name], self._thread)

    @property
    def address(self) -> str:
        """HOST:PORT, as `connect` and `pneuma --server` take it."""
        return self._inner.address

    @property
    def page(self) -> str:
        """The address of the page."""
        return self._inner.page

    @property
    def process_id(self) -> int | None:
        """The server's process, where it is one's own."""
        return self._inner.process_id

    @property
    def error(self) -> PneumaError | None:
        """Why the connection ended; None while it lasts."""
        return self._inner.connection.error

    def close(self) -> None:
        """Ends the connection, and the server if it is one's own."""
        self._thread.end()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def waits_to_open(opened: Callable[P, Coroutine[Any, Any, aio.Server]]) -> Callable[P, Server]:
    """The function that waits for the server, and gives it a thread to run in."""

    @functools.wraps(opened)
    def call(*args: P.args, **kwargs: P.kwargs) -> Server:
        __tracebackhide__ = True
        thread = LoopThread()
        try:
            server = thread.run(opened(*args, **kwargs))
        except BaseException:
            thread.end()
            raise
        thread.at_end(server.close)
        return Server(server, thread)

    return call


serve = waits_to_open(opening.serve)
connect = waits_to_open(opening.connect)
