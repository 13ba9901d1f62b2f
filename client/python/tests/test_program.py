"""A server of one's own: how it is found, that it starts, and that it ends, whatever becomes of the script."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import pneuma
from pneuma import PneumaError
from pneuma.aio import program as program_module
from pneuma.aio.program import find_program
from pneuma.testing import assert_hash

from conftest import alive, checkout, environment


def gone_within(process_id: int, seconds: float) -> bool:
    end = time.monotonic() + seconds
    while alive(process_id) and time.monotonic() < end:
        time.sleep(0.01)
    return not alive(process_id)


def test_the_server_ends_with_the_block() -> None:
    with pneuma.serve() as server:
        assert server.process_id and alive(server.process_id)
        assert server.worlds() == []
    assert not alive(server.process_id)


def test_the_server_ends_with_a_block_that_fails() -> None:
    with pytest.raises(ZeroDivisionError):
        with pneuma.serve() as server:
            1 / 0
    assert server.process_id and not alive(server.process_id)


def test_scenes_and_flags_are_passed_on(tmp_path: Path) -> None:
    with pneuma.serve("five-balls", data_dir=tmp_path / "kept", flags=["--threads", "1"]) as server:
        assert [world.name for world in server.worlds()] == ["five-balls"]
        server["five-balls"].pause()
        assert server["five-balls"].branch(name="second", paused=True).state()
    assert (tmp_path / "kept").is_dir()


script = """
import os, sys, time
import pneuma
server = pneuma.serve()
print(server.process_id, flush=True)
{}
"""


@pytest.mark.parametrize(
    "end", ["os._exit(1)", "os.kill(os.getpid(), 9)", "1 / 0", "sys.exit()", "del server", "time.sleep(60)"]
)
def test_no_server_outlives_its_script(end: str) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", script.format(end)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout
        process_id = int(process.stdout.readline())
        if end == "time.sleep(60)":
            process.send_signal(signal.SIGTERM)
        process.wait(10.0)
        assert gone_within(process_id, 5.0)


def test_a_server_that_does_not_end_is_killed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A wrapper that heeds no SIGTERM, and takes the real one with it."""
    monkeypatch.setattr(program_module, "end_s", 0.3)
    deaf = tmp_path / "deaf"
    deaf.write_text(f"#!/bin/sh\ntrap '' TERM\nexec {sys.executable} -c '{deaf_python}' \"$@\"\n")
    deaf.chmod(0o755)
    server = pneuma.serve(program=deaf)
    process_id = server.process_id
    assert process_id
    server.close()
    assert not alive(process_id)


deaf_python = """
import signal, subprocess, sys
from pneuma.aio.program import ends_with_this_program, find_program
signal.signal(signal.SIGTERM, signal.SIG_IGN)
subprocess.run([find_program(), *sys.argv[1:]], preexec_fn=ends_with_this_program())
"""


def test_a_server_that_dies_is_told() -> None:
    with pneuma.serve() as server:
        world = server.world("bouncing-ball", paused=True)
        assert server.process_id
        os.kill(server.process_id, signal.SIGKILL)
        told = r"UNAVAILABLE: the connection broke: pneuma-server .process \d+. ended by SIGKILL, and wrote nothing on"
        with pytest.raises(PneumaError, match=told):
            for _ in range(100):
                world.state()
        assert server.error


def test_what_a_server_that_dies_has_said_is_told(tmp_path: Path) -> None:
    """A wrapper that complains and fails once the server within it has ended."""
    wrapper = tmp_path / "wrapper"
    wrapper.write_text(f'#!/bin/sh\n{find_program()} "$@"\necho out of luck >&2\nexit 3\n')
    wrapper.chmod(0o755)
    with pneuma.serve(program=wrapper) as server:
        children = Path(f"/proc/{server.process_id}/task/{server.process_id}/children").read_text()
        os.kill(int(children), signal.SIGKILL)
        with pytest.raises(PneumaError) as told:
            for _ in range(100):
                server.worlds()
        assert "ended with the exit code 3; its last lines on standard error:\n" in str(told.value)
        assert str(told.value).endswith("\nout of luck")


@pytest.mark.parametrize(
    "program, flags, what",
    [
        ("/no/such/program", [], "NOT_FOUND: cannot start /no/such/program"),
        ("/bin/false", [], "UNAVAILABLE: the server ended before it was ready"),
        (None, ["--no-such-flag"], "no-such-flag"),
    ],
)
def test_a_server_that_does_not_start_is_told(program: str | None, flags: list[str], what: str) -> None:
    with pytest.raises(PneumaError, match=what):
        pneuma.serve(program=program, flags=flags)


def test_a_server_that_is_never_ready_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(program_module, "ready_s", 0.3)
    idle = tmp_path / "idle"
    idle.write_text("#!/bin/sh\nexec sleep 60\n")
    idle.chmod(0o755)
    with pytest.raises(PneumaError, match="was not ready in 0.3 s"):
        pneuma.serve(program=idle)


def test_an_idle_script_stays_connected() -> None:
    """The server pings every 0.3 s, and closes after two pings without an answer."""
    with pneuma.serve(flags=["--ping-interval-ms", "300"]) as server:
        time.sleep(1.5)
        assert server.worlds() == []


def test_a_world_that_is_being_brought_back_is_waited_for(tmp_path: Path) -> None:
    """The server is ready before its worlds are, and says when to ask again."""
    with pneuma.serve(data_dir=tmp_path) as server:
        saved = server.world("five-balls", paused=True).step(100)
    with pneuma.serve(data_dir=tmp_path) as server:
        assert_hash(server["five-balls"], saved.state_hash)


def test_the_program_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    on_path = tmp_path / "pneuma-server"
    on_path.write_text("")
    on_path.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    monkeypatch.setenv("PNEUMA_SERVER_PROGRAM", "/named")
    assert find_program() == "/named"
    monkeypatch.delenv("PNEUMA_SERVER_PROGRAM")
    assert find_program() == str(on_path)
    monkeypatch.setenv("PATH", "/nowhere")
    built = tmp_path / "build" / "release" / "bin" / "pneuma-server"
    built.parent.mkdir(parents=True)
    built.write_text("")
    monkeypatch.setattr(program_module, "__file__", str(tmp_path / "client/python/src/pneuma/aio/program.py"))
    assert find_program() == str(built)
    monkeypatch.setattr(program_module, "__file__", "/nowhere/program.py")
    with pytest.raises(PneumaError, match="PNEUMA_SERVER_PROGRAM is unset"):
        find_program()


def test_a_token_of_the_environment_is_no_matter(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PNEUMA_TOKEN", "of another server")
    with pneuma.serve() as server:
        assert server.worlds() == []


def test_an_interrupt_ends_a_wait() -> None:
    """Ctrl-C in a long step: the script ends, and its server with it."""
    waiting = "print(server.process_id, flush=True); server.world('cost-curve', paused=True).step(36000)"
    code = f"import pneuma\nwith pneuma.serve() as server:\n    {waiting}\n"
    with subprocess.Popen(
        [sys.executable, "-c", code],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment(),
        cwd=checkout,
    ) as process:
        assert process.stdout and process.stderr
        process_id = int(process.stdout.readline())
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
        assert process.wait(15.0) != 0
        assert "KeyboardInterrupt" in process.stderr.read()
        assert gone_within(process_id, 5.0)
