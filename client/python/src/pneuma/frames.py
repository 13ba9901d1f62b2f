"""Frames as numpy arrays: of a plain stream (proto/WIRE.md, "Plain frames"), and what the codec made of others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from pneuma._proto import frame_pb2 as wire
from pneuma._proto import session_pb2
from pneuma.errors import PneumaError
from pneuma.named import Named, not_there
from pneuma.state import Array, wxyz, xyz

Floats32: TypeAlias = NDArray[np.float32]
Number = TypeVar("Number", np.float32, np.int16)


@dataclass(frozen=True, eq=False, repr=False)
class FrameBody:
    """A soft body in a frame.

    positions: (n, 3) float32, metres. velocities: the same in m/s, or None. faces: (m, 3) indices of positions.
    volume_m3 and what follows: None where `scalars` was not asked for.
    """

    name: str
    positions: Floats32
    velocities: Floats32 | None
    faces: NDArray[np.uint32]
    volume_m3: float | None = None
    pressure_pa: float | None = None
    kinetic_j: float | None = None
    elastic_j: float | None = None
    asleep: bool | None = None

    def __repr__(self) -> str:
        return f"<{self.name}, {len(self.positions)} vertices>"


@dataclass(frozen=True, eq=False)
class Pose:
    """Where a rigid body or collider is: position (3,) in metres, orientation (4,) w x y z."""

    name: str
    position: Array
    orientation: Array


@dataclass(frozen=True, eq=False)
class Contact:
    """A vertex of a soft body that is held off something; other is empty where the stream does not hold that."""

    body: str
    vertex: int
    other: str
    normal: Array


@dataclass(frozen=True, eq=False)
class Event:
    """What happened in the world, such as BODY_BURST. body and joint may be empty."""

    kind: str
    tick: int
    body: str
    joint: str
    detail: str


@dataclass(frozen=True, eq=False, repr=False)
class Frame:
    """A world at one tick, within the stream's error bound.

    positions, velocities: (N, 3), those of all bodies, one after the other. frame["ball"] is one body's part of them.
    missed: the first and the last tick whose frames, before this one, were left out: nobody took them in time, or they
        came damaged.
    """

    tick: int
    time_s: float
    positions: Floats32
    velocities: Floats32 | None
    bodies: Mapping[str, FrameBody]
    solids: Mapping[str, Pose]
    contacts: tuple[Contact, ...] = ()
    events: tuple[Event, ...] = ()
    missed: tuple[int, int] | None = None

    def __getitem__(self, body: str) -> FrameBody:
        if body not in self.bodies:
            hint = "; it is rigid, or a collider: frame.solids has it" if body in self.solids else ""
            raise not_there("soft body", body, self.bodies, hint)
        return self.bodies[body]

    def __repr__(self) -> str:
        return f"<Frame at tick {self.tick}: {', '.join([*self.bodies, *self.solids])}>"


class Layout:
    """What the frames of a stream speak of: which rows of a payload are whose.

    Raises PneumaError where a topology is missing.
    """

    def __init__(self, message: wire.Layout, topologies: Mapping[bytes, wire.Topology]) -> None:
        self.layout_id = message.layout_id
        self.names: list[str] = [body.name for body in message.soft_bodies]
        self.solids: list[str] = [solid.name for solid in message.solids]
        meshes = [topology_of(body, topologies) for body in message.soft_bodies]
        self.faces = [np.array(mesh.indices, np.uint32).reshape(-1, 3) for mesh in meshes]
        ends = np.cumsum([0, *(mesh.vertex_count for mesh in meshes)]).tolist()
        self.rows = [slice(begin, end) for begin, end in zip(ends, ends[1:])]
        self.vertices: int = ends[-1]

    def solid(self, index: int) -> str:
        return self.solids[index] if index < len(self.solids) else ""

    def body(self, index: int) -> str:
        return self.names[index] if index < len(self.names) else ""


def topology_of(body: wire.Layout.Soft, topologies: Mapping[bytes, wire.Topology]) -> wire.Topology:
    """Raises PneumaError where it is missing."""
    topology = topologies.get(body.topology_hash)
    if topology is None:
        what = f"the topology {body.topology_hash.hex()} of {body.name} was not told"
        raise PneumaError("MALFORMED", what, "layout.soft_bodies")
    return topology


@dataclass(frozen=True, eq=False)
class Decoded:
    """What a frame says of vertices and solids: positions and velocities as those of `Frame`."""

    time_s: float
    positions: Floats32
    velocities: Floats32 | None
    poses: tuple[Pose, ...]

    @property
    def bytes(self) -> int:
        return self.positions.nbytes + (0 if self.velocities is None else self.velocities.nbytes)


def decoded_of(message: wire.Frame, layout: Layout) -> Decoded:
    """Of a plain frame. Raises ValueError where the payloads are not of the layout's vertices."""
    grid = message.int16
    if message.HasField("int16"):
        positions = (integers_of(message.payload, layout) * grid.step_m + xyz(grid.origin)).astype(np.float32)
    else:
        positions = floats_of(message.payload, layout)
    velocities = None
    if message.velocities and grid.velocity_step_m_s:
        velocities = (integers_of(message.velocities, layout) * grid.velocity_step_m_s).astype(np.float32)
    elif message.velocities:
        velocities = floats_of(message.velocities, layout)
    poses = (Pose(layout.solid(p.solid), xyz(p.position), wxyz(p.orientation)) for p in message.poses)
    return Decoded(message.time_s, positions, velocities, tuple(poses))


def frame_of(
    message: wire.Frame,
    layout: Layout,
    events: tuple[Event, ...] = (),
    missed: tuple[int, int] | None = None,
    decoded: Decoded | None = None,
) -> Frame:
    """The frame; of a plain one nothing is decoded yet. Raises ValueError as `decoded_of`."""
    decoded = decoded or decoded_of(message, layout)
    positions, velocities = decoded.positions, decoded.velocities
    bodies = {
        name: FrameBody(
            name,
            positions[part],
            None if velocities is None else velocities[part],
            layout.faces[index],
            **scalars_of(message.scalars, index),
        )
        for index, (name, part) in enumerate(zip(layout.names, layout.rows))
    }
    return Frame(
        tick=message.tick,
        time_s=decoded.time_s,
        positions=positions,
        velocities=velocities,
        bodies=bodies,
        solids=Named("rigid body or collider", {pose.name: pose for pose in decoded.poses}),
        contacts=tuple(contact_of(contact, layout) for contact in message.contacts),
        events=events,
        missed=missed,
    )


def floats_of(payload: bytes, layout: Layout) -> Floats32:
    return checked(np.frombuffer(payload, "<f4").reshape(-1, 3), layout)


def integers_of(payload: bytes, layout: Layout) -> NDArray[np.int16]:
    return checked(np.frombuffer(payload, "<i2").reshape(-1, 3), layout)


def checked(numbers: NDArray[Number], layout: Layout) -> NDArray[Number]:
    """(N, 3), as it is."""
    if len(numbers) != layout.vertices:
        raise ValueError(f"a frame of {len(numbers)} vertices; the layout has {layout.vertices}")
    return numbers


def scalars_of(scalars: wire.Scalars, index: int) -> dict[str, Any]:
    return {each.name: values[index] for each, values in scalars.ListFields() if index < len(values)}


def contact_of(message: wire.Contact, layout: Layout) -> Contact:
    kind = message.WhichOneof("other")
    other = layout.body(message.other_soft) if kind == "other_soft" else ""
    other = layout.solid(message.other_solid) if kind == "other_solid" else other
    return Contact(layout.body(message.soft), message.vertex, other, xyz(message.normal))


def event_of(message: session_pb2.Event) -> Event:
    kind = message.kind if message.kind in session_pb2.Event.Kind.values() else 0
    return Event(session_pb2.Event.Kind.Name(kind), message.tick, message.body, message.joint, message.detail)
