"""A world of a server."""

from __future__ import annotations

import asyncio
import webbrowser
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Self
from urllib.parse import quote

import numpy as np

from pneuma import messages
from pneuma._proto import scene_types
from pneuma._proto import session_pb2 as wire
from pneuma.aio.body import Body
from pneuma.aio.connection import Connection
from pneuma.aio.stream import Stream, TouchStream
from pneuma.arrays import Points, Vector
from pneuma.errors import NotReached, PneumaError, at_a_blocks_end
from pneuma.messages import parts_of, whole
from pneuma.native import has_native
from pneuma.scene import Scene, json_of
from pneuma.state import Array, State, little_endian, state_of, xyz
from pneuma.surfaces import Surfaces, names, set_xyz, surfaces_of, vectors

if TYPE_CHECKING:
    from pneuma.aio.recorder import Recorder

# WIRE.md, "Limits": of the steps that wait on a world. Ten minutes at 60 Hz.
ticks_of_a_step_max = 36_000
# Touches come with a stream, which has frames too: as few as can be, and of a rate that no other stream asks for.
rate_of_touches_hz = 1.234e-6

Change = (
    scene_types.SceneChange
    | scene_types.Mesh
    | scene_types.SoftBody
    | scene_types.RigidBody
    | scene_types.Collider
    | scene_types.Joint
    | scene_types.SoftBodyChange
    | scene_types.RigidBodyChange
    | scene_types.ColliderChange
    | scene_types.Atmosphere
    | scene_types.Stepping
    | Mapping[str, object]
)


class World:
    """Made by `Server.world`, or `server["name"]` for one that is there.

    Methods that change something return the first tick that shows it. Each raises PneumaError where the server refuses.
    As a block, the world is destroyed at its end.
    """

    __slots__ = ("_connection", "_page", "name", "__weakref__")

    def __init__(self, connection: Connection, name: str, page: str) -> None:
        self._connection = connection
        self._page = page
        self.name = name

    def __getitem__(self, body: str) -> Body:
        """A soft or rigid body, by its name."""
        named(body, "a body")
        return Body(self._connection, self.name, body)

    # Time

    async def step(
        self, ticks: int = 1, *, bodies: Sequence[str] = (), velocities: bool = False, double_precision: bool = False
    ) -> State:
        """Steps a paused world. Returns its state at exactly that tick; `state` says of what."""
        ticks = whole(ticks, "step.ticks", least=1)
        request = wire.Step(world=self.name, ticks=ticks, observe=observe(bodies, velocities, double_precision))
        done = await self._connection.call(wire.ClientMessage(step=request), wire.Done)
        return state_in(done)

    async def run_until(
        self,
        *,
        tick: int | None = None,
        at_rest: bool = False,
        touch: tuple[str, str] | None = None,
        past: tuple[str, Vector, float] | None = None,
        ticks_max: int = ticks_of_a_step_max,
        bodies: Sequence[str] = (),
        velocities: bool = False,
        double_precision: bool = False,
    ) -> State:
        """Steps a paused world until something is so, and returns the state at that tick. One of these is waited for:

        tick: the world has done so many.
        at_rest: every body that moves is asleep.
        touch: two bodies meet, or a body and a collider.
        past: (body, normal, offset_m): a body's centre of mass is where normal . position > offset_m.

        Raises NotReached after ticks_max ticks: ten minutes at 60 Hz unless given. It names the bodies that are frozen.
        For the others see `state`.
        """
        if sum([tick is not None, at_rest, touch is not None, past is not None]) != 1:
            raise messages.invalid("run_until", "one of tick, at_rest, touch and past is waited for")
        request = wire.StepUntil(
            world=self.name,
            ticks_max=whole(ticks_max, "run_until.ticks_max", least=1),
            observe=observe(bodies, velocities, double_precision),
        )
        if tick is not None:
            request.tick = whole(tick, "run_until.tick", bits=64)
            missed = f"tick {tick} was not reached"
        elif touch is not None:
            first, second = parts_of(touch, "run_until.touch", "first", "second")
            messages.fill(request.touch, {"first": first, "second": second}, "run_until.touch")
            missed = f"{first} did not touch {second}"
        elif past is not None:
            body, normal, offset_m = parts_of(past, "run_until.past", "body", "normal", "offset_m")
            messages.fill(request.past, {"body": body, "normal": normal, "offset_m": offset_m}, "run_until.past")
            missed = f"{body} was not past {offset_m} m along {tuple(normal)}"
        else:
            request.rest.SetInParent()
            missed = "not every body was at rest"
        done = await self._connection.call(wire.ClientMessage(step_until=request), wire.Done)
        state = state_in(done)
        if not done.reached:
            raise NotReached(f"{missed} by tick {state.tick}{await self._frozen()}", state)
        return state

    async def pause(self) -> int:
        """Stops the world's clock. It then goes on by `step` and `run_until`."""
        return await self._do(wire.ClientMessage(pause=wire.Pause(world=self.name)))

    async def resume(self, time_scale: float | None = None) -> int:
        """Lets the world run: at its own pace, or in slow motion, at `time_scale` (0.125 to 1) of it from now on."""
        return await self._do(wire.ClientMessage(resume=wire.Resume(world=self.name, time_scale=time_scale)))

    async def reset(self) -> int:
        """Back to the scene as it was created, without its edits: time is 0 again, ticks go on counting.

        Frozen bodies move again.
        """
        return await self._do(wire.ClientMessage(reset=wire.Reset(world=self.name)))

    async def rewind(self, tick: int) -> int:
        """Back to what it was when it had done so many ticks; of a server that keeps worlds (data_dir)."""
        request = wire.RewindWorld(world=self.name, tick=whole(tick, "rewind.tick", bits=64))
        return await self._do(wire.ClientMessage(rewind_world=request))

    # What is so

    async def state(
        self, *, bodies: Sequence[str] = (), velocities: bool = False, double_precision: bool = False
    ) -> State:
        """Where everything is now.

        bodies: soft bodies wanted, by name; none: all.
        velocities: of the vertices, too.
        double_precision: float64, which is what a world of double precision computes; else float32.
        """
        request = wire.GetState(world=self.name, observe=observe(bodies, velocities, double_precision))
        return state_of(await self._connection.call(wire.ClientMessage(get_state=request), wire.State))

    async def stats(self) -> wire.Stats:
        """The world's numbers, as the wire has them: energies, substeps and why, what each stage of a tick takes."""
        return await self._connection.call(wire.ClientMessage(get_stats=wire.GetStats(world=self.name)), wire.Stats)

    async def scene(self) -> Scene:
        """The scene with its edits, which makes another world. Soft bodies are where the scene puts them."""
        return Scene.of_message((await self._scene_reply()).scene)

    async def get_gravity(self) -> tuple[float, float, float]:
        """m/s^2"""
        gravity = (await self._scene_reply()).scene.gravity
        return (gravity.x, gravity.y, gravity.z)

    async def raycast(
        self,
        origins: Points | Vector,
        directions: Points | Vector,
        *,
        length_m: float = 0.0,
        bodies: Sequence[str] = (),
    ) -> Surfaces:
        """Where rays first meet a body or collider: at most 1,024.

        origins: (n, 3), metres, or one of all rays. directions: the same, of any length.
        length_m: no further than that; 0: however far.
        bodies: soft bodies, rigid bodies and colliders to look at, by name; none: all.
        """
        starts, ways = vectors(origins, "raycast.origins"), vectors(directions, "raycast.directions")
        if len(starts) != len(ways) and 1 not in (len(starts), len(ways)):
            raise messages.invalid("raycast", f"{len(starts)} origins and {len(ways)} directions")
        request = wire.Raycast(world=self.name, bodies=names(bodies))
        for origin, direction in zip(*np.broadcast_arrays(starts, ways)):
            ray = request.rays.add(length_m=length_m)
            set_xyz(ray.origin, origin)
            set_xyz(ray.direction, direction)
        return surfaces_of(await self._connection.call(wire.ClientMessage(raycast=request), wire.SurfacePoints))

    async def nearest(self, points: Points | Vector, *, within_m: float = 0.0, bodies: Sequence[str] = ()) -> Surfaces:
        """The places on surfaces nearest to points: at most 1,024.

        points: (n, 3), metres, or one.
        within_m: no further than that; 0: however far.
        bodies: as of `raycast`.
        """
        request = wire.NearestPoint(world=self.name, bodies=names(bodies), within_m=within_m)
        for point in vectors(points, "nearest.points"):
            set_xyz(request.points.add(), point)
        return surfaces_of(await self._connection.call(wire.ClientMessage(nearest_point=request), wire.SurfacePoints))

    async def bodies_in_box(self, low: Vector, high: Vector) -> dict[str, tuple[Array, Array]]:
        """The soft and rigid bodies whose bounding boxes reach into a box, each with its own: low and high, metres."""
        request = wire.BodiesInBox(world=self.name)
        messages.fill(request.low, low, "bodies_in_box.low")
        messages.fill(request.high, high, "bodies_in_box.high")
        found = await self._connection.call(wire.ClientMessage(bodies_in_box=request), wire.BodyBoxes)
        return {box.body: (xyz(box.low), xyz(box.high)) for box in found.boxes}

    def touches(self, *, bodies: Sequence[str] = (), impulse_min_n_s: float | None = None) -> TouchStream:
        """What begins and ends to touch, each as a `pneuma.Touch`: to iterate over, or as a block, to take after steps.

        bodies: soft bodies, rigid bodies and colliders, by name: those in which one of them takes part; none: all.
        impulse_min_n_s: tell each tick's impulse of at least so much; None: only that with which a touch begins.
        """
        request = wire.Subscribe(world=self.name, encoding=wire.Subscribe.PLAIN, rate_hz=rate_of_touches_hz)
        request.touches.bodies.extend(names(bodies))
        if impulse_min_n_s is not None:
            request.touches.impulse_min_n_s = impulse_min_n_s
        return TouchStream(self._connection, request)

    def stream(
        self,
        *,
        max_error: float = 0.0,
        rate_hz: float = 0.0,
        bodies: Sequence[str] = (),
        level_of_detail: int = 0,
        velocities: bool = False,
        scalars: bool = False,
        contacts: bool = False,
        plain: bool = False,
    ) -> Stream:
        """Frames as the world ticks, to iterate over.

        max_error: no vertex is off by more metres, and the stream takes a tenth of the bytes; 0: as near as a float32
            is.
        rate_hz: frames a second; 0: the world's rate.
        bodies: soft bodies wanted, by name; none: all.
        level_of_detail: each level has a quarter of the vertices of the one below.
        velocities: of the vertices, too.
        scalars: volume, pressure and energies of each body.
        contacts: the vertices that contact holds.
        plain: sends numbers as they are also within `max_error`, which costs less time and more bytes. A build of the
            package without its part in C++ does so anyway.
        """
        coded = max_error > 0.0 and not plain and has_native()
        request = wire.Subscribe(
            world=self.name,
            encoding=wire.Subscribe.ERROR_BOUNDED if coded else wire.Subscribe.PLAIN,
            max_error_m=max_error,
            rate_hz=rate_hz,
            bodies=bodies,
            level_of_detail=level_of_detail,
            velocities=velocities,
            scalars=scalars,
            contacts=contacts,
        )
        return Stream(self._connection, request)

    async def record(
        self,
        path: str | PathLike[str],
        *,
        max_error: float = 0.0,
        rate_hz: float = 0.0,
        bodies: Sequence[str] = (),
        velocities: bool = False,
        scalars: bool = True,
        replace: bool = False,
    ) -> Recorder:
        """Records the world's frames and the changes made to it, from now on, until the recorder is closed.

        The first frame is of the world as it is: it is waited for.

        max_error: no vertex is off by more metres; 0: 1 mm. The others are those of `stream`.
        replace: a file that is there already.

        `pneuma.read` reads the file; so do `pneuma play` and `pneuma export`.
        """
        from pneuma.aio.recorder import Recorder  # only here is the file format needed

        request = wire.Subscribe(
            world=self.name,
            max_error_m=max_error,
            rate_hz=rate_hz,
            bodies=bodies,
            velocities=velocities,
            scalars=scalars,
            commands=True,
        )
        return await Recorder.open(self._connection.address, self.name, path, request, replace=replace)

    # Changes

    async def set_gravity(self, gravity: Vector) -> int:
        """m/s^2"""
        return await self.edit({"set_gravity": gravity})

    async def edit(self, *changes: Change) -> int:
        """Changes the running world: all of the changes between two ticks, or none.

        A body, mesh, collider or joint is added; a SoftBodyChange and the like changes; a dict is a SceneChange.
        """
        request = wire.Edit(world=self.name)
        request.edit.SetInParent()
        for index, change in enumerate(changes):
            messages.fill(request.edit.changes.add(), change, f"edit.edit.changes[{index}]")
        return await self._do(wire.ClientMessage(edit=request))

    async def set_state(self, state: State, *, keep_velocities: bool = False) -> int:
        """Puts all bodies of a paused world where they are in `state`: one of this world, or of one of the same scene.

        keep_velocities: soft bodies whose velocities the state does not have keep those that they have now. Otherwise
        such a state raises ValueError. Take it with velocities=True.

        Gas, time and grabs stay as they are. `reset` puts all of them back.
        """
        if not isinstance(state, State):
            raise TypeError(f"set_state takes a State, as `step` and `state` return it, not {state!r}")
        without = [soft.name for soft in state.soft.values() if soft.velocities is None]
        if without and not keep_velocities:
            raise ValueError(
                f"the state has no velocities of {', '.join(without)}: take it with velocities=True, "
                "or let the bodies keep those that they have now, by keep_velocities=True"
            )
        request = wire.SetState(world=self.name, double_precision=True)
        for soft in state.soft.values():
            request.soft_bodies.add(
                name=soft.name,
                positions=little_endian(soft.positions, "set_state"),
                velocities=little_endian(soft.velocities, "set_state"),
            )
        for rigid in state.rigid.values():
            placed = request.rigid_bodies.add(name=rigid.name)
            for field in ("position", "orientation", "velocity", "angular_velocity"):
                messages.fill(getattr(placed, field), getattr(rigid, field), f"set_state.rigid_bodies.{field}")
        return await self._do(wire.ClientMessage(set_state=request))

    async def branch(
        self, *, tick: int | None = None, name: str = "", paused: bool = False, owned: bool = False
    ) -> World:
        """A second world of this one, as it is or as it was at `tick`. `owned`: it ends with this connection."""
        tick = None if tick is None else whole(tick, "branch.tick", bits=64)
        request = wire.BranchWorld(world=self.name, tick=tick, name=name, paused=paused, owned=owned)
        done = await self._connection.call(wire.ClientMessage(branch_world=request), wire.Done)
        return World(self._connection, done.world, self._page)

    async def destroy(self) -> int:
        """Ends the world."""
        return await self._do(wire.ClientMessage(destroy_world=wire.DestroyWorld(world=self.name)))

    # Files and the page

    async def save(self, path: str | PathLike[str]) -> None:
        """Saves the scene where the path ends in .json; otherwise all of the world, to the bit, as a world file.

        `Server.world` takes the one, `Server.restore` and `pneuma restore` the other.
        """
        file = Path(path)
        if file.suffix == ".json":
            data = json_of((await self._scene_reply()).scene).encode()
        else:
            data = await self.snapshot()
        await asyncio.to_thread(file.write_bytes, data)

    async def snapshot(self) -> bytes:
        """The world as a file's bytes: proto/WIRE.md, "World files"."""
        request = wire.ClientMessage(take_snapshot=wire.TakeSnapshot(world=self.name))
        piece = await self._connection.call(request, wire.Snapshot)
        data = piece.data
        while len(data) < piece.bytes_total:
            read = wire.ReadSnapshot(snapshot_id=piece.snapshot_id, offset=len(data))
            piece = await self._connection.call(wire.ClientMessage(read_snapshot=read), wire.Snapshot)
            if not piece.data:
                raise PneumaError("MALFORMED", "an empty piece of a snapshot", "read_snapshot")
            data += piece.data
        return data

    @property
    def url(self) -> str:
        """The page of the world."""
        return f"{self._page}/#world={quote(self.name)}"

    def show(self) -> str:
        """Opens the world's page in a browser, that of the variable BROWSER where it is set. Returns its address."""
        webbrowser.open(self.url)
        return self.url

    def __repr__(self) -> str:
        return f"<World {self.name}>"

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, kind: object, raised: BaseException | None, trace: object) -> None:
        with at_a_blocks_end(raised):
            await self.destroy()

    async def _do(self, request: wire.ClientMessage) -> int:
        return (await self._connection.call(request, wire.Done)).tick

    async def _frozen(self) -> str:
        """Which bodies are frozen, to be told with what was not reached; empty where none is."""
        stats = await self.stats()
        frozen = [f'"{body.name}"' for body in (*stats.soft_bodies, *stats.rigid_bodies) if body.frozen]
        if not frozen:
            return ""
        which = f"{frozen[0]} is frozen: it" if len(frozen) == 1 else f"{', '.join(frozen)} are frozen: they"
        return f"; {which} ran away, and will not move until reset()"

    async def _scene_reply(self) -> wire.SceneReply:
        return await self._connection.call(
            wire.ClientMessage(get_scene=wire.GetScene(world=self.name)), wire.SceneReply
        )


def named(name: object, what: str) -> None:
    """Raises TypeError. Without it, `name in world` would ask for world[0], world[1], and so on."""
    if not isinstance(name, str):
        raise TypeError(f"{what} is had by its name, a str, not by {name!r}; `in` and `for` are for states and lists")


def observe(bodies: Sequence[str], velocities: bool, double_precision: bool) -> wire.Observe:
    return wire.Observe(bodies=names(bodies), velocities=velocities, double_precision=double_precision)


def state_in(done: wire.Done) -> State:
    if not done.HasField("state"):
        raise PneumaError("UNSUPPORTED", "this server tells no state with a step")
    return state_of(done.state)
