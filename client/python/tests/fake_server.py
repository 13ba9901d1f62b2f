"""A server that says what a test tells it to: for refusals, pings, silence and broken messages."""

from __future__ import annotations

import socket
import threading
from collections import deque
from collections.abc import Callable
from typing import Self

from pneuma import wire
from pneuma.envelope import enveloped, length_bytes

Reply = wire.ServerMessage
Answer = Callable[[wire.ClientMessage], "list[Reply] | bytes"]


class FakeServer:
    """Welcomes who comes, then answers each message by the next of `answers`, or with Done where none is left."""

    def __init__(self) -> None:
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.address = "127.0.0.1:%d" % self.listener.getsockname()[1]
        self.welcome = wire.Welcome(protocol_version=1, message_bytes_max=1 << 20, parts_bytes_max=16 << 20)
        self.received: list[wire.ClientMessage] = []
        self.answers: deque[Answer] = deque()
        #: Kinds that get no answer but what a test pushes.
        self.unanswered: frozenset[str] = frozenset()
        self.arrived = threading.Condition()
        self.connections: list[socket.socket] = []
        self.thread = threading.Thread(target=self._accept, daemon=True)

    def push(self, *messages: Reply) -> None:
        """Says something unasked, to the last who came."""
        for message in messages:
            self.connections[-1].sendall(enveloped(message.SerializeToString()))

    def of_kinds(self, kinds: str | list[str]) -> list[wire.ClientMessage]:
        """The messages of a kind, or of any of some kinds, that have come."""
        wanted = [kinds] if isinstance(kinds, str) else kinds
        return [message for message in self.received if message.WhichOneof("request") in wanted]

    def wait_for(self, kinds: str | list[str], count: int = 1) -> list[wire.ClientMessage]:
        """The same, once there are so many. Fails after ten seconds."""
        with self.arrived:
            enough = self.arrived.wait_for(lambda: len(self.of_kinds(kinds)) >= count, 10.0)
            assert enough, f"{len(self.of_kinds(kinds))} {kinds} came"
            return self.of_kinds(kinds)

    def __enter__(self) -> Self:
        self.thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.listener.shutdown(socket.SHUT_RDWR)
        self.listener.close()
        for connection in self.connections:
            connection.close()
        self.thread.join()

    def _accept(self) -> None:
        while True:
            try:
                connection, _ = self.listener.accept()
            except OSError:
                return
            self.connections.append(connection)
            threading.Thread(target=self._serve, args=(connection,), daemon=True).start()

    def _serve(self, connection: socket.socket) -> None:
        stream = connection.makefile("rb")
        try:
            while head := stream.read(length_bytes):
                message = wire.ClientMessage.FromString(stream.read(int.from_bytes(head, "big")))
                answer = self._answer(message)
                with self.arrived:
                    self.received.append(message)
                    self.arrived.notify_all()
                if isinstance(answer, bytes):
                    connection.sendall(answer)
                    continue
                for reply in answer:
                    connection.sendall(enveloped(reply.SerializeToString()))
        except (OSError, ValueError):
            pass  # the client or the test has gone

    def _answer(self, message: wire.ClientMessage) -> list[Reply] | bytes:
        kind = message.WhichOneof("request")
        if kind == "pong" or (kind == "part" and not message.part.last):
            return []
        if kind in self.unanswered:
            return []
        if self.answers:
            return self.answers.popleft()(message)
        if kind == "hello":
            return [Reply(request_id=message.request_id, welcome=self.welcome)]
        return done(message)


def done(message: wire.ClientMessage) -> list[Reply]:
    return [Reply(request_id=message.request_id, done=wire.Done(tick=7))]


def refuse(code: wire.Error.Code, retry_after_s: float = 0.0) -> Answer:
    error = wire.Error(code=code, what="for a reason", where="a.place", retry_after_s=retry_after_s)
    return lambda message: [Reply(request_id=message.request_id, error=error)]


def welcomed(fake: FakeServer) -> Answer:
    return lambda message: [Reply(request_id=message.request_id, welcome=fake.welcome)]
