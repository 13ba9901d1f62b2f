"""Whether this build of the package has its part in C++: the engine, the frame codec and the files of recordings.

That part is loaded when it is first needed: a script that only talks to a server does without.
"""

from __future__ import annotations

from functools import cache
from importlib.util import find_spec


@cache
def has_native() -> bool:
    return find_spec("pneuma._native") is not None


def need_native() -> None:
    """Raises ImportError where there is none."""
    if not has_native():
        raise ImportError(
            'this build of the package has no part in C++; README.md, "Install it", says how to build one that has'
        )
