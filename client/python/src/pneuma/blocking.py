"""How the calls of `pneuma.aio` become calls that wait: by an event loop in a thread of its own.

So pings are answered while the script does something else, and no request is written down twice.
"""

from __future__ import annotations

import asyncio
import contextlib
import copy
import functools
import threading
import weakref
from collections.abc import Callable, Coroutine
from typing import Any, Concatenate, Generic, ParamSpec, TypeVar

from pneuma.errors import PneumaError

Inner = TypeVar("Inner")
Made = TypeVar("Made")
Outer = TypeVar("Outer")
P = ParamSpec("P")
R = TypeVar("R")


class Call(Generic[R]):
    """What a thread waits for while the loop does it. A lock wakes the thread sooner than a future would."""

    def __init__(self, work: Coroutine[Any, Any, R]) -> None:
        self._work = work
        self._task: asyncio.Task[None] | None = None
        self._result: R
        self._error: BaseException | None = None
        self._ended = False
        self._over = threading.Lock()
        self._over.acquire()

    def wait(self) -> R:
        self._over.acquire()
        # The error's traceback holds this call. If the call held the error, both would stay until a collection.
        error, self._error = self._error, None
        if error is not None:
            try:
                raise error
            finally:
                del error
        return self._result

    # In the loop's thread.

    def begin(self) -> None:
        self._task = asyncio.create_task(self._run())

    def cancel(self) -> None:
        """To be called after `begin`, or where that will not come."""
        if self._task is not None:
            self._task.get_loop().call_soon(self._task.cancel)  # once it has begun, so that it ends
        else:
            self.abandon()

    def abandon(self) -> None:
        """Ends it, if nothing else has: for a loop that does nothing more."""
        if self._ended:
            return
        if self._task is None:
            self._work.close()
        self._error = asyncio.CancelledError()
        self._end()

    async def _run(self) -> None:
        try:
            self._result = await self._work
        except BaseException as error:  # whatever it is, it is the waiting thread's
            self._error = error
        self._end()

    def _end(self) -> None:
        self._ended = True
        self._over.release()  # comes last: the waiting thread goes on at once


class LoopThread:
    """A thread with an event loop. It ends by `end`, once nobody holds this any more, or with the program."""

    def __init__(self) -> None:
        self._loop = asyncio.new_event_loop()
        # What threads wait for. The loop's end leaves none of them waiting.
        self._calls: set[Call[Any]] = set()
        thread = threading.Thread(target=run_forever, args=(self._loop, self._calls), name="pneuma", daemon=True)
        self._closers: list[Callable[[], Coroutine[Any, Any, None]]] = []
        self.end = weakref.finalize(self, end_loop, self._loop, thread, self._closers)
        thread.start()

    def at_end(self, close: Callable[[], Coroutine[Any, Any, None]]) -> None:
        """What is done in the loop before it ends."""
        self._closers.append(close)

    def run(self, work: Coroutine[Any, Any, R]) -> R:
        """Waits for what the loop does. An interrupt cancels it."""
        __tracebackhide__ = True  # pytest shows the test's line
        if not self.end.alive:
            work.close()
            raise PneumaError("UNAVAILABLE", "the server was closed")
        call = Call(work)
        try:
            self._calls.add(call)
            self._begin(call, work)
            return call.wait()
        except PneumaError as error:
            # The place that matters is the script's. A connection keeps the error that ended it, and raises it again: a
            # traceback on that error would keep the script's frames, and by them this thread.
            raise copy.copy(error.with_traceback(None)) from None
        except asyncio.CancelledError:
            raise PneumaError("UNAVAILABLE", "the server was closed") from None
        except BaseException:
            with contextlib.suppress(RuntimeError):  # the loop is closed, and the call has ended
                self._loop.call_soon_threadsafe(call.cancel)
            raise
        finally:
            self._calls.discard(call)

    def _begin(self, call: Call[R], work: Coroutine[Any, Any, R]) -> None:
        try:
            self._loop.call_soon_threadsafe(call.begin)
        except RuntimeError:  # the loop was closed just now
            work.close()
            raise asyncio.CancelledError from None

    def call_soon(self, work: Callable[[], None]) -> None:
        """Does something in the loop, without waiting, if there is one still."""
        if self.end.alive:
            with contextlib.suppress(RuntimeError):  # the loop was closed just now
                self._loop.call_soon_threadsafe(work)


def run_forever(loop: asyncio.AbstractEventLoop, calls: set[Call[Any]]) -> None:
    asyncio.set_event_loop(loop)
    try:
        loop.run_forever()
        cancel_all(loop)
        loop.run_until_complete(loop.shutdown_default_executor())
        cancel_all(loop)  # what began meanwhile
    finally:
        loop.close()
        # Those that came after the loop's last turn. Later ones find it closed.
        for call in calls.copy():
            call.abandon()


def cancel_all(loop: asyncio.AbstractEventLoop) -> None:
    """Cancels what other threads still wait for, and what they begin meanwhile: each begins before it is cancelled."""
    loop.run_until_complete(asyncio.sleep(0))
    while left := asyncio.all_tasks(loop):
        for task in left:
            task.cancel()
        loop.run_until_complete(asyncio.gather(*left, return_exceptions=True))
        loop.run_until_complete(asyncio.sleep(0))


def end_loop(
    loop: asyncio.AbstractEventLoop, thread: threading.Thread, closers: list[Callable[[], Coroutine[Any, Any, None]]]
) -> None:
    async def close() -> None:
        for closer in closers:
            await closer()

    try:
        if threading.current_thread() is not thread:
            asyncio.run_coroutine_threadsafe(close(), loop).result()
    finally:
        loop.call_soon_threadsafe(loop.stop)
        if threading.current_thread() is not thread:
            thread.join()


class Blocking(Generic[Inner]):
    """Something of `pneuma.aio`, with the thread that its calls run in."""

    __slots__ = ("_inner", "_thread", "__weakref__")

    def __init__(self, inner: Inner, thread: LoopThread) -> None:
        self._inner = inner
        self._thread = thread

    def __repr__(self) -> str:
        return repr(self._inner)


def waits(
    method: Callable[Concatenate[Inner, P], Coroutine[Any, Any, R]]
) -> Callable[Concatenate[Blocking[Inner], P], R]:
    """The method that waits for what `method` gives."""

    @functools.wraps(method)
    def call(self: Blocking[Inner], /, *args: P.args, **kwargs: P.kwargs) -> R:
        __tracebackhide__ = True
        return self._thread.run(method(self._inner, *args, **kwargs))

    return call


def waits_for(
    outer: Callable[[Made, LoopThread], Outer], method: Callable[Concatenate[Inner, P], Coroutine[Any, Any, Made]]
) -> Callable[Concatenate[Blocking[Inner], P], Outer]:
    """The same, where `method` gives something whose calls are to wait too."""

    @functools.wraps(method)
    def call(self: Blocking[Inner], /, *args: P.args, **kwargs: P.kwargs) -> Outer:
        __tracebackhide__ = True
        return outer(self._thread.run(method(self._inner, *args, **kwargs)), self._thread)

    return call


def gives(
    outer: Callable[[Made, LoopThread], Outer], method: Callable[Concatenate[Inner, P], Made]
) -> Callable[Concatenate[Blocking[Inner], P], Outer]:
    """The same of a method that nobody waits for."""

    @functools.wraps(method)
    def call(self: Blocking[Inner], /, *args: P.args, **kwargs: P.kwargs) -> Outer:
        return outer(method(self._inner, *args, **kwargs), self._thread)

    return call
