"""What the dataclasses of the wire have in common."""

from __future__ import annotations

import dataclasses

import numpy as np


class Fields:
    """A dataclass most of whose fields are unset: only the others are shown. A name that is no field is refused."""

    __slots__ = ()

    def __repr__(self) -> str:
        assert dataclasses.is_dataclass(self)
        given = ((each.name, getattr(self, each.name)) for each in dataclasses.fields(self))
        shown = (f"{name}={value!r}" for name, value in given if value is not None and np.size(value))
        return f"{type(self).__qualname__}({', '.join(shown)})"
