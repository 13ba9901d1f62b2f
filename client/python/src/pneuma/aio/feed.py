"""What comes of one stream, kept for who reads it."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from pneuma._proto import frame_pb2, session_pb2
from pneuma.errors import PneumaError
from pneuma.frames import Decoded, Event, Frame, Layout, event_of, frame_of
from pneuma.touch import Touch, touch_of

if TYPE_CHECKING:
    from pneuma.decoding import Decoding

# A stream that nobody reads for a while keeps four seconds at 60 Hz, and of a large world no more bytes than these.
frames_kept = 240
frame_bytes_kept = 64 * 2**20
# Half a minute of all that a server tells.
touches_kept = 65_536


@dataclass
class Kept:
    """A frame that waits, with what happened since the one before it."""

    message: frame_pb2.Frame
    layout: Layout
    decoded: Decoded | None  # of a coded stream
    events: tuple[Event, ...]
    missed: tuple[int, int] | None

    @property
    def bytes(self) -> int:
        return self.decoded.bytes if self.decoded else len(self.message.payload) + len(self.message.velocities)


def joined(first: tuple[int, int] | None, second: tuple[int, int] | None) -> tuple[int, int] | None:
    """The ticks from the first to the last that either names."""
    if first is None or second is None:
        return first or second
    return (min(first[0], second[0]), max(first[1], second[1]))


@dataclass(eq=False)
class Reader:
    """One that reads a feed. Frames that it does not take in time make room for later ones: each stands alone."""

    frames: deque[Kept] = field(default_factory=deque)
    arrived: asyncio.Event = field(default_factory=asyncio.Event)
    ended: bool = False
    error: PneumaError | None = None
    events: list[Event] = field(default_factory=list)
    gap: tuple[int, int] | None = None
    bytes: int = 0
    touches: deque[Touch] = field(default_factory=deque)
    touches_dropped: int = 0
    keeps_frames: bool = True

    def keep_touches_only(self) -> None:
        """Nobody asks for frames and events."""
        self.keeps_frames = False
        self.frames.clear()
        self.events.clear()
        self.bytes = 0

    def put(self, message: frame_pb2.Frame, layout: Layout, decoded: Decoded | None) -> None:
        if not self.keeps_frames:
            return
        kept = Kept(message, layout, decoded, tuple(self.events), self.gap)
        self.frames.append(kept)
        self.events.clear()
        self.gap = None
        self.bytes += kept.bytes
        while len(self.frames) > frames_kept or (self.bytes > frame_bytes_kept and len(self.frames) > 1):
            lost = self._pop()
            after = self.frames[0]
            after.events = lost.events + after.events
            after.missed = joined(lost.missed, joined((lost.message.tick, lost.message.tick), after.missed))
        self.arrived.set()

    def put_touches(self, message: session_pb2.Touches) -> None:
        self.touches.extend(touch_of(touch, message.tick) for touch in message.touches)
        self.touches_dropped += message.dropped
        while len(self.touches) > touches_kept:
            self.touches.popleft()
            self.touches_dropped += 1
        self.arrived.set()

    def take_touches(self) -> list[Touch]:
        """All that wait. Raises PneumaError where none do and the connection ended."""
        if not self.touches and self.error:
            raise self.error
        taken = list(self.touches)
        self.touches.clear()
        return taken

    async def next_touch(self) -> Touch | None:
        """The next one; None at the end. Raises PneumaError where the connection ended, after the last one."""
        while not self.touches:
            if await self._is_over():
                return None
        return self.touches.popleft()

    def end(self, error: PneumaError | None) -> None:
        self.ended = True
        self.error = error
        self.arrived.set()

    async def next(self) -> Frame | None:
        """The next frame; None at the end. Raises PneumaError where the connection ended, after the last frame."""
        while not self.frames:
            if await self._is_over():
                return None
        kept = self._pop()
        try:
            return frame_of(kept.message, kept.layout, kept.events, kept.missed, kept.decoded)
        except ValueError as error:
            raise PneumaError("MALFORMED", str(error), "frame") from None

    async def _is_over(self) -> bool:
        """Waits for something to arrive, unless nothing will."""
        if self.error:
            raise self.error
        if self.ended:
            return True
        self.arrived.clear()
        await self.arrived.wait()
        return False

    def _pop(self) -> Kept:
        kept = self.frames.popleft()
        self.bytes -= kept.bytes
        return kept


class Feed:
    """A stream of the connection. Several may read it: asking for the same twice gives one stream."""

    def __init__(
        self,
        subscribed: session_pb2.Subscribed,
        topologies: Mapping[bytes, frame_pb2.Topology],
        ask_for_key: Callable[[], None] = lambda: None,
    ) -> None:
        self.subscribed = subscribed
        self._topologies = topologies
        self._layout: Layout | None = None
        self._last: tuple[frame_pb2.Frame, Layout, Decoded | None] | None = None
        self._decoding: Decoding | None = None
        # Frames of a plain stream count on no grid.
        if subscribed.grid_step_m > 0.0:
            from pneuma.decoding import Decoding  # only here is the codec needed

            self._decoding = Decoding(subscribed, ask_for_key)
        self._readers: list[Reader] = []
        # Replies to Subscribe whose askers did not come yet.
        self._awaited = 0
        # What came before the first reader did: it runs only after the reply was read.
        self._first = Reader()

    def expect(self) -> None:
        """One more reader is told of the stream, and will `join`."""
        self._awaited += 1

    def join(self) -> Reader:
        """A new reader. It begins with the stream's last frame, which one that joins late is not sent."""
        self._awaited -= 1
        if not self._readers:
            reader, self._first = self._first, Reader()
        else:
            reader = Reader()
            if self._last:
                reader.put(*self._last)
        self._readers.append(reader)
        return reader

    def leave(self, reader: Reader) -> bool:
        """Whether that was the last one."""
        if reader not in self._readers:
            return False
        self._readers.remove(reader)
        return not self._readers and not self._awaited

    def layout(self, message: frame_pb2.Layout) -> None:
        self._layout = Layout(message, self._topologies)
        if self._decoding:
            self._decoding.layout(message, self._topologies)

    def frame(self, message: frame_pb2.Frame) -> None:
        # A frame that builds on another is of that one's layout, and does not tell it.
        builds_on_another = message.HasField("base_tick") and message.layout_id == 0
        if self._layout is None or not (builds_on_another or message.layout_id == self._layout.layout_id):
            raise PneumaError("MALFORMED", f"a frame of the layout {message.layout_id}, which was not told")
        decoded = None
        if self._decoding:
            decoded = self._decoding.frame(message, self._layout)
            if decoded is None:
                self._miss(message.tick, message.tick)
                return
        self._last = (message, self._layout, decoded)
        for reader in self._receivers():
            reader.put(*self._last)

    def gap(self, message: frame_pb2.Gap) -> None:
        self._miss(message.from_tick, message.to_tick)

    def _miss(self, from_tick: int, to_tick: int) -> None:
        for reader in self._receivers():
            reader.gap = joined(reader.gap, (from_tick, to_tick))

    def touches(self, message: session_pb2.Touches) -> None:
        for reader in self._receivers():
            reader.put_touches(message)

    def event(self, message: session_pb2.Event) -> None:
        """Takes events of any world, and leaves those of others."""
        if message.world != self.subscribed.world:
            return
        for reader in self._receivers():
            if reader.keeps_frames:
                reader.events.append(event_of(message))
            if message.kind == session_pb2.Event.WORLD_DESTROYED:
                reader.end(None)

    def end(self, error: PneumaError) -> None:
        for reader in self._receivers():
            reader.end(reader.error if reader.ended else error)

    def _receivers(self) -> list[Reader]:
        return self._readers or [self._first]
