"""Records a world's stream, as it comes, into a file."""

from __future__ import annotations

import asyncio
import time
from os import PathLike, fspath
from pathlib import Path
from typing import Self

from pneuma._proto import recording_pb2
from pneuma._proto import session_pb2 as wire
from pneuma.aio.connection import Address, Connection
from pneuma.aio.world import state_in
from pneuma.errors import PneumaError, at_a_blocks_end
from pneuma.messages import whole
from pneuma.native import need_native
from pneuma.state import State

need_native()
from pneuma import _native  # noqa: E402

# What a recording holds (proto/WIRE.md, "Recordings").
recorded_kinds = frozenset(["topology", "layout", "frame", "gap", "event", "applied"])

# What a crash of this program may lose.
flush_interval_s = 0.2

# How long a frame is waited for, of a tick that is done.
frame_patience_s = 2.0

# A server keeps four frames for a reader that is late (proto/WIRE.md, "Slow readers").
frames_at_once = 3


class Recorder:
    """A recording under way, made by `World.record`. It ends by `close`, or as a block at the block's end.

    The first write that fails ends it: the file holds what was written before. `step` raises the error, or else `close`.
    """

    __slots__ = (
        "_connection",
        "_writer",
        "_world",
        "_path",
        "_ticks_a_frame",
        "_tick",
        "_frames",
        "_flushed_s",
        "_error",
        "_came",
    )

    def __init__(self, connection: Connection, world: str, path: str) -> None:
        self._connection = connection
        self._world = world
        self._path = path
        self._writer: _native.RecordingWriter | None = None
        self._ticks_a_frame = 1.0
        self._tick = -1
        self._frames = 0
        self._flushed_s = time.monotonic()
        self._error: PneumaError | None = None  # of a write, until it is told
        self._came = asyncio.Event()

    @classmethod
    async def open(
        cls, address: Address, world: str, path: str | PathLike[str], request: wire.Subscribe, *, replace: bool
    ) -> Self:
        """By a connection of its own, whose stream nobody else reads. Raises PneumaError."""
        if not replace and Path(path).exists():
            raise PneumaError("ALREADY_EXISTS", "is there already; replace=True replaces it", fspath(path))
        recorder = cls(await Connection.open(address), world, fspath(path))
        try:
            await recorder._begin(request, replace)
        except BaseException:
            await recorder._end()
            raise
        return recorder

    async def _begin(self, request: wire.Subscribe, replace: bool) -> None:
        connection = self._connection
        stats = await connection.call(wire.ClientMessage(get_stats=wire.GetStats(world=self._world)), wire.Stats)
        scene = await connection.call(wire.ClientMessage(get_scene=wire.GetScene(world=self._world)), wire.SceneReply)
        early: list[tuple[bytes, wire.ServerMessage]] = []
        connection.tap = lambda data, message: early.append((data, message))
        stream = await connection.call(wire.ClientMessage(subscribe=request), wire.Subscribed)
        connection.feeds.pop(stream.stream_id, None)  # nobody reads what is recorded
        self._ticks_a_frame = stats.rate_hz / stream.rate_hz
        header = recording_pb2.RecordingHeader(
            world=self._world,
            scene=scene.scene,
            stream=stream,
            world_rate_hz=stats.rate_hz,
            started_unix_s=time.time(),
            server_version=connection.welcome.server_version,
        )
        self._writer = _native.RecordingWriter(self._path, header.SerializeToString(), replace)
        connection.tap = self._take
        for data, message in early:
            self._take(data, message)
        await self._comes(stats.tick)  # else the first frame may be of a tick that the caller asks for next

    @property
    def frames(self) -> int:
        """How many were recorded. After a write that failed, the last ones of them are not in the file."""
        return self._frames

    async def step(self, ticks: int = 1) -> State:
        """Steps the paused world, no faster than it is recorded: no frame is lost. Returns the state at the last tick.

        Raises PneumaError where the world has done some of the ticks, and the recording has not:
        - A frame does not come: UNAVAILABLE.
        - The file cannot be written. The recording has ended then.
        """
        left = whole(ticks, "step.ticks", least=1)
        while True:
            await self._raise_if_ended()
            part = min(left, max(1, int(frames_at_once * self._ticks_a_frame)))
            left -= part
            request = wire.Step(world=self._world, ticks=part, observe=None if left else wire.Observe())
            done = await self._connection.call(wire.ClientMessage(step=request), wire.Done)
            came = await self._comes(done.tick)
            await self._raise_if_ended()
            if not came:
                what = f"the frame of tick {done.tick} has not come for {frame_patience_s:g} s"
                raise PneumaError("UNAVAILABLE", what, "recorder.step")
            if not left:
                return state_in(done)

    async def close(self) -> None:
        """Waits for the frame of the world's last tick, and ends the file.

        Raises PneumaError where a write failed, unless `step` has raised that. Once closed, does nothing.
        """
        if self._writer is None:
            return
        try:
            if not self._error:
                stats = await self._connection.call(
                    wire.ClientMessage(get_stats=wire.GetStats(world=self._world)), wire.Stats
                )
                await self._comes(stats.tick)
        except PneumaError:
            pass  # the world, or the server, has gone: what came is all there is
        finally:
            await self._end()
        self._raise_once()

    async def _end(self) -> None:
        """Ends the file and the stream. What fails then follows from the first error, if there was one."""
        self._connection.tap = None
        writer, self._writer = self._writer, None
        # The file comes first: a cancellation during what is awaited must not leave it unfinished.
        try:
            if writer:
                writer.finish()
        except PneumaError as error:
            self._error = self._error or error
        finally:
            await self._connection.close()

    async def _raise_if_ended(self) -> None:
        """A write that failed ends the recording, and is told."""
        if self._error:
            await self._end()
        self._raise_once()
        if self._writer is None:
            raise PneumaError("FAILED_PRECONDITION", f"the recording of {self._path} has ended", "recorder.step")

    async def _comes(self, tick: int) -> bool:
        """Waits for the stream's first frame, and its last up to that tick; false where one is long overdue."""
        while (self._frames == 0 or self._tick + self._ticks_a_frame <= tick) and not self._error:
            self._came.clear()
            try:
                await asyncio.wait_for(self._came.wait(), frame_patience_s)
            except asyncio.TimeoutError:
                return False
        return True

    def _raise_once(self) -> None:
        """Raises the error of a write, if it was not told yet."""
        error, self._error = self._error, None
        if error:
            raise error

    def _take(self, data: bytes, message: wire.ServerMessage) -> None:
        kind = message.WhichOneof("message")
        if message.request_id or kind not in recorded_kinds or self._writer is None or self._error:
            return
        if kind == "event" and message.event.world != self._world:
            return
        if kind == "frame":
            self._tick = message.frame.tick
        elif kind == "gap":
            self._tick = message.gap.to_tick
        try:
            self._writer.append(data)
            self._frames += kind == "frame"
            if time.monotonic() - self._flushed_s >= flush_interval_s:
                self._writer.flush()
                self._flushed_s = time.monotonic()
        except PneumaError as error:
            self._error = error  # told by `step` or `close`: the world goes on
        self._came.set()

    def __repr__(self) -> str:
        ended = "" if self._writer else ", ended"
        return f"<Recorder of {self._world}: {self._frames} frames in {self._path}{ended}>"

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, kind: object, raised: BaseException | None, trace: object) -> None:
        with at_a_blocks_end(raised):
            await self.close()
