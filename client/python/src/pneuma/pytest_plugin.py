"""For pytest: the fixture `pneuma`, a private server whose worlds live as long as a test; `pneuma_server` is the same.

When a test fails its worlds are kept as files, and their paths printed: `pneuma restore FILE` looks at one again.
"""

from __future__ import annotations

import re
from collections.abc import Generator, Iterator
from pathlib import Path
from typing import Any

import pytest

from pneuma.client import Server, serve
from pneuma.errors import PneumaError, at_a_blocks_end

server_of = pytest.StashKey[Server]()
folder_of = pytest.StashKey[Path]()


class SharedServer:
    """The session's server, and another one should a test have ended that."""

    def __init__(self) -> None:
        self._server: Server | None = None

    def get(self) -> Server:
        if self._server and self._server.error:
            self.close()
        if self._server is None:
            self._server = serve()
        return self._server

    def close(self) -> None:
        if self._server:
            self._server.close()
        self._server = None


@pytest.fixture(scope="session")
def _pneuma_shared() -> Iterator[SharedServer]:
    """What the fixtures take their server from."""
    shared = SharedServer()
    yield shared
    shared.close()


@pytest.fixture
def pneuma_server(
    request: pytest.FixtureRequest, _pneuma_shared: SharedServer, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Server]:
    """A pneuma-server of the session's own, without worlds. Those that a test makes are destroyed after it."""
    server = _pneuma_shared.get()
    request.node.stash[server_of] = server
    request.node.stash[folder_of] = (
        tmp_path_factory.getbasetemp() / "worlds" / re.sub(r"[^\w.-]+", "_", request.node.nodeid)
    )
    yield server
    if server.error is None:
        for world in server.worlds():
            with at_a_blocks_end(None):
                server[world.name].destroy()


@pytest.fixture
def pneuma(pneuma_server: Server) -> Server:
    """The same server as `pneuma_server`. In such a test the name `pneuma` is not the module."""
    return pneuma_server


@pytest.hookimpl(hookwrapper=True)  # type: ignore[misc]  # pluggy has no types
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, Any, None]:
    outcome = yield
    report: pytest.TestReport = outcome.get_result()
    server = item.stash.get(server_of, None)
    if report.when != "teardown" and report.failed and server:
        report.sections.append(("pneuma", "\n".join(kept(server, item.stash[folder_of]))))


def kept(server: Server, folder: Path) -> Iterator[str]:
    """Saves each world of the server, and says where."""
    try:
        for world in server.worlds():
            folder.mkdir(parents=True, exist_ok=True)
            path = folder / f"{world.name}.world"
            server[world.name].save(path)
            yield f"{world.name} at tick {world.tick} is kept: {path}"
    except (PneumaError, OSError) as error:
        yield f"worlds could not be kept: {error}"
