"""The dataclasses of pneuma._proto.scene_types, from the descriptors of scene.proto with their comments."""

import textwrap

from google.protobuf.descriptor_pb2 import (
    DescriptorProto,
    EnumDescriptorProto,
    FieldDescriptorProto,
    FileDescriptorProto,
    FileDescriptorSet,
)

head = '''"""A scene and its edits, as dataclasses. Generated from scene.proto: see generate.py.

SI units. What is None is unset, and then as the field's comment says; 0 where it says nothing.
"""
from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from pneuma.arrays import Numbers, Points, Rotation, Vector
from pneuma.fields import Fields
'''

# What tuples and arrays stand for.
arrays = {".pneuma.v1.Vec3": "Vector", ".pneuma.v1.Quaternion": "Rotation"}

Field = FieldDescriptorProto
scalars = {
    Field.TYPE_DOUBLE: "float",
    Field.TYPE_FLOAT: "float",
    Field.TYPE_UINT32: "int",
    Field.TYPE_UINT64: "int",
    Field.TYPE_BOOL: "bool",
    Field.TYPE_STRING: "str",
    Field.TYPE_BYTES: "bytes",
}

# Numbers of fields in descriptor.proto, by which comments are found.
message_in_file, enum_in_file = 4, 5
field_in_message, nested_in_message = 2, 3

Path = tuple[int, ...]


class SceneTypes:
    """What is being written, of one file."""

    def __init__(self, file: FileDescriptorProto) -> None:
        self.file = file
        self.comments: dict[Path, str] = {}
        for location in file.source_code_info.location:
            lines = (location.leading_comments + location.trailing_comments).split("\n")
            self.comments[tuple(location.path)] = " ".join(line.strip() for line in lines).strip()
        self.messages: dict[str, DescriptorProto] = {}
        for message in file.message_type:
            self.remember(message, f".{file.package}")

    def remember(self, message: DescriptorProto, inside: str) -> None:
        name = f"{inside}.{message.name}"
        self.messages[name] = message
        for nested in message.nested_type:
            self.remember(nested, name)

    def written(self) -> str:
        parts = [head]
        for enum in self.file.enum_type:
            parts.append(f"\n{literal(enum)}\n")
        for index, message in enumerate(self.file.message_type):
            if f".{self.file.package}.{message.name}" not in arrays:
                parts.append("\n\n" + self.dataclass(message, (message_in_file, index), ""))
        return "".join(parts)

    def dataclass(self, message: DescriptorProto, path: Path, indent: str) -> str:
        inner = indent + "    "
        lines = [
            f"{indent}@dataclass(kw_only=True, repr=False, slots=True)",
            f"{indent}class {message.name}(Fields):",
            *self.docstring(message, path, inner),
        ]
        for enum in message.enum_type:
            lines += ["", f"{inner}{literal(enum)}"]
        for index, nested in enumerate(message.nested_type):
            lines += ["", self.dataclass(nested, (*path, nested_in_message, index), inner).rstrip("\n")]
        if message.field:
            lines.append("")
        for each in message.field:
            lines.append(f"{inner}{each.name}: {self.annotation(each)}")
        return "\n".join(lines) + "\n"

    def docstring(self, message: DescriptorProto, path: Path, indent: str) -> list[str]:
        lines = wrapped(self.comments.get(path) or f"`pneuma.v1.{message.name}`.", indent)
        told = [
            line
            for index, each in enumerate(message.field)
            if (comment := self.comments.get((*path, field_in_message, index)))
            for line in wrapped(f"{each.name}: {comment}", indent, hanging="    ")
        ]
        if told:
            lines += ["", *told]
        if len(lines) == 1:
            return [f'{indent}"""{lines[0].lstrip()}"""']
        return [f'{indent}"""{lines[0].lstrip()}', *lines[1:], f'{indent}"""']

    def annotation(self, each: FieldDescriptorProto) -> str:
        """The type and the default."""
        kind = self.type_of(each)
        if each.label != Field.LABEL_REPEATED:
            return f"{kind} | None = None"
        if kind == "Vector":
            return "Points = ()"
        if kind in ("float", "int"):
            return "Numbers = ()"
        return f"list[{kind}] = field(default_factory=list)"

    def type_of(self, each: FieldDescriptorProto) -> str:
        if each.type in scalars:
            return scalars[each.type]
        if each.type_name in arrays:
            return arrays[each.type_name]
        name: str = each.type_name.removeprefix(f".{self.file.package}.")
        message = self.messages.get(each.type_name)
        if message is None:
            return name  # an enum: the alias of its names
        # A message that is nothing but a choice: one of the choices will do.
        is_choice = message.field and all(choice.HasField("oneof_index") for choice in message.field)
        proper = is_choice and not any(choice.proto3_optional for choice in message.field)
        choices = [name]
        if proper:
            choices += [
                self.type_of(c) for c in message.field if c.type == Field.TYPE_MESSAGE and c.type_name not in arrays
            ]
        return " | ".join(dict.fromkeys(choices))


def wrapped(text: str, indent: str, hanging: str = "") -> list[str]:
    return textwrap.wrap(
        text,
        116,
        initial_indent=indent,
        subsequent_indent=indent + hanging,
        break_long_words=False,
        break_on_hyphens=False,
    )


def literal(enum: EnumDescriptorProto) -> str:
    names = ", ".join(f'"{value.name}"' for value in enum.value if value.number != 0)
    return f"{enum.name} = Literal[{names}]"


def scene_types(descriptors: bytes) -> str:
    """The module, from a serialised FileDescriptorSet with source info."""
    files = FileDescriptorSet.FromString(descriptors).file
    return SceneTypes(next(file for file in files if file.name.endswith("/scene.proto"))).written()
