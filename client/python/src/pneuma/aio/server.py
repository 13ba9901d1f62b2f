"""A server: one of one's own, or one that runs elsewhere."""

from __future__ import annotations

import asyncio
from os import PathLike
from pathlib import Path
from typing import Self, TypeVar

from pneuma._proto import session_pb2 as wire
from pneuma.aio.connection import Connection
from pneuma.aio.program import Program
from pneuma.aio.world import World, named
from pneuma.scene import Source, fill_source

Reply = TypeVar("Reply")


class Server:
    """A connection to a server, made by `serve` or `connect`."""

    __slots__ = ("connection", "page", "program", "_owns_worlds", "__weakref__")

    def __init__(
        self, connection: Connection, page: str, program: Program | None = None, *, owns_worlds: bool = False
    ) -> None:
        self.connection = connection
        self.page = page
        self.program = program
        self._owns_worlds = owns_worlds

    async def world(
        self,
        source: Source,
        *,
        name: str = "",
        paused: bool = False,
        owned: bool | None = None,
    ) -> World:
        """Makes a world of a built-in scene, a scene, a dict like its JSON form, JSON, or a file (a path with .json).

        name: the scene's unless given, with -2, -3... where that is taken.
        owned: the world ends with this connection. That is the default on a server of one's own that keeps no worlds.
        """
        request = wire.CreateWorld(name=name, paused=paused, owned=self._owns_worlds if owned is None else owned)
        await asyncio.to_thread(fill_source, request, source)
        done = await self.call(wire.ClientMessage(create_world=request), wire.Done)
        return World(self.connection, done.world, self.page)

    async def restore(
        self, source: str | PathLike[str] | bytes, *, name: str = "", paused: bool = False, owned: bool | None = None
    ) -> World:
        """Makes a world, with the same bits, of a file that `World.save` wrote or of the bytes of `World.snapshot`.

        `owned` as of `world`.
        """
        request = wire.RestoreWorld(name=name, paused=paused, owned=self._owns_worlds if owned is None else owned)
        request.snapshot = source if isinstance(source, bytes) else await asyncio.to_thread(Path(source).read_bytes)
        done = await self.call(wire.ClientMessage(restore_world=request), wire.Done)
        return World(self.connection, done.world, self.page)

    def __getitem__(self, name: str) -> World:
        """A world that is there; where it is not, the first request says NOT_FOUND."""
        named(name, "a world")
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
        """The server's process, where it is one's own."""
        return self.program.process.pid if self.program else None

    async def close(self) -> None:
        """Ends the connection, and the server if it is one's own."""
        await self.connection.close()
        if self.program:
            await self.program.end()

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    def __repr__(self) -> str:
        return f"<Server {self.address}>"
