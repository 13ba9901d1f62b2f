"""Python values as messages, and back: dataclasses of `scene_types`, dicts, tuples and numpy arrays.

Tells a value that a field cannot hold as INVALID_ARGUMENT with the field's path, as the server would.
"""

from __future__ import annotations

import dataclasses
import difflib
import operator
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from google.protobuf.descriptor import Descriptor, FieldDescriptor
from google.protobuf.message import Message
from numpy.typing import NDArray

from pneuma._proto import scene_types
from pneuma.errors import PneumaError

# What a sequence of numbers means where one of these is wanted.
components = {"pneuma.v1.Vec3": "xyz", "pneuma.v1.Quaternion": "wxyz"}

# What a field takes, in words.
kinds = {
    FieldDescriptor.CPPTYPE_STRING: "text",
    FieldDescriptor.CPPTYPE_BOOL: "True or False",
    FieldDescriptor.CPPTYPE_ENUM: "a name",
    FieldDescriptor.CPPTYPE_FLOAT: "a number",
    FieldDescriptor.CPPTYPE_DOUBLE: "a number",
    FieldDescriptor.CPPTYPE_INT32: "a whole number",
    FieldDescriptor.CPPTYPE_INT64: "a whole number",
    FieldDescriptor.CPPTYPE_UINT32: "a whole number",
    FieldDescriptor.CPPTYPE_UINT64: "a whole number",
}


def fill(message: Message, value: object, where: str) -> None:
    """Sets the fields of `message` that `value` names. `where` leads the paths of errors."""
    descriptor: Descriptor = message.DESCRIPTOR
    if isinstance(value, Message):
        if value.DESCRIPTOR.full_name != descriptor.full_name:
            raise invalid(where, f"is a {value.DESCRIPTOR.name}, not a {descriptor.name}")
        message.MergeFromString(value.SerializeToString())
        return
    message.SetInParent()  # one without a field is there, too
    if dataclasses.is_dataclass(value):
        fill_by_name(message, fields_of(message, value, where), where)
    elif isinstance(value, Mapping):
        fill_by_name(message, value, where)
    elif descriptor.full_name in components:
        names = components[descriptor.full_name]
        array = array_of(value, where)
        if array.ndim > 1:
            raise invalid(where, f"has the shape {array.shape}; {', '.join(names)} have ({len(names)},)")
        numbers = array.ravel().tolist()
        if len(numbers) != len(names):
            raise invalid(where, f"has {len(numbers)} numbers; {', '.join(names)} are {len(names)}")
        for name, number in zip(names, numbers):
            setattr(message, name, number)
    else:
        raise invalid(where, f"{value!r} is no {descriptor.name}")


def fields_of(message: Message, value: object, where: str) -> Mapping[str, object]:
    """A dataclass's. Where a message is a mere choice, a choice will do: a Shape.Sphere for a Shape."""
    descriptor: Descriptor = message.DESCRIPTOR
    name = f"pneuma.v1.{type(value).__qualname__}"
    if message_name(type(value)) != descriptor.full_name:
        choices = [
            f.name
            for f in descriptor.fields
            if f.message_type and f.message_type.full_name == message_name(type(value))
        ]
        if len(choices) != 1:
            raise invalid(where, f"is a {name.removeprefix('pneuma.v1.')}, not a {descriptor.name}")
        return {choices[0]: value}
    return {f.name: getattr(value, f.name) for f in dataclasses.fields(value)}


def message_name(kind: type) -> str:
    """The full name of the message that a dataclass, or what is derived from one, stands for."""
    for each in kind.__mro__:
        if each.__module__ == scene_types.__name__:
            return f"pneuma.v1.{each.__qualname__}"
    return kind.__qualname__


def fill_by_name(message: Message, values: Mapping[str, object], where: str) -> None:
    by_name: dict[str, FieldDescriptor] = {}
    for each in message.DESCRIPTOR.fields:
        by_name[each.name] = by_name[each.json_name] = each
    for name, value in values.items():
        place = f"{where}.{name}" if where else name
        if name not in by_name:
            kind = message.DESCRIPTOR.name
            raise invalid(place, f"unknown field of {kind}{meant_or_all(name, message.DESCRIPTOR)}")
        if value is not None:
            fill_field(message, by_name[name], value, place)


def meant_or_all(name: str, kind: Descriptor) -> str:
    """What stands behind an unknown field: the known one that it begins or is close to, or all that there are."""
    known = [each.name for each in kind.fields]
    longer = [each for each in known if len(name) >= 3 and each.startswith(name)]
    meant = longer or difflib.get_close_matches(name, known, n=1)
    return f"; did you mean {meant[0]}?" if meant else f"; there are {', '.join(known)}"


def fill_field(message: Message, each: FieldDescriptor, value: object, where: str) -> None:
    repeated = each.label == each.LABEL_REPEATED
    if repeated and (not isinstance(value, Iterable) or isinstance(value, (str, bytes, Mapping))):
        raise invalid(where, f"{value!r} is no list")
    target = getattr(message, each.name)
    if not repeated:
        if each.message_type:
            fill(target, value, where)
        else:
            assign(lambda: setattr(message, each.name, scalar_of(each, value)), where, each, value)
    elif each.message_type and isinstance(value, np.ndarray):
        if value.ndim != 2 or value.shape[1] != 3 or each.message_type.full_name != "pneuma.v1.Vec3":
            raise invalid(where, f"is an array of shape {value.shape}; points have the shape (n, 3)")
        for x, y, z in np.asarray(value, np.float64).tolist():
            target.add(x=x, y=y, z=z)
    elif each.message_type:
        assert isinstance(value, Iterable)
        for index, element in enumerate(value):
            fill(target.add(), element, f"{where}[{index}]")
    else:
        whole = each.type in (each.TYPE_UINT32, each.TYPE_UINT64)
        assign(lambda: target.extend(array_of(value, where, whole=whole).ravel().tolist()), where, each, value)


def scalar_of(each: FieldDescriptor, value: object) -> object:
    if each.enum_type and isinstance(value, str):
        known = each.enum_type.values_by_name
        if value not in known:
            raise ValueError(f"is none of {', '.join(name for name, v in known.items() if v.number)}")
        return known[value].number
    return value.item() if isinstance(value, np.generic) else value


def assign(set_it: Any, where: str, each: FieldDescriptor, value: object) -> None:
    """Calls `set_it`, and tells a value that protobuf does not take as an error with its place."""
    try:
        set_it()
    except TypeError:
        plain = isinstance(value, (str, bytes, int, float, list, tuple))
        shown = repr(value) if plain else f"a {type(value).__name__}"
        raise invalid(where, f"is {shown}, not {kinds[each.cpp_type]}") from None
    except ValueError as error:
        is_short = not isinstance(value, (Sequence, np.ndarray)) or len(value) <= 1
        raise invalid(where, f"{value!r}: {error}" if is_short else str(error)) from None


def array_of(value: object, where: str, *, whole: bool = False) -> NDArray[Any]:
    """Numbers in a shape. Raises PneumaError where elements are none, or rows have different lengths."""
    try:
        array = np.asarray(value)
    except ValueError:
        raise invalid(where, "has rows of different lengths") from None
    if array.size and array.dtype.kind not in ("iu" if whole else "iuf"):
        raise invalid(where, f"has elements that are no {'whole numbers' if whole else 'numbers'}")
    return array


def whole(number: int, where: str, *, least: int = 0, bits: int = 32) -> int:
    """A count that the wire can hold. Raises PneumaError."""
    try:
        value = operator.index(number)
    except TypeError:
        raise invalid(where, f"is {number!r}, not a whole number") from None
    if not least <= value < 2**bits:
        raise invalid(where, f"is {value}; it must be {least} or more, and below 2^{bits}")
    return value


def parts_of(given: object, where: str, *names: str) -> tuple[Any, ...]:
    """A tuple's elements, one for each name. Raises PneumaError where there are others; text has none."""
    parts = tuple(given) if isinstance(given, Iterable) and not isinstance(given, (str, bytes)) else ()
    if len(parts) != len(names):
        raise invalid(where, f"is {given!r}, not ({', '.join(names)})")
    return parts


def invalid(where: str, what: str) -> PneumaError:
    return PneumaError("INVALID_ARGUMENT", what, where)


def value_of(message: Message) -> Any:
    """The dataclass of a message of scene.proto: Vec3 and Quaternion are tuples, enums names, what is unset None."""
    descriptor: Descriptor = message.DESCRIPTOR
    if descriptor.full_name in components:
        return tuple(getattr(message, name) for name in components[descriptor.full_name])
    kind: Any = scene_types
    for name in descriptor.full_name.removeprefix("pneuma.v1.").split("."):
        kind = getattr(kind, name)
    return kind(**{each.name: field_value(each, value) for each, value in message.ListFields()})


def field_value(each: FieldDescriptor, value: Any) -> Any:
    if each.label == each.LABEL_REPEATED:
        return [value_of(element) for element in value] if each.message_type else list(value)
    if each.message_type:
        return value_of(value)
    return each.enum_type.values_by_number[value].name if each.enum_type else value
