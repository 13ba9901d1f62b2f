"""A call that another thread's loop does: whatever becomes of it there, who waits goes on."""

from __future__ import annotations

import asyncio

import pytest

from pneuma.blocking import Call


async def answer(number: int) -> int:
    await asyncio.sleep(0)
    return number


async def refuse() -> int:
    raise ValueError("no")


def test_what_the_loop_finds_is_the_threads() -> None:
    async def main() -> int:
        call = Call(answer(7))
        call.begin()
        return await asyncio.to_thread(call.wait)

    assert asyncio.run(main()) == 7


def test_an_error_is_the_threads() -> None:
    async def main() -> int:
        call = Call(refuse())
        call.begin()
        return await asyncio.to_thread(call.wait)

    with pytest.raises(ValueError, match="no"):
        asyncio.run(main())


@pytest.mark.parametrize("turns", [0, 1])
def test_a_cancelled_call_ends_whether_it_had_begun_or_not(turns: int) -> None:
    async def main() -> None:
        call = Call(asyncio.sleep(60.0))
        call.begin()
        for _ in range(turns):
            await asyncio.sleep(0)
        call.cancel()
        await asyncio.to_thread(call.wait)

    with pytest.raises(asyncio.CancelledError):
        asyncio.run(main())
