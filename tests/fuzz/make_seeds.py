#!/usr/bin/env python3
"""make_seeds.py FOLDER FRAMES_TXT...: the payloads of tests/golden's frames.txt and simulated_frames.txt as inputs:
FOLDER/decode has a file each for decode_fuzz, FOLDER/stream a file a stream for stream_fuzz."""
import os
import struct
import sys

BODIES_MAX = 3


def varint(value):
    out = bytearray()
    while value >= 0x80:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes(out) + bytes([value])


def field(number, value):
    """Of a protobuf message: a varint, or bytes."""
    if isinstance(value, int):
        return varint(number << 3) + varint(value)
    return varint(number << 3 | 2) + varint(len(value)) + value


def frame(tick, is_key, payload, has_velocities):
    """Two bytes of length and a message of class Frame, of stream 1, as the server sends it: a key frame tells its layout,
    1, and a delta frame goes without; every other delta is of layer 1."""
    message = field(1, 1) + (field(2, 1) if is_key else b"") + field(3, tick)
    if not is_key:
        message += field(5, tick - 1 - (tick - 1) % 2) + field(10, 1 if tick % 2 else 0)
    message += field(6, payload)
    if has_velocities:
        message += field(8, payload)
    return len(message).to_bytes(2, "little") + message


def mechanics(fields):
    """Two bytes of length and a message of class Mechanics, of a golden vector's fields."""

    def double(number, value):
        return varint(number << 3 | 1) + struct.pack("<d", value)

    message = double(1, fields["frame_s"][0]) + field(2, int(fields["substeps"][0]))
    for number, name in ((3, "masses_kg"), (4, "rest_lengths_m"), (5, "stiffnesses_n_m")):
        message += field(number, struct.pack(f"<{len(fields[name])}f", *fields[name]))
    message += double(6, fields["damping_n_s_m"][0])
    pressure_pa, volume_m3, exponent, outside_pa = fields["gas"]
    message += field(7, double(1, pressure_pa) + double(2, volume_m3) + field(3, int(exponent)) + double(4, outside_pa))
    message += field(8, double(2, fields["gravity_m_s2"][1]))
    return len(message).to_bytes(2, "little") + message


def streams(frames_txt):
    """Of each stream: its bodies' sizes, the fields of the first one's mechanics, and its frames as pairs of "key" or
    "delta" (bad ones too) and a payload."""
    sizes, fields, payloads = [], {}, []
    with open(frames_txt, encoding="ascii") as lines:
        for line in lines:
            key, _, value = line.rstrip("\n").partition(" ")
            if key == "stream":
                if sizes:
                    yield sizes, fields, payloads
                sizes, fields, payloads = [], {}, []
            elif key == "mesh":
                sizes.append(int(value.split()[0]))
            elif key.removeprefix("bad-") in ("key", "delta"):
                payloads.append((key.removeprefix("bad-"), bytes.fromhex(value)))
            elif len(sizes) == 1 and key not in ("points", "check"):
                fields[key] = [float(number) for number in value.split()]
    yield sizes, fields, payloads


def main(folder, *frames_txts):
    for kind in ("decode", "stream"):
        os.makedirs(os.path.join(folder, kind), exist_ok=True)

    def write(kind, name, content):
        with open(os.path.join(folder, kind, name), "wb") as seed:
            seed.write(content)

    every_stream = (stream for frames_txt in frames_txts for stream in streams(frames_txt))
    for number, (sizes, fields, payloads) in enumerate(every_stream):
        if len(sizes) > BODIES_MAX or max(sizes) > 255:
            continue
        flags = 2 * len(sizes) + (8 if "frame_s" in fields else 0)
        for at, (kind, payload) in enumerate(payloads):
            write("decode", f"{number}_{at}", bytes([flags + (kind == "key")] + sizes) + payload)
        for has_velocities in (False, True):
            messages = [
                frame(tick, kind == "key", payload, has_velocities) for tick, (kind, payload) in enumerate(payloads, 2)
            ]
            if "frame_s" in fields:
                messages.insert(0, mechanics(fields))
            write("stream", f"{number}_{int(has_velocities)}", bytes([flags + has_velocities] + sizes) + b"".join(messages))


main(*sys.argv[1:])
