"""Frames and touches of a world, as they come."""

from __future__ import annotations

from typing import Self

from pneuma._proto import session_pb2 as wire
from pneuma.aio.connection import Connection
from pneuma.aio.feed import Feed, Reader
from pneuma.errors import PneumaError
from pneuma.frames import Frame
from pneuma.touch import Touch


class Subscription:
    """What a server tells of a world unasked, from `open` to `close`."""

    __slots__ = ("_connection", "_request", "_feed", "_reader", "__weakref__")

    def __init__(self, connection: Connection, request: wire.Subscribe) -> None:
        self._connection = connection
        self._request = request
        self._feed: Feed | None = None
        self._reader: Reader | None = None

    @property
    def subscribed(self) -> wire.Subscribed:
        """What the server made of the request: rate_hz, max_error_m. Raises PneumaError before the stream has begun."""
        if self._feed is None:
            raise PneumaError("FAILED_PRECONDITION", "the stream has not begun", "stream")
        return self._feed.subscribed

    async def open(self) -> Self:
        """Subscribes, if it has not yet."""
        if self._reader is None:
            reply = await self._connection.call(wire.ClientMessage(subscribe=self._request), wire.Subscribed)
            self._feed = self._connection.feeds[reply.stream_id]
            self._reader = self._feed.join()
        return self

    def close(self) -> None:
        """Unsubscribes."""
        if self._feed is None or self._reader is None:
            return
        self._reader.end(None)
        if self._feed.leave(self._reader):
            stream_id = self._feed.subscribed.stream_id
            self._connection.feeds.pop(stream_id, None)
            self._connection.tell(wire.ClientMessage(unsubscribe=wire.Unsubscribe(stream_id=stream_id)))

    async def _opened(self) -> Reader:
        await self.open()
        assert self._reader
        return self._reader

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self._request.world}>"

    def __aiter__(self) -> Self:
        return self

    async def __aenter__(self) -> Self:
        return await self.open()

    async def __aexit__(self, *_: object) -> None:
        self.close()

    def __del__(self) -> None:
        self.close()


class Stream(Subscription):
    """An iterator over frames, made by `World.stream`.

    It ends with its world. Where the connection ends, it raises PneumaError. It subscribes as a block, or when the first
    frame is asked for. It unsubscribes at the block's end, by `close`, or once nobody holds it any more.
    """

    __slots__ = ()

    async def next(self) -> Frame | None:
        """The next frame; None once the world is destroyed or the stream closed."""
        return await (await self._opened()).next()

    async def __anext__(self) -> Frame:
        frame = await self.next()
        if frame is None:
            raise StopAsyncIteration
        return frame


class TouchStream(Subscription):
    """An iterator over touches, made by `World.touches`. It begins and ends as a Stream does.

    The first tick after it has begun tells what touches already; what sleeps is told when it wakes. One at a time tells
    the touches of a world. A reset or a rewind ends all touches: they begin anew.
    """

    __slots__ = ()

    async def take(self) -> list[Touch]:
        """All that came since the last time. After a step, that is all of its ticks.

        Raises PneumaError before the stream has begun: what touched until then, nobody has heard.
        """
        if self._reader is None:
            raise PneumaError(
                "FAILED_PRECONDITION", "the stream has not begun: use it as a block, or open it", "touches"
            )
        return self._reader.take_touches()

    async def next(self) -> Touch | None:
        """The next touch; None once the world is destroyed or the stream closed."""
        return await (await self._opened()).next_touch()

    @property
    def dropped(self) -> int:
        """Touches that there was no room for: the server tells so many a second, and a script that takes none keeps the
        last ones."""
        return self._reader.touches_dropped if self._reader else 0

    async def open(self) -> Self:
        """Subscribes, if it has not yet. Raises PneumaError where another one is open."""
        if self._reader is None:
            worlds = self._connection.touched_worlds
            if self._request.world in worlds:
                # Asked for once more, the server would tell the first one what this one wishes.
                raise PneumaError("FAILED_PRECONDITION", "another stream tells the touches of this world", "touches")
            worlds.add(self._request.world)
            try:
                await super().open()
            except BaseException:
                worlds.discard(self._request.world)
                raise
            assert self._reader
            self._reader.keep_touches_only()
        return self

    def close(self) -> None:
        """Unsubscribes."""
        if self._reader is not None:
            self._connection.touched_worlds.discard(self._request.world)
        super().close()

    async def __anext__(self) -> Touch:
        touch = await self.next()
        if touch is None:
            raise StopAsyncIteration
        return touch
