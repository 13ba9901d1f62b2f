"""Things by their names. A name that is not there is told with the names that are."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NoReturn, TypeVar

T = TypeVar("T")


def not_there(kind: str, name: object, there: Iterable[str], hint: str = "") -> KeyError:
    return KeyError(f"no {kind} {name} (there are {', '.join(there) or 'none'}){hint}")


class Named(dict[str, T]):
    """A dict whose KeyError says what there is. kind: what its values are, such as "rigid body"."""

    def __init__(self, kind: str, things: Mapping[str, T]) -> None:
        super().__init__(things)
        self.kind = kind

    def __missing__(self, name: object) -> NoReturn:
        raise not_there(self.kind, name, self)
