"""A server: one of one's own, or one that runs elsewhere."""

from __future__ import annotations

import asyncio
import os
import ssl
from collections.abc import Awaitable, Callable, Generator, Mapping, Sequence
from os import PathLike
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TypeVar

from pneuma._proto import session_pb2 as wire
from pneuma.aio.connection import Address, Connection
from pneuma.aio.program import Program, find_program
from pneuma.aio.world import World
from pneuma.errors import PneumaError
from pneuma.scene import Scene, message_of

port_by_default = 7420

Reply = TypeVar("Reply")


class Server:
    """A connection to a server, made by `serve` or `connect`."""

    def __init__(
        self, connection: Connection, page: str, program: Program | None = None, *, owns_worlds: bool = False
    ) -> None:
        self.connection = connection
        self.page = page
        self.program = program
        self._owns_worlds = owns_worlds

    async def world(
        self,
        source: str | PathLike[str] | Scene | Mapping[str, object],
        *,
        name: str = "",
        paused: bool = False,
        owned: bool | None = None,
    ) -> World:
        """Makes a world of a built-in scene, a scene, a dict like its JSON form, or a file (a path that ends in .json).

        name: the scene's unless given, with -2, -3... where that is taken.
        owned: the world ends with this connection. That is the default on a server of one's own that keeps no worlds.
        """
        request = wire.CreateWorld(name=name, paused=paused, owned=self._owns_worlds if owned is None else owned)
        if isinstance(source, (Scene, Mapping)):
            request.scene.CopyFrom(message_of(source))
        elif Path(source).suffix == ".json":
            request.scene_json = await asyncio.to_thread(Path(source).read_text, "utf-8")
        else:
            request.builtin = os.fspath(source)
        done = await self.call(wire.ClientMessage(create_world=request), wire.Done)
        return World(self.connection, done.world, self.page)

    async def restore(self, path: str | PathLike[str], *, name: str = "", paused: bool = False) -> World:
        """Makes a world of a file that `World.save` wrote, with the same bits."""
        request = wire.RestoreWorld(name=name, paused=paused, snapshot=await asyncio.to_thread(Path(path).read_bytes))
        done = await self.call(wire.ClientMessage(restore_world=request), wire.Done)
        return World(self.connection, done.world, self.page)

    def __getitem__(self, name: str) -> World:
        """A world that is there; where it is not, the first request says NOT_FOUND."""
        return World(self.connection, name, self.page)

    async def worlds(self) -> list[wire.WorldList.World]:
        """What there is, as the wire tells it: name, tick, time_s, paused, vertices and more of each."""
        reply = await self.call(wire.ClientMessage(list_worlds=wire.ListWorlds()), wire.WorldList)
        return list(reply.worlds)

    async def call(self, request: wire.ClientMessage, expected: type[Reply]) -> Reply:
        """Any request of the protocol (`pneuma.wire`), whose reply is an `expected`. Raises PneumaError."""
        return await self.connection.call(request, expected)

    @property
    def address(self) -> str:
        """HOST:PORT, as `connect` and `pneuma --server` take it."""
        return f"{self.connection.address.host}:{self.connection.address.port}"

    @property
    def process_id(self) -> int | None:
        """Of a server of one's own."""
        return self.program.process.pid if self.program else None

    async def close(self) -> None:
        """Ends the connection, and the server if it is one's own."""
        await self.connection.close()
        if self.program:
            await self.program.end()

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()

    def __repr__(self) -> str:
        return f"<Server {self.address}>"


class Opening:
    """What `serve` and `connect` give: `await` it, or head an `async with` block with it, which closes the server."""

    def __init__(self, opened: Callable[[], Awaitable[Server]]) -> None:
        self._opened = opened
        self._server: Server | None = None

    def __await__(self) -> Generator[Any, None, Server]:
        return self._opened().__await__()

    async def __aenter__(self) -> Server:
        self._server = await self
        return self._server

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._server
        await self._server.close()


async def start(
    *scenes: str | PathLike[str],
    data_dir: str | PathLike[str] | None = None,
    flags: Sequence[str] = (),
    program: str | PathLike[str] | None = None,
) -> Server:
    """What `serve` waits for."""
    words = [word for scene in scenes for word in ("--scene", os.fspath(scene))]
    if data_dir is not None:
        words += ["--data-dir", os.fspath(data_dir)]
    started = await Program.start(os.fspath(program or find_program()), [*words, *flags])
    try:
        connection = await Connection.open(Address(started.host, started.port))
    except BaseException:
        await started.end()
        raise
    return Server(connection, started.page or f"http://{started.http}", started, owns_worlds=data_dir is None)


async def reach(
    address: str | None = None,
    *,
    token: str | None = None,
    tls: bool | ssl.SSLContext = False,
    ca: str | PathLike[str] | None = None,
    http: str | None = None,
    timeout_s: float = 60.0,
) -> Server:
    """What `connect` waits for."""
    host, port = split(address or os.environ.get("PNEUMA_SERVER") or "127.0.0.1")
    token = os.environ.get("PNEUMA_TOKEN", "") if token is None else token
    context = tls if isinstance(tls, ssl.SSLContext) else None
    if context is None and (tls or ca is not None):
        try:
            context = ssl.create_default_context(cafile=ca)
        except OSError as error:
            raise PneumaError("INVALID_ARGUMENT", f"cannot read certificates of {ca}: {error}", "connect.ca") from None
    connection = await Connection.open(Address(host, port, token, context, timeout_s))
    return Server(connection, http or f"{'https' if context else 'http'}://{host}:{port + 1}")


def split(address: str) -> tuple[str, int]:
    """HOST:PORT, HOST, or an IPv6 address in brackets with a port or without."""
    host, colon, port = address.rpartition(":")
    if not colon or address.endswith("]"):
        host, port = address, str(port_by_default)
    if not port.isdecimal() or not 0 < int(port) < 65536:
        raise PneumaError("INVALID_ARGUMENT", f"{address} is no HOST:PORT", "connect.address")
    return host.strip("[]"), int(port)


def serve(
    *scenes: str | PathLike[str],
    data_dir: str | PathLike[str] | None = None,
    flags: Sequence[str] = (),
    program: str | PathLike[str] | None = None,
) -> Opening:
    """Starts a pneuma-server of one's own on free ports of this machine, and ends it with the block or by `close`.

    scenes: worlds to begin with, built-in scenes or files.
    data_dir: where to keep worlds.
    flags: others of pneuma-server.
    program: its path. Otherwise PNEUMA_SERVER_PROGRAM, then PATH, then the build of the checkout that this is in.

    The server ends with this program, however that ends. Raises PneumaError where it does not start.
    """
    return Opening(lambda: start(*scenes, data_dir=data_dir, flags=flags, program=program))


def connect(
    address: str | None = None,
    *,
    token: str | None = None,
    tls: bool | ssl.SSLContext = False,
    ca: str | PathLike[str] | None = None,
    http: str | None = None,
    timeout_s: float = 60.0,
) -> Opening:
    """Connects to a server that runs.

    address: HOST:PORT. Otherwise PNEUMA_SERVER, otherwise 127.0.0.1:7420.
    token: what the server asks for. Otherwise PNEUMA_TOKEN.
    tls: speak TLS, by the machine's certificates or by a context.
    ca: speak TLS, and trust the certificates of this PEM file.
    http: the page's address, such as "http://127.0.0.1:7421". Otherwise the port after the server's.
    timeout_s: of connecting, and of each reply that nothing is simulated or built for.

    Raises PneumaError.
    """
    return Opening(lambda: reach(address, token=token, tls=tls, ca=ca, http=http, timeout_s=timeout_s))
