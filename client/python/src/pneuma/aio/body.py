"""A soft or rigid body of a world, by name."""

from __future__ import annotations

from typing import Self

from pneuma import messages
from pneuma._proto import scene_types
from pneuma._proto import session_pb2 as wire
from pneuma.aio.connection import Connection
from pneuma.arrays import Points, Rotation, Vector
from pneuma.errors import PneumaError, at_a_blocks_end
from pneuma.messages import parts_of, whole
from pneuma.state import little_endian


class Grab:
    """A vertex that is held to a point by a damped spring, made by `Body.grab`. As a block, lets go at its end."""

    __slots__ = ("_connection", "_world", "_grab_id", "body", "vertex", "__weakref__")

    def __init__(self, connection: Connection, world: str, grabbed: wire.Grabbed) -> None:
        self._connection = connection
        self._world = world
        self._grab_id = grabbed.grab_id
        self.body = grabbed.body
        self.vertex = grabbed.vertex

    def __repr__(self) -> str:
        return f"<Grab of vertex {self.vertex} of {self.body} of the world {self._world}>"

    async def move(self, target: Vector) -> int:
        """Holds it to another point, metres. Returns the first tick that shows it."""
        request = wire.MoveGrab(world=self._world, grab_id=self._grab_id)
        messages.fill(request.target, target, "move_grab.target")
        return (await self._connection.call(wire.ClientMessage(move_grab=request), wire.Done)).tick

    async def release(self) -> int:
        """Lets go. Returns the first tick that shows it."""
        request = wire.ReleaseGrab(world=self._world, grab_id=self._grab_id)
        return (await self._connection.call(wire.ClientMessage(release_grab=request), wire.Done)).tick

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, kind: object, raised: BaseException | None, trace: object) -> None:
        with at_a_blocks_end(raised):
            await self.release()


class Body:
    """A name in a world; whether there is a body of that name, the first request tells (NOT_FOUND)."""

    __slots__ = ("_connection", "_world", "name", "__weakref__")

    def __init__(self, connection: Connection, world: str, name: str) -> None:
        self._connection = connection
        self._world = world
        self.name = name

    def __repr__(self) -> str:
        return f"<Body {self.name} of the world {self._world}>"

    async def kick(
        self,
        impulse: Vector,
        *,
        at: Vector | None = None,
        radius_m: float = 0.0,
        vertex: int | None = None,
        ray: tuple[Vector, Vector] | None = None,
    ) -> int:
        """Hits the body with an impulse in N s: all of it, or where `at`, `vertex` or `ray` says.

        at: a point in metres, whose nearest vertex is hit; those within radius_m share the impulse.
        vertex: its index.
        ray: origin and direction; the body is hit where the ray meets it.

        Returns the first tick that shows it.
        """
        request = wire.Impulse(world=self._world, body=self.name)
        messages.fill(request.impulse, impulse, "impulse.impulse")
        choose_place(request, "impulse", at, radius_m, vertex, ray)
        return (await self._connection.call(wire.ClientMessage(impulse=request), wire.Done)).tick

    async def grab(
        self,
        target: Vector,
        *,
        at: Vector | None = None,
        vertex: int | None = None,
        ray: tuple[Vector, Vector] | None = None,
        stiffness_n_m: float = 0.0,
        damping_n_s_m: float = 0.0,
        radius_m: float = 0.0,
    ) -> Grab:
        """Holds a vertex to `target`, metres, until it is released: the one at `at`, `vertex` or `ray`.

        stiffness_n_m: 0 is the body's own.
        damping_n_s_m: 0 is critical for the vertex.
        radius_m: the skin this far around the vertex is held too, the further off the less; 0 is the vertex alone.
        """
        request = wire.Grab(
            world=self._world,
            body=self.name,
            stiffness_n_m=stiffness_n_m,
            damping_n_s_m=damping_n_s_m,
            radius_m=radius_m,
        )
        messages.fill(request.target, target, "grab.target")
        choose_place(request, "grab", at, 0.0, vertex, ray)
        return Grab(
            self._connection, self._world, await self._connection.call(wire.ClientMessage(grab=request), wire.Grabbed)
        )

    async def change(self, change: scene_types.SoftBodyChange | scene_types.RigidBodyChange) -> int:
        """Changes what the body is, by an edit; `name` need not be given. Returns the first tick that shows it."""
        edit = wire.Edit(world=self._world)
        messages.fill(edit.edit.changes.add(), change, "edit.edit.changes[0]")
        changed = edit.edit.changes[0]
        content = getattr(changed, changed.WhichOneof("change"))
        if content.name not in ("", self.name):
            raise messages.invalid("edit.edit.changes[0].name", f'is "{content.name}"; this changes "{self.name}"')
        content.name = self.name
        return (await self._connection.call(wire.ClientMessage(edit=edit), wire.Done)).tick

    async def place_vertices(self, positions: Points | None = None, velocities: Points | None = None) -> int:
        """Puts all vertices of a soft body elsewhere. The world must be paused. What is None stays.

        positions: (n, 3), metres, in the mesh's order.
        velocities: (n, 3), m/s.

        Returns the first tick that shows it.
        """
        request = wire.SetState(world=self._world, double_precision=True)
        soft = request.soft_bodies.add(name=self.name)
        soft.positions = little_endian(positions, "set_state.soft_bodies[0].positions")
        soft.velocities = little_endian(velocities, "set_state.soft_bodies[0].velocities")
        return await self._place(request, soft_expected=True)

    async def place(
        self,
        position: Vector | None = None,
        orientation: Rotation | None = None,
        velocity: Vector | None = None,
        angular_velocity: Vector | None = None,
    ) -> int:
        """Puts a rigid body elsewhere. The world must be paused. What is None stays.

        position: metres, of the centre of mass.
        orientation: w x y z.
        velocity, angular_velocity: m/s and rad/s.

        Returns the first tick that shows it.
        """
        request = wire.SetState(world=self._world)
        rigid = request.rigid_bodies.add(name=self.name)
        given = {
            "position": position,
            "orientation": orientation,
            "velocity": velocity,
            "angular_velocity": angular_velocity,
        }
        messages.fill(rigid, given, "set_state.rigid_bodies[0]")
        return await self._place(request, soft_expected=False)

    async def _place(self, request: wire.SetState, *, soft_expected: bool) -> int:
        """Where the body is of the other kind, the error names the method for it."""
        try:
            return (await self._connection.call(wire.ClientMessage(set_state=request), wire.Done)).tick
        except PneumaError as error:
            if error.code != "NOT_FOUND":
                raise
            stats = await self._connection.call(
                wire.ClientMessage(get_stats=wire.GetStats(world=self._world)), wire.Stats
            )
            others = stats.rigid_bodies if soft_expected else stats.soft_bodies
            if self.name not in [other.name for other in others]:
                raise
        what = "is rigid: `place`" if soft_expected else "is soft: `place_vertices`"
        raise messages.invalid("set_state", f'"{self.name}" {what} puts it elsewhere')


def choose_place(
    request: wire.Impulse | wire.Grab,
    where: str,
    at: Vector | None,
    radius_m: float,
    vertex: int | None,
    ray: tuple[Vector, Vector] | None,
) -> None:
    """Sets the place of an Impulse or a Grab; at most one is given."""
    if sum(place is not None for place in (at, vertex, ray)) > 1:
        raise messages.invalid(where, "at, vertex and ray: one at most")
    if at is not None:
        messages.fill(request.near, {"position": at, "radius_m": radius_m}, f"{where}.near")
    elif ray is not None:
        origin, direction = parts_of(ray, f"{where}.ray", "origin", "direction")
        messages.fill(request.ray, {"origin": origin, "direction": direction, "radius_m": radius_m}, f"{where}.ray")
    elif vertex is not None:
        request.vertex = whole(vertex, f"{where}.vertex")
