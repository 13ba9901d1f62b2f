"""The client for asyncio: as the package's own, with `await`."""

from pneuma.aio.body import Body, Grab
from pneuma.aio.server import Server, connect, serve
from pneuma.aio.stream import Stream
from pneuma.aio.world import World

__all__ = ["Body", "Grab", "Server", "Stream", "World", "connect", "serve"]
