"""The client for asyncio, and that the one whose calls wait has all of its methods."""

from __future__ import annotations

import asyncio
import inspect

import pytest

import pneuma
from pneuma import aio
from pneuma.aio import connection as connection_module
from pneuma.testing import near


def test_the_kick_test_with_await() -> None:
    async def kick() -> None:
        async with aio.serve() as server:
            world = await server.world("bouncing-ball", paused=True)
            await world.set_gravity((0, 0, 0))
            before = await world.state()
            await world["ball"].kick((3, 0, 0))
            state = await world.step(60)
            moved = state["ball"].centre_of_mass - before["ball"].centre_of_mass
            assert moved == near((3 + 0.5, 0, 0), within_m=0.05)  # it began at 0.5 m/s

    asyncio.run(kick())


def test_worlds_are_stepped_side_by_side() -> None:
    async def both() -> list[int]:
        server = await aio.serve()
        try:
            worlds = await asyncio.gather(*(server.world("bouncing-ball", paused=True) for _ in range(4)))
            states = await asyncio.gather(*(world.step(10 + i) for i, world in enumerate(worlds)))
            return [state.tick for state in states]
        finally:
            await server.close()

    assert asyncio.run(both()) == [10, 11, 12, 13]


def test_many_branches_at_once_are_not_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """No request may be asked again, so that a refusal would be an error."""
    monkeypatch.setattr(connection_module, "retry_s_max", 0.0)

    async def branches() -> int:
        async with aio.serve() as server:
            world = await server.world("bouncing-ball", paused=True)
            await asyncio.gather(
                *(world.branch(paused=True) for _ in range(24)), *(world.snapshot() for _ in range(24))
            )
            return len(await server.worlds())

    assert asyncio.run(branches()) == 25


def test_frames_with_async_for() -> None:
    async def watch() -> list[int]:
        async with aio.serve("bouncing-ball") as server:
            ticks = []
            async with server["bouncing-ball"].stream(rate_hz=30) as frames:
                async for frame in frames:
                    ticks.append(frame.tick)
                    if len(ticks) == 4:
                        return ticks
        return []

    ticks = asyncio.run(watch())
    assert ticks == sorted(ticks) and len(ticks) == 4


def test_connect_reaches_a_server_that_runs(shared: pneuma.Server) -> None:
    async def names() -> list[str]:
        async with aio.connect(shared.address) as server, await server.world("bouncing-ball", name="a") as world:
            grab = await world["ball"].grab((0, 3, 0), vertex=0)
            async with grab:
                await grab.move((0, 4, 0))
            return [world.name for world in await server.worlds()]

    assert asyncio.run(names()) == ["a"]
    assert shared.worlds() == []


@pytest.mark.parametrize("name", ["Body", "Grab", "Server", "Stream", "World"])
def test_every_method_has_one_that_waits(name: str) -> None:
    inner, outer = getattr(aio, name), getattr(pneuma, name)
    instead = {"get_gravity": "gravity", "set_gravity": "gravity", "connection": "", "program": ""}
    public = [each for each in vars(inner) if not each.startswith("_") and instead.get(each, each)]
    assert public
    for each in public:
        method = getattr(outer, instead.get(each, each), None)
        assert method is not None, each
        if inspect.iscoroutinefunction(getattr(inner, each)) and each not in instead:
            assert not inspect.iscoroutinefunction(method), each
            assert method.__doc__, each
