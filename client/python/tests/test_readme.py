"""Every block of code in README.md runs: scripts as scripts, tests by pytest, commands by the shell.

So do the blocks of Python in the README of the whole.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from conftest import checkout, environment, sources


def blocks_of(file: Path) -> list[tuple[str, str]]:
    """Language and code of each."""
    return re.findall(r"^```(\w+)\n(.*?)^```$", file.read_text(), re.MULTILINE | re.DOTALL)


blocks = blocks_of(sources / "README.md")
python = [code for language, code in blocks if language == "python"]
first_page = [code for language, code in blocks_of(checkout / "README.md") if language == "python"]
shell = [code for language, code in blocks if language == "sh"]


def first_line(code: str) -> str:
    """What names a block among the tests: its first line that is no import."""
    lines = (line for line in code.splitlines() if line.strip() and not line.startswith(("import", "from")))
    return re.sub(r"\W+", "_", next(lines))[:40]


def test_the_blocks_are_found() -> None:
    assert len(first_page) == 1 and len(python) >= 8 and len(shell) == 1 and len(blocks) == len(python) + len(shell)


@pytest.mark.parametrize("code", python + first_page, ids=first_line)
def test_a_block_runs(code: str, tmp_path: Path) -> None:
    file = tmp_path / "test_block.py"
    file.write_text(code)
    how = ["-m", "pytest", "-q", "-p", "no:cacheprovider"] if "def test_" in code else ["-W", "error"]
    ended = subprocess.run(
        [sys.executable, *how, str(file)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
        env=environment(MPLBACKEND="Agg", MPLCONFIGDIR=str(tmp_path)),
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr


def test_the_commands_run(tmp_path: Path) -> None:
    """In a folder that has what they need of the checkout."""
    for name in ("client", "proto"):
        (tmp_path / name).symlink_to(checkout / name)
    ended = subprocess.run(["bash", "-eu", "-c", shell[0]], cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert ended.returncode == 0, ended.stderr


def test_the_kick_is_as_short_as_it_should_be() -> None:
    """Lines of the first test, with the server's start and clean-up: at most 8."""
    kick = next(code for code in python if "test_a_kick" in code)
    assert len(kick.strip().splitlines()) <= 8
