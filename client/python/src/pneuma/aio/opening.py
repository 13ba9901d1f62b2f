"""How a server is come by: started, or connected to."""

from __future__ import annotations

import functools
import os
import ssl
from collections.abc import Callable, Coroutine, Generator, Sequence
from os import PathLike
from typing import Any, ParamSpec

from pneuma.aio.connection import Address, Connection
from pneuma.aio.program import Program, find_program
from pneuma.aio.server import Server
from pneuma.errors import PneumaError

port_by_default = 7420

P = ParamSpec("P")


async def serve(
    *scenes: str | PathLike[str],
    data_dir: str | PathLike[str] | None = None,
    flags: Sequence[str] = (),
    program: str | PathLike[str] | None = None,
) -> Server:
    """Starts a pneuma-server of one's own on free ports of this machine, and ends it with the block or by `close`.

    scenes: worlds to begin with, built-in scenes or files.
    data_dir: where to keep worlds.
    flags: others of pneuma-server.
    program: its path. Otherwise PNEUMA_SERVER_PROGRAM, then PATH, then the build of the checkout that this is in.

    The server ends with this program, however that ends. Raises PneumaError where it does not start.
    """
    words = [word for scene in scenes for word in ("--scene", os.fspath(scene))]
    if data_dir is not None:
        words += ["--data-dir", os.fspath(data_dir)]
    started = await Program.start(os.fspath(program or find_program()), [*words, *flags])
    try:
        connection = await Connection.open(Address(started.host, started.port), started.how_it_ended)
    except BaseException:
        await started.end()
        raise
    return Server(connection, started.page or f"http://{started.http}", started, owns_worlds=data_dir is None)


async def connect(
    address: str | None = None,
    *,
    token: str | None = None,
    tls: bool | ssl.SSLContext = False,
    ca: str | PathLike[str] | None = None,
    http: str | None = None,
    timeout_s: float = 60.0,
) -> Server:
    """Connects to a server that runs.

    address: HOST:PORT. Otherwise PNEUMA_SERVER, otherwise 127.0.0.1:7420.
    token: what the server asks for. Otherwise PNEUMA_TOKEN.
    tls: speak TLS, by the machine's certificates or by a context.
    ca: speak TLS, and trust the certificates of this PEM file.
    http: the page's address, such as "http://127.0.0.1:7421". Otherwise the port after the server's.
    timeout_s: of connecting, and of each reply that nothing is simulated or built for.

    Raises PneumaError.
    """
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


class Opening:
    """What `serve` and `connect` give: `await` it, or head an `async with` block with it, which closes the server."""

    def __init__(self, opened: Callable[[], Coroutine[Any, Any, Server]]) -> None:
        self._opened = opened
        self._server: Server | None = None

    def __await__(self) -> Generator[Any, None, Server]:
        return self._opened().__await__()

    async def __aenter__(self) -> Server:
        self._server = await self
        return self._server

    async def __aexit__(self, *_: object) -> None:
        assert self._server
        await self._server.close()


def heads_a_block(opened: Callable[P, Coroutine[Any, Any, Server]]) -> Callable[P, Opening]:
    """The function whose result may be awaited, and may head a block."""

    @functools.wraps(opened)
    def call(*args: P.args, **kwargs: P.kwargs) -> Opening:
        return Opening(lambda: opened(*args, **kwargs))

    return call
