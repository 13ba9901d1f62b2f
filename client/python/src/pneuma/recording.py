"""Recordings, `.pneuma` files, as arrays. See proto/WIRE.md, "Recordings"."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from functools import cached_property
from os import PathLike, fspath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pneuma._proto import frame_pb2, recording_pb2, session_pb2
from pneuma.aio.feed import joined
from pneuma.errors import PneumaError
from pneuma.frames import Event, Frame, FrameBody, Layout, event_of, frame_of
from pneuma.named import not_there
from pneuma.scene import Scene

Array = NDArray[np.float64]
Array32 = NDArray[np.float32]


@dataclass(frozen=True, eq=False, repr=False)
class RecordedBody:
    """A soft body, frame by frame; NaN where a frame does not have it.

    positions, velocities: (frames, n, 3) float32, m and m/s. faces: (m, 3) indices of vertices.
    volume_m3 and what follows: (frames,). What was not recorded is None.
    """

    name: str
    positions: Array32
    velocities: Array32 | None
    faces: NDArray[np.uint32]
    volume_m3: Array | None
    pressure_pa: Array | None
    kinetic_j: Array | None
    elastic_j: Array | None

    def __repr__(self) -> str:
        frames, vertices, _ = self.positions.shape
        return f"<{self.name}, {vertices} vertices, {frames} frames>"


@dataclass(frozen=True, eq=False)
class Change:
    """A change that was made to the world while it was recorded.

    kind: such as "impulse", "edit", "grab" or "reset". tick: ticks that the world had done.
    request: what was asked for, as the wire has it: `change.request.impulse.x` of an impulse.
    grab_id: the id that a grab got; 0 of others.
    session_id: of the client that asked; 0 where it had gone.
    """

    kind: str
    tick: int
    request: Any
    grab_id: int
    session_id: int


@dataclass(frozen=True, eq=False, repr=False)
class Recording:
    """What a file holds, made by `pneuma.read`.

    frames: each as a stream gives it. scene: what the world was when the recording began.
    events: what happened, in order; those after the last frame too. changes: what was asked of the world, in order.
    missed: the first and the last tick of each run of frames that were left out; one after the last frame too.
    max_error_m: no vertex is off by more. started_unix_s: seconds since 1970.
    damage: why the file ends before its end, in words; empty where it is whole.
    """

    world: str
    scene: Scene
    frames: tuple[Frame, ...]
    events: tuple[Event, ...]
    changes: tuple[Change, ...]
    missed: tuple[tuple[int, int], ...]
    max_error_m: float
    started_unix_s: float
    damage: str

    @cached_property
    def times_s(self) -> Array:
        """(frames,): the world's time, which goes back to 0 where it was reset."""
        return np.array([frame.time_s for frame in self.frames])

    @cached_property
    def ticks(self) -> NDArray[np.int64]:
        """(frames,)"""
        return np.array([frame.tick for frame in self.frames], np.int64)

    @cached_property
    def bodies(self) -> tuple[str, ...]:
        """The names of the soft bodies, of any frame."""
        return tuple(dict.fromkeys(name for frame in self.frames for name in frame.bodies))

    def __getitem__(self, body: str) -> RecordedBody:
        """A soft body's arrays. Raises PneumaError where it had several meshes: each frame has the arrays of its own."""
        parts = self._parts(body)
        there = [part for part in parts if part is not None]
        if not there:
            raise not_there("soft body", body, self.bodies)
        counts = dict.fromkeys(len(part.positions) for part in there)
        meshes = {id(part.faces): part.faces for part in there}  # frames of a layout share one
        if len(counts) > 1:
            what = f"{body} has {' and then '.join(map(str, counts))} vertices: take its arrays from the frames"
            raise PneumaError("FAILED_PRECONDITION", what, "bodies")
        if not all(np.array_equal(faces, there[0].faces) for faces in meshes.values()):
            what = f"{body} has several meshes of {len(there[0].positions)} vertices: take its arrays from the frames"
            raise PneumaError("FAILED_PRECONDITION", what, "bodies")
        return RecordedBody(
            body,
            stacked(parts, "positions"),
            None if there[0].velocities is None else stacked(parts, "velocities"),
            there[0].faces,
            *(of_each(parts, each.name) for each in fields(RecordedBody)[4:]),
        )

    def columns(self) -> dict[str, NDArray[np.float64] | NDArray[np.int64]]:
        """(frames,) each, to make a table of: tick, time_s, and of each body the mean of its vertices and its scalars.

        A body that had several meshes has its columns too.
        """
        table: dict[str, NDArray[np.float64] | NDArray[np.int64]] = {"tick": self.ticks, "time_s": self.times_s}
        for name in self.bodies:
            parts = self._parts(name)
            middle = np.array([middle_of(part) for part in parts])
            table |= {f"{name}.{axis}_m": middle[:, i] for i, axis in enumerate("xyz")}
            for each in fields(RecordedBody)[4:]:
                column = of_each(parts, each.name)
                if column is not None:
                    table[f"{name}.{each.name}"] = column
        return table

    def _parts(self, body: str) -> list[FrameBody | None]:
        """Of each frame."""
        return [frame.bodies.get(body) for frame in self.frames]

    def __len__(self) -> int:
        return len(self.frames)

    def __repr__(self) -> str:
        return f"<Recording of {self.world}: {len(self)} frames of {', '.join(self.bodies)}>"


def read(path: str | PathLike[str]) -> Recording:
    """Reads a recording, of `World.record` or `pneuma record`. One that was cut off is read up to there.

    Raises PneumaError where the file is none, or is not there.
    """
    from pneuma.native import need_native

    need_native()
    from pneuma import _native

    reader = _native.RecordingReader(fspath(path))
    header = recording_pb2.RecordingHeader.FromString(reader.header)
    contents = Contents(header.stream)
    contents.take(iter(reader.next, None))
    return Recording(
        world=header.world,
        scene=Scene.of_message(header.scene),
        frames=tuple(contents.frames),
        events=tuple(contents.events),
        changes=tuple(contents.changes),
        missed=tuple(contents.missed),
        max_error_m=header.stream.max_error_m,
        started_unix_s=header.started_unix_s,
        damage=reader.damage,
    )


class Contents:
    """What a stream's messages hold."""

    def __init__(self, stream: session_pb2.Subscribed) -> None:
        from pneuma.decoding import Decoding

        self.frames: list[Frame] = []
        self.events: list[Event] = []
        self.changes: list[Change] = []
        self.missed: list[tuple[int, int]] = []
        self._decoding = Decoding(stream)
        self._topologies: dict[bytes, frame_pb2.Topology] = {}
        self._layout: Layout | None = None
        self._gap: tuple[int, int] | None = None  # since the last frame
        self._events_told = 0  # by the frames

    def take(self, messages: Iterable[bytes]) -> None:
        """All of them. Raises PneumaError where one is wrong."""
        for data in messages:
            self._take(session_pb2.ServerMessage.FromString(data))
        if self._gap:
            self.missed.append(self._gap)

    def _take(self, message: session_pb2.ServerMessage) -> None:
        kind = message.WhichOneof("message")
        if kind == "topology":
            self._topologies[message.topology.hash] = message.topology
        elif kind == "layout":
            self._layout = Layout(message.layout, self._topologies)
            self._decoding.layout(message.layout, self._topologies)
        elif kind == "event":
            self.events.append(event_of(message.event))
        elif kind == "applied":
            self.changes.append(change_of(message.applied))
        elif kind == "gap":
            self._gap = joined(self._gap, (message.gap.from_tick, message.gap.to_tick))
        elif kind == "frame" and self._layout:
            self._take_frame(message.frame, self._layout)

    def _take_frame(self, message: frame_pb2.Frame, layout: Layout) -> None:
        decoded = self._decoding.frame(message, layout)
        if decoded is None:
            self._gap = joined(self._gap, (message.tick, message.tick))
            return
        events = tuple(self.events[self._events_told :])
        self.frames.append(frame_of(message, layout, events, self._gap, decoded))
        self._events_told = len(self.events)
        if self._gap:
            self.missed.append(self._gap)
        self._gap = None


def change_of(message: session_pb2.Applied) -> Change:
    kind = message.command.WhichOneof("request") or ""
    request = getattr(message.command, kind) if kind else None
    return Change(kind, message.tick, request, message.grab_id, message.session_id)


def of_each(parts: list[FrameBody | None], name: str) -> Array | None:
    """(frames,) of the numbers of that name, NaN where a frame does not have the body; None where it was not recorded."""
    numbers = [None if part is None else getattr(part, name) for part in parts]
    if all(number is None for number in numbers):
        return None
    return np.array([np.nan if number is None else number for number in numbers])


def middle_of(part: FrameBody | None) -> Array:
    """(3,): the mean of the vertices, m."""
    if part is None:
        return np.full(3, np.nan)
    middle: Array = part.positions.mean(axis=0, dtype=np.float64)
    return middle


def stacked(parts: list[FrameBody | None], name: str) -> Array32:
    """(frames, n, 3) of the arrays of that name."""
    shape = next(getattr(part, name).shape for part in parts if part is not None)
    absent = np.full(shape, np.nan, np.float32)
    return np.stack([absent if part is None else getattr(part, name) for part in parts])
