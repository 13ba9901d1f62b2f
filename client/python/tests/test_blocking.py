"""A call that another thread's loop does: whatever becomes of it there, who waits goes on.

Each wait has a bound: a call that never ends fails its test, and does not hang it.
"""

from __future__ import annotations

import asyncio
import contextlib
import gc
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from typing import Any, TypeVar

import pytest

from pneuma import PneumaError, connect, wire
from pneuma.blocking import Call, LoopThread

from fake_server import FakeServer, refuse

R = TypeVar("R")
patience_s = 10.0


async def answer(number: int) -> int:
    await asyncio.sleep(0)
    return number


async def refused() -> int:
    raise ValueError("no")


async def lasting(ended: threading.Event) -> None:
    try:
        await asyncio.sleep(60.0)
    finally:
        ended.set()


async def waited(call: Call[R]) -> R:
    """What another thread waits for, which outlives the test where that never comes."""
    came: Future[R] = Future()

    def wait() -> None:
        try:
            came.set_result(call.wait())
        except BaseException as error:
            came.set_exception(error)

    threading.Thread(target=wait, daemon=True).start()
    return await asyncio.wait_for(asyncio.wrap_future(came), patience_s)


def test_what_the_loop_finds_is_the_threads() -> None:
    async def main() -> int:
        call = Call(answer(7))
        call.begin()
        return await waited(call)

    assert asyncio.run(main()) == 7


def test_an_error_is_the_threads() -> None:
    async def main() -> int:
        call = Call(refused())
        call.begin()
        return await waited(call)

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
        await waited(call)

    with pytest.raises(asyncio.CancelledError):
        asyncio.run(main())


def test_an_interrupt_before_the_wait_cancels_the_call(monkeypatch: pytest.MonkeyPatch) -> None:
    thread, ended = LoopThread(), threading.Event()
    schedule = thread._loop.call_soon_threadsafe

    def interrupt_after(callback: Callable[..., object], *args: Any) -> None:
        schedule(callback, *args)
        if getattr(callback, "__name__", "") == "begin":
            raise KeyboardInterrupt

    monkeypatch.setattr(thread._loop, "call_soon_threadsafe", interrupt_after)
    with pytest.raises(KeyboardInterrupt):
        thread.run(lasting(ended))
    assert ended.wait(patience_s)
    thread.end()


def test_an_interrupt_stays_one_where_the_loop_is_closed(monkeypatch: pytest.MonkeyPatch) -> None:
    thread = LoopThread()

    def interrupt(call: Call[Any]) -> None:
        thread.end()
        raise KeyboardInterrupt

    monkeypatch.setattr(Call, "wait", interrupt)
    with pytest.raises(KeyboardInterrupt):
        thread.run(answer(7))


@pytest.mark.parametrize("window", ["shutdown_default_executor", "close"])
def test_a_call_that_comes_while_the_loop_ends_is_over(monkeypatch: pytest.MonkeyPatch, window: str) -> None:
    """Another thread asks while the loop lasts. What it asks for comes when the loop is about to do `window`."""
    thread = LoopThread()
    loop = thread._loop
    asked, about_to, has_come, told = threading.Event(), threading.Event(), threading.Event(), threading.Event()
    schedule, end = loop.call_soon_threadsafe, getattr(loop, window)

    def late(callback: Callable[..., object], *args: Any) -> None:
        is_late = getattr(callback, "__name__", "") == "begin"
        if is_late:
            asked.set()
            assert about_to.wait(patience_s)
        schedule(callback, *args)
        if is_late:
            has_come.set()

    def end_late() -> Any:
        about_to.set()
        assert has_come.wait(patience_s)
        return end()

    def ask() -> None:
        with pytest.raises(PneumaError, match="UNAVAILABLE: the server was closed"):
            thread.run(asyncio.sleep(60.0))
        told.set()

    monkeypatch.setattr(loop, "call_soon_threadsafe", late)
    monkeypatch.setattr(loop, window, end_late)
    threading.Thread(target=ask, daemon=True).start()
    assert asked.wait(patience_s)
    thread.end()
    assert told.wait(patience_s)


def client_threads() -> int:
    return sum(thread.name == "pneuma" for thread in threading.enumerate())


@pytest.fixture
def no_collection() -> Iterator[None]:
    """What is freed in the test is freed because nothing holds it."""
    gc.collect()
    gc.disable()
    yield
    gc.enable()


def test_a_refused_call_keeps_no_thread(fake: FakeServer, no_collection: None) -> None:
    before = client_threads()
    world = connect(fake.address)["w"]
    fake.answers.append(refuse(wire.Error.NOT_FOUND))
    with contextlib.suppress(PneumaError):
        world.pause()
    with contextlib.suppress(ValueError):
        world._thread.run(refused())
    del world
    assert client_threads() == before


def test_a_broken_connection_keeps_no_thread(fake: FakeServer, no_collection: None) -> None:
    """The connection keeps the error that ended it, which is raised by each call."""
    before = client_threads()
    world = connect(fake.address)["w"]
    fake.answers.append(lambda message: b"\0\0\0\0")
    for _ in range(2):
        with contextlib.suppress(PneumaError):
            world.pause()
    del world
    assert client_threads() == before
