"""A pneuma-server of one's own: found, started, ended."""

from __future__ import annotations

import asyncio
import ctypes
import os
import re
import shutil
import signal
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from pneuma.errors import PneumaError

# It loads the built-in scenes in well under a second; machines that are busy take longer.
ready_s = 30.0
# The server takes up to 5 s to empty its queues.
end_s = 8.0
# What the end of a log may tell of a server that did not start.
log_tail_bytes = 4000
# Of a server that ended while it was used, so many lines are told.
last_lines = 10
# How long a process may take to be gone once its connection is.
told_s = 1.0

# Unless the caller's flags say otherwise. A script is one client, which waits for its replies: no rate is needed.
own_flags = {
    "--listen": "127.0.0.1:0",
    "--http": "127.0.0.1:0",
    "--commands-per-s": "1e6",
    "--commands-burst": "1e6",
    "--log-level": "warn",
}

PR_SET_PDEATHSIG = 1  # linux/prctl.h


def find_program() -> str:
    """PNEUMA_SERVER_PROGRAM, or `pneuma-server` on PATH, or of a checkout that this file is in. Raises PneumaError."""
    named = os.environ.get("PNEUMA_SERVER_PROGRAM")
    if named:
        return named
    found = shutil.which("pneuma-server")
    if found:
        return found
    for folder in Path(__file__).resolve().parents:
        built = folder / "build" / "release" / "bin" / "pneuma-server"
        if built.is_file():
            return str(built)
    raise PneumaError(
        "NOT_FOUND",
        "no pneuma-server: PNEUMA_SERVER_PROGRAM is unset, and PATH has none; ./dev run builds one",
        "serve",
    )


def ends_with_this_program() -> Callable[[], None]:
    """What a child calls before it becomes another program, so that it is killed when the thread that made it ends."""
    prctl = ctypes.CDLL(None).prctl
    parent = os.getpid()

    def arrange() -> None:
        prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:
            os._exit(1)  # the parent ended before

    return arrange


def signal_name(number: int) -> str:
    """SIGKILL of 9; a number that has no name as it is."""
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


@dataclass
class Program:
    """A running server. `page` is empty where it has none."""

    process: asyncio.subprocess.Process
    host: str
    port: int
    http: str
    page: str
    log: IO[bytes]

    @classmethod
    async def start(cls, program: str, flags: Sequence[str]) -> Program:
        """Starts it on free ports, and waits until it is ready. It ends with the calling thread at the latest.

        Raises PneumaError with the end of its log where it does not start.
        """
        log = tempfile.TemporaryFile()
        environment = {name: value for name, value in os.environ.items() if name != "PNEUMA_TOKEN"}
        own = [word for name, value in own_flags.items() if name not in flags for word in (name, value)]
        try:
            process = await asyncio.create_subprocess_exec(
                program,
                *own,
                *flags,
                stdin=asyncio.subprocess.DEVNULL,
                stdout=asyncio.subprocess.PIPE,
                stderr=log,
                env=environment,
                preexec_fn=ends_with_this_program(),
            )
        except OSError as error:
            log.close()
            raise PneumaError("NOT_FOUND", f"cannot start {program}: {error.strerror}", "serve") from None
        started = cls(process, "127.0.0.1", 0, "", "", log)
        try:
            async with asyncio.timeout(ready_s):
                await started._read_ready_line()
        except BaseException as error:
            await started.end()
            if isinstance(error, TimeoutError):
                raise PneumaError("UNAVAILABLE", f"{program} was not ready in {ready_s} s", "serve") from None
            raise
        return started

    async def _read_ready_line(self) -> None:
        assert self.process.stdout
        while line := (await self.process.stdout.readline()).decode():
            found = re.match(r"ready tcp=(\S+):(\d+) http=(\S+)(?: page=(\S+))?", line)
            if found:
                self.host, port, self.http, page = found.groups()
                self.port, self.page = int(port), page or ""
                return
        await self.process.wait()
        raise PneumaError("UNAVAILABLE", f"the server ended before it was ready: {self.log_tail()}", "serve")

    def log_tail(self) -> str:
        """The end of what it logged."""
        file = self.log.fileno()
        begin = max(0, os.fstat(file).st_size - log_tail_bytes)
        # Its place in the file is the server's too: left alone.
        return os.pread(file, log_tail_bytes, begin).decode("utf-8", "replace").strip()

    async def how_it_ended(self) -> str:
        """By which signal or code, and its last lines on standard error. Empty where it still runs."""
        try:
            code = await asyncio.wait_for(self.process.wait(), told_s)
        except asyncio.TimeoutError:
            return ""
        how = f"by {signal_name(-code)}" if code < 0 else f"with the exit code {code}"
        lines = "" if self.log.closed else "\n".join(self.log_tail().splitlines()[-last_lines:])
        told = f"; its last lines on standard error:\n{lines}" if lines else ", and wrote nothing on standard error"
        return f"pneuma-server (process {self.process.pid}) ended {how}{told}"

    async def end(self) -> None:
        """Asks it to end, and kills it where that takes too long."""
        if self.log.closed:
            return
        try:
            if self.process.returncode is None:
                self.process.terminate()
            await asyncio.wait_for(self.process.wait(), end_s)
        except (ProcessLookupError, asyncio.TimeoutError):
            pass  # it has ended meanwhile, or does not
        finally:
            if self.process.returncode is None:
                self.process.kill()
                await self.process.wait()
            self.log.close()
