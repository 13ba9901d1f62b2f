"""What the tests share. They run against the real server; the fake one is for what that does not do when asked."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from pneuma.aio.program import Program, find_program
from pneuma.blocking import LoopThread
from pneuma.client import Server, serve

from fake_server import FakeServer

pytest_plugins = ["pytester"]

#: client/python: examples and README.
sources = Path(__file__).resolve().parents[1]
checkout = sources.parents[1]


@pytest.fixture(scope="session")
def shared() -> Iterator[Server]:
    """A private server of the session, for tests that clean up what they make."""
    with serve() as server:
        yield server


@pytest.fixture
def fake() -> Iterator[FakeServer]:
    with FakeServer() as server:
        yield server


@dataclass
class Guarded:
    """A server with the world bouncing-ball that asks for a token, over TLS."""

    address: str
    certificate: Path
    token: str


@pytest.fixture(scope="session")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Guarded]:
    folder = tmp_path_factory.mktemp("trust")
    certificate, key, token = folder / "certificate.pem", folder / "key.pem", folder / "token"
    request = (
        "openssl req -x509 -newkey rsa:2048 -nodes -days 1 -subj /CN=localhost -addext subjectAltName=IP:127.0.0.1"
    )
    subprocess.run([*request.split(), "-keyout", key, "-out", certificate], check=True, capture_output=True)
    token.write_text("0123456789abcdef0123456789abcdef\n")
    flags = {"--tls-cert": certificate, "--tls-key": key, "--token-file": token, "--scene": "bouncing-ball"}
    thread = LoopThread()
    program = thread.run(Program.start(find_program(), [word for pair in flags.items() for word in map(str, pair)]))
    thread.at_end(program.end)
    yield Guarded(f"{program.host}:{program.port}", certificate, token.read_text().strip())
    thread.end()


def alive(process_id: int) -> bool:
    """Whether a process runs, zombies not counted."""
    try:
        return Path(f"/proc/{process_id}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def environment(**changes: str) -> dict[str, str]:
    return {**os.environ, **changes}
