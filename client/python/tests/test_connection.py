"""One connection, against a fake server: what the real one says only when it is overloaded, late or broken."""

from __future__ import annotations

import asyncio
import socket
import ssl
import threading
import time
from collections.abc import Callable, Coroutine
from typing import Any

import pytest

from pneuma import PneumaError, Server, connect, wire
from pneuma.aio import connection as connection_module
from pneuma.aio.connection import Address, Connection, WhyItBroke
from pneuma.envelope import enveloped

from fake_server import Answer, FakeServer, Reply, refuse, welcomed

Error = wire.Error


def test_hello_is_the_first_message_and_tells_the_token(fake: FakeServer) -> None:
    with connect(fake.address, token="a token"):
        hello = fake.received[0].hello
        assert (hello.protocol_version, hello.token) == (1, "a token")


def test_what_is_refused_is_an_exception(fake: FakeServer) -> None:
    with connect(fake.address) as server:
        fake.answers.append(refuse(Error.NOT_FOUND))
        with pytest.raises(PneumaError) as refused:
            server["w"].pause()
    error = refused.value
    assert (error.code, error.what, error.where) == ("NOT_FOUND", "for a reason", "a.place")
    assert str(error) == "NOT_FOUND: for a reason (a.place)"


def test_a_code_of_a_later_server_is_internal(fake: FakeServer) -> None:
    with connect(fake.address) as server:
        fake.answers.append(refuse(99))  # type: ignore[arg-type]
        with pytest.raises(PneumaError, match="INTERNAL"):
            server["w"].pause()


@pytest.mark.parametrize("code", [Error.LIMIT_EXCEEDED, Error.UNAVAILABLE])
def test_a_request_is_sent_again_when_the_server_says_when(fake: FakeServer, code: Error.Code) -> None:
    with connect(fake.address) as server:
        fake.answers += [refuse(code, 0.05), refuse(code, 0.05)]
        begin = time.monotonic()
        assert server["w"].pause() == 7
        assert time.monotonic() - begin >= 0.1
        asked = fake.wait_for("pause", 3)
        assert len({message.request_id for message in asked}) == 3


@pytest.mark.parametrize(
    "code, retry_after_s",
    [(Error.LIMIT_EXCEEDED, 0.0), (Error.UNAVAILABLE, 0.0), (Error.FAILED_PRECONDITION, 0.01)],
)
def test_a_request_is_not_sent_again_otherwise(fake: FakeServer, code: Error.Code, retry_after_s: float) -> None:
    with connect(fake.address) as server:
        fake.answers.append(refuse(code, retry_after_s))
        with pytest.raises(PneumaError):
            server["w"].pause()
        assert len(fake.wait_for("pause")) == 1


def test_waiting_has_an_end(fake: FakeServer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connection_module, "retry_s_max", 0.1)
    with connect(fake.address) as server:
        fake.answers += [refuse(Error.LIMIT_EXCEEDED, 0.04)] * 10
        with pytest.raises(PneumaError, match="LIMIT_EXCEEDED"):
            server["w"].pause()
        assert len(fake.wait_for("pause")) == 3


def test_a_step_that_may_be_done_is_not_sent_again(fake: FakeServer) -> None:
    with connect(fake.address) as server:
        fake.answers.append(refuse(Error.UNAVAILABLE, 0.01))
        with pytest.raises(PneumaError, match="UNAVAILABLE"):
            server["w"].step()
        assert len(fake.wait_for("step")) == 1
        fake.answers.append(refuse(Error.LIMIT_EXCEEDED, 0.01))
        with pytest.raises(PneumaError, match="UNSUPPORTED"):  # the fake one tells no state
            server["w"].step()
        assert len(fake.wait_for("step", 3)) == 3


def test_who_is_not_let_in_for_now_comes_again(fake: FakeServer) -> None:
    reason = Error(code=Error.UNAVAILABLE, what="too many", retry_after_s=0.05)
    fake.answers += [lambda message: [Reply(goodbye=wire.Goodbye(reason=reason))], welcomed(fake)]
    with connect(fake.address) as server:
        assert server["w"].pause() == 7
    assert len(fake.connections) == 2


def test_who_has_no_right_is_told(fake: FakeServer) -> None:
    reason = Error(code=Error.UNAUTHENTICATED, what="a wrong token", where="hello.token")
    fake.answers.append(lambda message: [Reply(goodbye=wire.Goodbye(reason=reason))])
    with pytest.raises(PneumaError, match="UNAUTHENTICATED: a wrong token"):
        connect(fake.address, token="x")


def test_pings_are_answered_while_the_script_does_something_else(fake: FakeServer) -> None:
    with connect(fake.address):
        fake.push(Reply(ping=wire.Ping(nonce=11)), Reply(ping=wire.Ping(nonce=12)))
        assert [message.pong.nonce for message in fake.wait_for("pong", 2)] == [11, 12]


def test_a_large_request_goes_in_parts(fake: FakeServer) -> None:
    fake.welcome.message_bytes_max = 1000
    with connect(fake.address) as server:
        server["w"].edit({"remove_mesh": "x" * 5000})
        parts = fake.wait_for("part", 6)
    whole = wire.ClientMessage.FromString(b"".join(message.part.data for message in parts))
    assert whole.edit.edit.changes[0].remove_mesh == "x" * 5000
    assert {message.request_id for message in parts} == {whole.request_id}


def test_kinds_of_a_later_server_are_no_matter(fake: FakeServer) -> None:
    with connect(fake.address) as server:
        unknown = b"\xf2\x3f\x03abc"  # field 1022, of a length
        fake.connections[-1].sendall(enveloped(unknown))
        assert server["w"].pause() == 7


def test_replies_may_overtake_each_other(fake: FakeServer) -> None:
    """Two threads ask; the first one's reply comes with the second's."""
    late: list[wire.ClientMessage] = []

    def keep(message: wire.ClientMessage) -> list[Reply]:
        late.append(message)
        return []

    def both(message: wire.ClientMessage) -> list[Reply]:
        return [
            Reply(request_id=message.request_id, done=wire.Done(tick=2)),
            Reply(request_id=late[0].request_id, done=wire.Done(tick=1)),
        ]

    with connect(fake.address) as server:
        fake.answers += [keep, both]
        first: list[int] = []
        thread = threading.Thread(target=lambda: first.append(server["a"].pause()))
        thread.start()
        fake.wait_for("pause")
        assert server["b"].pause() == 2
        thread.join()
        assert first == [1]


@pytest.mark.parametrize(
    "answer, code, what",
    [
        (b"", "UNAVAILABLE", "no reply in 1.0 s"),
        (b"\0\0\0\0", "MALFORMED", "a message of 0 bytes"),
        (b"\xff\xff\xff\xff", "MALFORMED", "a message of 4294967295 bytes"),
        (enveloped(b"\xff\xff"), "MALFORMED", "cannot be read"),
        (enveloped(Reply(request_id=2, pong=wire.Pong()).SerializeToString()), "MALFORMED", "a reply of the kind pong"),
        (enveloped(Reply(goodbye=wire.Goodbye()).SerializeToString()), "UNAVAILABLE", "the server said goodbye"),
    ],
)
def test_what_is_no_answer_is_told(fake: FakeServer, answer: bytes, code: str, what: str) -> None:
    with connect(fake.address, timeout_s=1.0) as server:
        fake.answers.append(lambda message: answer)
        with pytest.raises(PneumaError) as refused:
            server["w"].pause()
    assert refused.value.code == code and what in refused.value.what


def test_a_broken_connection_ends_what_waits_and_what_comes_after(fake: FakeServer) -> None:
    with connect(fake.address) as server:
        fake.answers.append(lambda message: b"\0")

        def hang_up() -> None:
            fake.wait_for("pause")
            fake.connections[-1].shutdown(socket.SHUT_RDWR)

        thread = threading.Thread(target=hang_up)
        thread.start()
        for _ in range(2):
            with pytest.raises(PneumaError, match="UNAVAILABLE: the connection broke"):
                server["w"].pause()
        thread.join()
        assert server.error and server.error.code == "UNAVAILABLE"


def hangs_up(fake: FakeServer) -> Answer:
    def answer(message: wire.ClientMessage) -> bytes:
        fake.connections[-1].shutdown(socket.SHUT_RDWR)
        return b""

    return answer


def opened(fake: FakeServer, why_it_broke: WhyItBroke) -> Coroutine[Any, Any, Connection]:
    host, _, port = fake.address.rpartition(":")
    return Connection.open(Address(host, int(port)), why_it_broke)


pause = wire.ClientMessage(pause=wire.Pause(world="w"))


def test_a_connection_ends_where_asking_why_it_broke_fails(fake: FakeServer) -> None:
    async def main() -> None:
        async def why() -> str:
            raise OSError("no log")

        connection = await opened(fake, why)
        fake.answers.append(hangs_up(fake))
        with pytest.raises(PneumaError, match="the connection broke: why is not known: OSError.'no log'."):
            await asyncio.wait_for(connection.call(pause, wire.Done), 5.0)
        await connection.close()

    asyncio.run(main())


def test_closing_ends_the_question_why_the_connection_broke(fake: FakeServer) -> None:
    asked: list[str] = []

    async def main() -> None:
        async def why() -> str:
            asked.append("begun")
            try:
                await asyncio.sleep(60.0)
            finally:
                asked.append("ended")
            return ""

        connection = await opened(fake, why)
        fake.answers.append(hangs_up(fake))
        waiting = asyncio.ensure_future(connection.call(pause, wire.Done))
        while not asked:
            await asyncio.sleep(0.01)
        await connection.close()
        assert asked == ["begun", "ended"]
        with pytest.raises(PneumaError, match="the connection was closed"):
            await waiting

    asyncio.run(main())


def test_a_server_that_has_gone_silent_is_told(fake: FakeServer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connection_module, "silence_s", 0.5)
    with connect(fake.address) as server:
        fake.answers.append(lambda message: b"")
        with pytest.raises(PneumaError, match="the server has gone silent"):
            server["w"].pause()


def test_a_handshake_that_fails_leaves_no_timer(monkeypatch: pytest.MonkeyPatch) -> None:
    """The server speaks no TLS. The loop has nothing to complain of, once a connection would have been silent."""
    monkeypatch.setattr(connection_module, "silence_s", 0.1)
    complaints: list[object] = []

    async def main() -> None:
        asyncio.get_running_loop().set_exception_handler(lambda _, context: complaints.append(context))
        async with await asyncio.start_server(lambda _, writer: writer.close(), "127.0.0.1", 0) as server:
            address = Address("127.0.0.1", server.sockets[0].getsockname()[1], tls=ssl.create_default_context())
            with pytest.raises(PneumaError, match="UNAVAILABLE: cannot connect"):
                await Connection.open(address)
            await asyncio.sleep(0.3)

    asyncio.run(main())
    assert not complaints


def test_a_closed_server_is_told(fake: FakeServer) -> None:
    server: Server = connect(fake.address)
    server.close()
    server.close()
    with pytest.raises(PneumaError, match="the server was closed"):
        server["w"].pause()


@pytest.mark.parametrize(
    "answer", [refuse(Error.UNAVAILABLE, 30.0), lambda message: b""], ids=["told to wait", "waiting"]
)
def test_closing_ends_what_other_threads_wait_for(fake: FakeServer, answer: Answer) -> None:
    server: Server = connect(fake.address)
    fake.answers.append(answer)
    told: list[str] = []

    def ask() -> None:
        with pytest.raises(PneumaError) as refused:
            server["w"].pause()
        told.append(refused.value.code)

    thread = threading.Thread(target=ask)
    thread.start()
    fake.wait_for("pause")
    time.sleep(0.1)
    server.close()
    thread.join(10.0)
    assert told == ["UNAVAILABLE"]


def test_nobody_there_is_told() -> None:
    with pytest.raises(PneumaError, match="UNAVAILABLE: cannot connect to 127.0.0.1:1: "):
        connect("127.0.0.1:1")


@pytest.mark.parametrize("address", ["host:port", "host:0", "host:70000", "host:"])
def test_what_is_no_address_is_told(address: str) -> None:
    with pytest.raises(PneumaError, match="is no HOST:PORT"):
        connect(address)


def test_what_is_no_certificate_is_told() -> None:
    with pytest.raises(PneumaError, match="cannot read certificates of /no/such"):
        connect("127.0.0.1:1", ca="/no/such")


def test_the_variables_of_the_command_are_taken(fake: FakeServer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PNEUMA_SERVER", fake.address)
    monkeypatch.setenv("PNEUMA_TOKEN", "secret")
    with connect() as server:
        assert server.address == fake.address
        assert fake.received[0].hello.token == "secret"


def client_threads() -> int:
    return sum(thread.name == "pneuma" for thread in threading.enumerate())


def test_no_thread_is_left(fake: FakeServer) -> None:
    before = client_threads()
    with connect(fake.address) as server:
        server["w"].pause()
        assert client_threads() == before + 1
    assert client_threads() == before


def test_a_client_that_nobody_holds_ends() -> None:
    before = client_threads()
    with FakeServer() as fake:
        world = connect(fake.address)["w"]  # holds its client
        assert world.pause() == 7
        del world
        assert client_threads() == before


@pytest.mark.parametrize(
    "kinds, most",
    [
        (["branch_world", "rewind_world", "take_snapshot"], connection_module.look_backs_max),
        (["create_world", "restore_world"], connection_module.worlds_made_max),
    ],
)
def test_few_of_what_the_server_limits_are_under_way(fake: FakeServer, kinds: list[str], most: int) -> None:
    """Threads ask for three times as many. Each that is answered makes room for one more, whatever its kind."""
    count = 3 * most
    with connect(fake.address) as server:
        ask: dict[str, Callable[[], object]] = {
            "branch_world": lambda: server["w"].branch(),
            "rewind_world": lambda: server["w"].rewind(3),
            "take_snapshot": lambda: server["w"].snapshot(),
            "create_world": lambda: server.world("bouncing-ball"),
            "restore_world": lambda: server.restore(b"a world"),
        }
        fake.unanswered = frozenset(kinds)
        threads = [threading.Thread(target=ask[kinds[i % len(kinds)]]) for i in range(count)]
        for thread in threads:
            thread.start()
        answered = 0
        while answered < count:
            under_way = min(answered + most, count)
            came = fake.wait_for(kinds, under_way)
            if answered < 2:
                time.sleep(0.1)
                assert len(fake.of_kinds(kinds)) == under_way
                assert server["w"].pause() == 7  # other requests do not wait behind them
            request = came[answered]
            is_snapshot = request.WhichOneof("request") == "take_snapshot"
            content = {"snapshot": wire.Snapshot()} if is_snapshot else {"done": wire.Done(tick=1, world="w")}
            fake.push(Reply(request_id=request.request_id, **content))
            answered += 1
        for thread in threads:
            thread.join(10.0)
            assert not thread.is_alive()


def test_closing_ends_what_waits_for_its_turn(fake: FakeServer) -> None:
    server: Server = connect(fake.address)
    fake.unanswered = frozenset(["branch_world"])
    told: list[str] = []

    def branch() -> None:
        with pytest.raises(PneumaError) as refused:
            server["w"].branch()
        told.append(refused.value.code)

    threads = [threading.Thread(target=branch) for _ in range(9)]
    for thread in threads:
        thread.start()
    fake.wait_for("branch_world", connection_module.look_backs_max)
    server.close()
    for thread in threads:
        thread.join(10.0)
    assert told == ["UNAVAILABLE"] * 9


def test_an_http_port_is_told(shared: Server) -> None:
    with pytest.raises(PneumaError, match="this is the server's HTTP port; clients speak to its TCP port"):
        connect(shared.page.partition("://")[2].partition("/")[0])
