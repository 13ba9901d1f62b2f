#!/usr/bin/env python3
"""make_seeds.py FOLDER FRAMES_TXT...: the payloads of tests/golden's frames.txt and simulated_frames.txt as inputs:
FOLDER/decode has a file each for decode_fuzz, FOLDER/stream a file a stream for stream_fuzz, FOLDER/recording the same
for recording_fuzz. FOLDER/log has a command log for log_fuzz, FOLDER/mesh a mesh or two for mesh_fuzz, FOLDER/http
requests for http_fuzz."""
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
    for kind in ("decode", "stream", "recording", "log", "mesh", "http"):
        os.makedirs(os.path.join(folder, kind), exist_ok=True)

    def write(kind, name, content):
        with open(os.path.join(folder, kind, name), "wb") as seed:
            seed.write(content)

    every_stream = (stream for frames_txt in frames_txts for stream in streams(frames_txt))
    for number, (sizes, fields, payloads) in enumerate(every_stream):
        if not sizes or len(sizes) > BODIES_MAX or max(sizes) > 255:
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
        messages = [frame(tick, kind == "key", payload, False)[2:] for tick, (kind, payload) in enumerate(payloads, 2)]
        messages = [field(13, message) for message in messages]  # of a ServerMessage
        recording = b"".join(len(message).to_bytes(2, "little") + message for message in messages)
        write("recording", f"{number}", bytes([2 * len(sizes)] + sizes) + recording)

    records = [struct.pack("<IIQI", len(body), 0, tick, 0) + body for tick, body in ((1, b"one"), (7, b"two"), (7, b""))]
    write("log", "chained", b"\1" + b"".join(records))
    write("log", "torn", b"\1" + b"".join(records)[:-22])
    write("log", "unchained", b"\3" + b"".join(struct.pack("<IIQ", 3, 0, tick) + b"old" for tick in (1, 2)))
    corners = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
    vertices = "".join("v {} {} {}\n".format(*corner) for corner in corners)
    faces = ("1 3 2", "1 2 4", "1 4 3", "2 3 4")
    for name, some in (("closed", faces), ("open", faces[:3]), ("turned", ("1 2 3",) + faces[1:])):
        write("mesh", name, b"\3" + (vertices + "".join(f"f {face}\n" for face in some)).encode())
    upgrade = "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
    for name, path, fields in (("page", "/hello", ""), ("socket", "/ws", upgrade), ("cached", "/hello", 'If-None-Match: "x"\r\n')):
        text = f"GET {path} HTTP/1.1\r\nHost: localhost\r\n{fields}\r\n"
        write("http", name, text.encode() + (b"\x82\x85\0\0\0\0hello" if name == "socket" else b""))


main(*sys.argv[1:])
