"""Recordings, `.pneuma` files, as arrays. See proto/WIRE.md, "Recordings"."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import cached_property
from os import PathLike, fspath

import numpy as np
from numpy.typing import NDArray

from pneuma._proto import frame_pb2, recording_pb2, session_pb2
from pneuma.aio.feed import joined
from pneuma.errors import PneumaError
from pneuma.frames import Event, Frame, FrameBody, Layout, event_of, frame_of
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


@dataclass(frozen=True, eq=False, repr=False)
class Recording:
    """What a file holds, made by `pneuma.read`.

    frames: each as a stream gives it. scene: what the world was when the recording began.
    max_error_m: no vertex is off by more. started_unix_s: seconds since 1970.
    damage: why the file ends before its end, in words; empty where it is whole.
    """

    world: str
    scene: Scene
    frames: tuple[Frame, ...]
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

    @property
    def events(self) -> tuple[Event, ...]:
        """What happened, in order."""
        return tuple(event for frame in self.frames for event in frame.events)

    def __getitem__(self, body: str) -> RecordedBody:
        """A soft body's arrays. Raises PneumaError where it had meshes of several sizes: `frames` has those."""
        parts = [frame.bodies.get(body) for frame in self.frames]
        there = [part for part in parts if part is not None]
        if not there:
            raise KeyError(f"no soft body {body} (there are {', '.join(self.bodies) or 'none'})")
        counts = dict.fromkeys(len(part.positions) for part in there)
        if len(counts) > 1:
            what = f"{body} has {' and then '.join(map(str, counts))} vertices: take its arrays from the frames"
            raise PneumaError("FAILED_PRECONDITION", what, "bodies")

        def of_each(name: str) -> Array | None:
            if getattr(there[0], name) is None:
                return None
            return np.array([np.nan if part is None else getattr(part, name) for part in parts])

        return RecordedBody(
            body,
            stacked(parts, "positions"),
            None if there[0].velocities is None else stacked(parts, "velocities"),
            there[0].faces,
            *(of_each(each.name) for each in fields(RecordedBody)[4:]),
        )

    def columns(self) -> dict[str, NDArray[np.float64] | NDArray[np.int64]]:
        """(frames,) each, to make a table of: tick, time_s, and of each body the mean of its vertices and its scalars."""
        table: dict[str, NDArray[np.float64] | NDArray[np.int64]] = {"tick": self.ticks, "time_s": self.times_s}
        for name in self.bodies:
            body = self[name]
            middle = body.positions.mean(axis=1, dtype=np.float64)
            table |= {f"{name}.{axis}_m": middle[:, i] for i, axis in enumerate("xyz")}
            for each in fields(RecordedBody)[4:]:
                column = getattr(body, each.name)
                if column is not None:
                    table[f"{name}.{each.name}"] = column
        return table

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
    return Recording(
        world=header.world,
        scene=Scene.of_message(header.scene),
        frames=tuple(frames_of(header.stream, iter(reader.next, None))),
        max_error_m=header.stream.max_error_m,
        started_unix_s=header.started_unix_s,
        damage=reader.damage,
    )


def frames_of(stream: session_pb2.Subscribed, messages: Iterator[bytes]) -> Iterator[Frame]:
    """The frames of a stream's messages."""
    from pneuma.decoding import Decoding

    decoding = Decoding(stream)
    topologies: dict[bytes, frame_pb2.Topology] = {}
    layout: Layout | None = None
    events: list[Event] = []
    missed: tuple[int, int] | None = None
    for data in messages:
        message = session_pb2.ServerMessage.FromString(data)
        kind = message.WhichOneof("message")
        if kind == "topology":
            topologies[message.topology.hash] = message.topology
        elif kind == "layout":
            decoding.layout(message.layout, topologies)
            layout = Layout(message.layout, topologies)
        elif kind == "event":
            events.append(event_of(message.event))
        elif kind == "gap":
            missed = joined(missed, (message.gap.from_tick, message.gap.to_tick))
        elif kind == "frame" and layout:
            decoded = decoding.frame(message.frame, layout)
            if decoded is None:
                missed = joined(missed, (message.frame.tick, message.frame.tick))
                continue
            yield frame_of(message.frame, layout, tuple(events), missed, decoded)
            events, missed = [], None


def stacked(parts: list[FrameBody | None], name: str) -> Array32:
    """(frames, n, 3) of the arrays of that name."""
    shape = next(getattr(part, name).shape for part in parts if part is not None)
    absent = np.full(shape, np.nan, np.float32)
    return np.stack([absent if part is None else getattr(part, name) for part in parts])
