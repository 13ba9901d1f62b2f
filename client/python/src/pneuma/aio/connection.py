"""One connection to a server: requests that wait for their replies, and what comes unasked."""

from __future__ import annotations

import asyncio
import contextlib
import ssl
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import TypeVar

from pneuma._proto import frame_pb2, session_pb2
from pneuma.aio.feed import Feed
from pneuma.envelope import Messages, cut, enveloped
from pneuma.errors import PneumaError, error_of

protocol_version = 1
# What a server takes of one that it has not welcomed.
hello_bytes_max = 4096
# The server pings every 15 s: two are missing.
silence_s = 40.0
# How long a request waits in all because the server asks for it. Past that, the error is raised.
retry_s_max = 60.0

# They take as long as what they simulate, build or read.
lasting_requests = frozenset(
    ["step", "step_until", "branch_world", "rewind_world", "create_world", "restore_world", "take_snapshot"]
)

# How many branches, snapshots and rewinds a connection has under way at once. The server refuses a fifth, and a refusal
# costs a second. It counts one as under way until just after its reply, hence one less.
look_backs_max = 3
# Half of the 32 that one client may have waiting to be built (WIRE.md, "Limits").
worlds_made_max = 16

T = TypeVar("T")


WhyItBroke = Callable[[], Awaitable[str]]


async def nothing_known() -> str:
    return ""


@dataclass(frozen=True)
class Address:
    """Where a server is, and what to show it."""

    host: str
    port: int
    token: str = ""
    tls: ssl.SSLContext | None = None
    # How long connecting may take, and each reply that nothing is simulated or built for.
    timeout_s: float = 60.0


class Connection(asyncio.Protocol):
    """Made by `open`. Answers the server's pings by itself. What came is taken in the loop's turn that read it."""

    def __init__(self, address: Address, why_it_broke: WhyItBroke) -> None:
        self.address = address
        self._why_it_broke = why_it_broke
        self.welcome = session_pb2.Welcome(message_bytes_max=hello_bytes_max)
        self.feeds: dict[int, Feed] = {}
        # Those whose touches a stream of this connection tells.
        self.touched_worlds: set[str] = set()
        #: Is shown every message that comes, and its bytes, before it is taken.
        self.tap: Callable[[bytes, session_pb2.ServerMessage], None] | None = None
        self._topologies: dict[bytes, frame_pb2.Topology] = {}
        self._transport: asyncio.Transport
        self._messages = Messages()
        self._waiting: dict[int, asyncio.Future[session_pb2.ServerMessage]] = {}
        self._last_id = 0
        look_backs, worlds_made = asyncio.Semaphore(look_backs_max), asyncio.Semaphore(worlds_made_max)
        self._turns: dict[str, asyncio.Semaphore] = {
            "branch_world": look_backs,
            "rewind_world": look_backs,
            "take_snapshot": look_backs,
            "create_world": worlds_made,
            "restore_world": worlds_made,
        }
        self._error: PneumaError | None = None
        self._loop = asyncio.get_running_loop()
        self._heard_s: float
        self._silence: asyncio.TimerHandle
        self._lost: asyncio.Future[None] = self._loop.create_future()
        self._telling_why: asyncio.Task[None] | None = None

    @classmethod
    async def open(cls, address: Address, why_it_broke: WhyItBroke = nothing_known) -> Connection:
        """Connects and says hello. Raises PneumaError.

        why_it_broke: asked when the connection breaks; its text is told with the error.
        """
        return await retried(lambda: cls._open_once(address, why_it_broke))

    @classmethod
    async def _open_once(cls, address: Address, why_it_broke: WhyItBroke) -> Connection:
        loop = asyncio.get_running_loop()
        try:
            opening = loop.create_connection(
                lambda: cls(address, why_it_broke), address.host, address.port, ssl=address.tls
            )
            _, connection = await asyncio.wait_for(opening, address.timeout_s)
        except (OSError, asyncio.TimeoutError) as error:
            why = str(error) or f"no answer in {address.timeout_s} s"
            raise PneumaError("UNAVAILABLE", f"cannot connect to {address.host}:{address.port}: {why}") from None
        hello = session_pb2.Hello(protocol_version=protocol_version, token=address.token, client_name="pneuma Python")
        try:
            connection.welcome = await connection._ask(
                session_pb2.ClientMessage(hello=hello), session_pb2.Welcome, address.timeout_s
            )
        except BaseException:
            await connection.close()
            raise
        return connection

    async def call(self, request: session_pb2.ClientMessage, expected: type[T]) -> T:
        """Sends a request and waits for its reply, which is an `expected`. Raises PneumaError.

        Requests of which a client may have few under way wait for their turn. Where the server says when to try again,
        the request is sent again then, for a minute in all. `request` is left as it is, but for its request_id.
        """
        kind = str(request.WhichOneof("request"))
        timeout_s = None if kind in lasting_requests else self.address.timeout_s
        # The ticks of a step that is UNAVAILABLE may be done already.
        codes = ("LIMIT_EXCEEDED",) if kind in ("step", "step_until") else ("LIMIT_EXCEEDED", "UNAVAILABLE")
        async with self._turns.get(kind, contextlib.nullcontext()):
            return await retried(lambda: self._ask(request, expected, timeout_s), codes, lambda: self._error is None)

    def tell(self, request: session_pb2.ClientMessage) -> None:
        """Sends a request whose reply nobody waits for, if the connection still takes it."""
        if self._error is None:
            self._send(request)

    async def close(self) -> None:
        """Ends the connection. What waits is UNAVAILABLE."""
        self._end(PneumaError("UNAVAILABLE", "the connection was closed"))
        if self._telling_why:
            self._telling_why.cancel()
            await asyncio.wait([self._telling_why])
        try:
            await asyncio.wait_for(asyncio.shield(self._lost), 1.0)
        except asyncio.TimeoutError:
            self._transport.abort()  # it is over either way

    @property
    def error(self) -> PneumaError | None:
        """Why the connection ended; None while it lasts."""
        return self._error

    async def _ask(self, request: session_pb2.ClientMessage, expected: type[T], timeout_s: float | None) -> T:
        if self._error:
            raise self._error
        reply: asyncio.Future[session_pb2.ServerMessage] = self._loop.create_future()
        request_id = self._send(request, reply)
        try:
            message = await asyncio.wait_for(reply, timeout_s)
        except asyncio.TimeoutError:
            raise PneumaError("UNAVAILABLE", f"no reply in {timeout_s} s", str(request.WhichOneof("request"))) from None
        finally:
            self._waiting.pop(request_id, None)
        return reply_in(message, expected)

    def _send(
        self, request: session_pb2.ClientMessage, reply: asyncio.Future[session_pb2.ServerMessage] | None = None
    ) -> int:
        """Writes it in one go, so that no other request comes between its parts. Returns its id."""
        self._last_id += 1
        request.request_id = self._last_id
        messages = cut(request, self.welcome.message_bytes_max, self.welcome.parts_bytes_max)
        if reply:
            self._waiting[self._last_id] = reply
        for message in messages:
            self._transport.write(enveloped(message))
        return self._last_id

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        # Where TLS fails, the loop makes a Connection and no connection: nobody would stop its timer.
        self._heard_s = self._loop.time()
        self._silence = self._loop.call_later(silence_s, self._look_for_silence)

    def data_received(self, data: bytes) -> None:
        self._heard_s = self._loop.time()
        try:
            for message_bytes in self._messages.add(data):
                if self._error:
                    return
                message = session_pb2.ServerMessage.FromString(message_bytes)
                if self.tap:
                    self.tap(message_bytes, message)
                self._take(message)
        except PneumaError as error:
            self._end(error)
        except Exception as error:  # of protobuf, or of what a message tells
            self._end(PneumaError("MALFORMED", f"a message that cannot be read: {error}"))

    def connection_lost(self, exc: Exception | None) -> None:
        self._silence.cancel()
        if self._error is None:
            self._telling_why = self._loop.create_task(self._tell_why())
        if not self._lost.done():
            self._lost.set_result(None)

    async def _tell_why(self) -> None:
        why = ""
        try:
            why = await self._why_it_broke()
        except Exception as error:
            why = f"why is not known: {error!r}"
        finally:
            self._end(PneumaError("UNAVAILABLE", "the connection broke" + (f": {why}" if why else "")))

    def _look_for_silence(self) -> None:
        left_s = self._heard_s + silence_s - self._loop.time()
        if left_s > 0:
            self._silence = self._loop.call_later(left_s, self._look_for_silence)
        else:
            self._end(PneumaError("UNAVAILABLE", "the server has gone silent"))

    def _take(self, message: session_pb2.ServerMessage) -> None:
        kind = message.WhichOneof("message")
        if kind is None:
            return  # of a kind that a later server knows
        content = getattr(message, kind)
        if kind == "subscribed":
            # Before what follows the reply. Asking again for the same gives the same stream.
            if content.stream_id not in self.feeds:
                request = session_pb2.ClientMessage(request_key=session_pb2.RequestKey(stream_id=content.stream_id))
                self.feeds[content.stream_id] = Feed(content, self._topologies, lambda: self.tell(request))
            self.feeds[content.stream_id].expect()
        if message.request_id:
            waiting = self._waiting.pop(message.request_id, None)
            if waiting and not waiting.done():
                waiting.set_result(message)
        elif kind == "ping":
            self.tell(session_pb2.ClientMessage(pong=session_pb2.Pong(nonce=content.nonce)))
        elif kind == "goodbye":
            known = content.HasField("reason")
            self._end(error_of(content.reason) if known else PneumaError("UNAVAILABLE", "the server said goodbye"))
        elif kind == "topology":
            self._topologies[content.hash] = content
        elif kind == "event":
            for feed in self.feeds.values():
                feed.event(content)
        elif kind in ("layout", "frame", "gap", "touches") and content.stream_id in self.feeds:
            getattr(self.feeds[content.stream_id], kind)(content)

    def _end(self, error: PneumaError) -> None:
        if self._error:
            return
        self._error = error
        for reply in self._waiting.values():
            if not reply.done():
                reply.set_exception(error)
        self._waiting.clear()
        for feed in self.feeds.values():
            feed.end(error)
        self._silence.cancel()
        self._transport.close()


def reply_in(message: session_pb2.ServerMessage, expected: type[T]) -> T:
    """What a reply says. Raises PneumaError where that is an error, or no `expected`."""
    kind = str(message.WhichOneof("message"))
    content = getattr(message, kind)
    if kind == "error":
        raise error_of(content)
    if not isinstance(content, expected):
        raise PneumaError("MALFORMED", f"a reply of the kind {kind}", expected.__name__)
    return content


async def retried(
    ask: Callable[[], Awaitable[T]],
    codes: tuple[str, ...] = ("LIMIT_EXCEEDED", "UNAVAILABLE"),
    lasts: Callable[[], bool] = lambda: True,
) -> T:
    """What `ask` gives, asked again while it is refused with one of the codes and a time to wait, and it `lasts`."""
    waited_s = 0.0
    while True:
        try:
            return await ask()
        except PneumaError as error:
            waited_s += error.retry_after_s
            if error.code not in codes or error.retry_after_s <= 0.0 or waited_s > retry_s_max or not lasts():
                raise
            await asyncio.sleep(error.retry_after_s)
