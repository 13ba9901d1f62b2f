"""The client for asyncio: as the package's own, with `await`."""

from pneuma.aio.body import Body, Grab
from pneuma.aio import opening
from pneuma.aio.server import Server
from pneuma.aio.stream import Stream, Subscription, TouchStream
from pneuma.aio.world import World

serve = opening.heads_a_block(opening.serve)
connect = opening.heads_a_block(opening.connect)

__all__ = ["Body", "Grab", "Server", "Stream", "Subscription", "TouchStream", "World", "connect", "serve"]
