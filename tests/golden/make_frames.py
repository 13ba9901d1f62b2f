#!/usr/bin/env python3
"""Writes frames.txt and topologies.txt: golden vectors made from proto/WIRE.md alone, by no code of the product.

The parameters of each block are given by hand, so that the vectors cover what the format allows, not what one encoder chooses.
"""
import hashlib
import os
import struct

HERE = os.path.dirname(os.path.abspath(__file__))


def zigzag(d):
    return 2 * d if d >= 0 else -2 * d - 1


def code_bits(code, parameter):
    ones = code >> parameter
    if ones >= 16:
        text = format(code, "b")
        return "1" * 16 + format(len(text) - 1, "06b") + text
    low = code & ((1 << parameter) - 1)
    return "1" * ones + "0" + (format(low, f"0{parameter}b") if parameter else "")


def block(mode, lattice, base, parameters):
    if mode == 0:
        return b"\x00"
    bits = "".join(format(p, "06b") for p in parameters)
    for i, value in enumerate(lattice):
        if mode == 1:
            before = base[i]
        else:
            before = lattice[i - 3] if i >= 3 else 0
        bits += code_bits(zigzag(value - before), parameters[i % 3])
    bits += "0" * (-len(bits) % 8)
    return bytes([mode]) + bytes(int(bits[i:i + 8], 2) for i in range(0, len(bits), 8))


def wave(count, amplitude):
    return [((i * i * 37 + i * 11) % (2 * amplitude + 1)) - amplitude for i in range(count)]


def moved(base, amplitude):
    return [b + d for b, d in zip(base, wave(len(base), amplitude))]


TETRAHEDRON = [0, 0, 0, 1000, 0, 0, 0, 1000, 0, -7, -1, 1000]
FAR = [2**43, -2**43, 2**42 + 1, 2**43 - 5, -2**43 + 9, -2**42]
CLOUD = wave(3 * 40, 5000)

# name, kind, bodies: (mode, lattice, base, parameters)
FRAMES = [
    ("one vertex at the origin", "key", [(2, [0, 0, 0], None, (0, 0, 0))]),
    ("one vertex, negative", "key", [(2, [-1, 2, -3], None, (0, 1, 2))]),
    ("tetrahedron", "key", [(2, TETRAHEDRON, None, (9, 9, 9))]),
    ("tetrahedron with escapes", "key", [(2, TETRAHEDRON, None, (0, 3, 6))]),
    ("far out, plain values of 45 bits", "key", [(2, FAR, None, (0, 4, 40))]),
    ("widest parameter", "key", [(2, [5, -5, 1], None, (63, 0, 63))]),
    ("at rest", "delta", [(0, TETRAHEDRON, TETRAHEDRON, None)]),
    ("small moves", "delta", [(1, moved(CLOUD, 6), CLOUD, (2, 2, 2))]),
    ("one axis only", "delta", [(1, [c + (i % 3 == 1) * (i - 50) for i, c in enumerate(CLOUD)], CLOUD, (0, 5, 0))]),
    ("a leap, as a key block", "delta", [(2, moved(TETRAHEDRON, 3), FAR + FAR, (10, 10, 10))]),
    ("three bodies", "delta", [(0, CLOUD, CLOUD, None), (1, moved(TETRAHEDRON, 20), TETRAHEDRON, (4, 4, 5)),
                               (2, CLOUD, moved(CLOUD, 9), (12, 12, 12))]),
    ("three bodies, key", "key", [(2, CLOUD, None, (13, 12, 13)), (2, TETRAHEDRON, None, (9, 8, 9)),
                                  (2, [7, 7, 7], None, (3, 3, 3))]),
]

TET_KEY = block(2, TETRAHEDRON, None, (9, 9, 9))
# name, kind, bases (their sizes are the bodies' sizes), payload
BAD = [
    ("nothing at all", "key", [TETRAHEDRON], b""),
    ("no such mode", "delta", [TETRAHEDRON], b"\x03"),
    ("an unchanged body in a key frame", "key", [TETRAHEDRON], b"\x00"),
    ("a delta block in a key frame", "key", [TETRAHEDRON], block(1, TETRAHEDRON, TETRAHEDRON, (0, 0, 0))),
    ("only the mode", "delta", [TETRAHEDRON], b"\x01"),
    ("parameters cut short", "delta", [TETRAHEDRON], b"\x01\x00\x00"),
    ("last byte missing", "key", [TETRAHEDRON], TET_KEY[:-1]),
    ("a byte too many", "key", [TETRAHEDRON], TET_KEY + b"\x00"),
    ("padding not zero", "key", [[0, 0, 0]], b"\x02\x00\x00\x01"),
    ("second body missing", "delta", [TETRAHEDRON, CLOUD], b"\x00"),
    ("an escape whose value is cut short", "delta", [[0, 0, 0]], b"\x01\x00\x00\x3f\xff\xff\xff\xff"),
]

TOPOLOGIES = [
    ("nothing", 0, []),
    ("one face", 3, [0, 1, 2]),
    ("one face of four vertices", 4, [0, 1, 2]),
    ("tetrahedron", 4, [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]),
    ("wide indices", 65536, [65535, 256, 1, 0, 65535, 4660]),
]


def row(key, values):
    return f"{key} {' '.join(map(str, values))}\n"


def main():
    with open(os.path.join(HERE, "frames.txt"), "w", encoding="ascii") as out:
        out.write("# Frame payloads and what they mean; see README.md. Made by make_frames.py.\n")
        for name, kind, bodies in FRAMES:
            out.write(f"\nframe {name}\nkind {kind}\n")
            payload = b""
            for mode, lattice, base, parameters in bodies:
                if kind == "delta":
                    out.write(row("base", base))
                out.write(row("lattice", lattice))
                payload += block(mode, lattice, base, parameters)
            out.write(f"payload {payload.hex()}\n")
        for name, kind, bases, payload in BAD:
            out.write(f"\nbad {name}\nkind {kind}\n")
            for base in bases:
                out.write(row("base", base))
            out.write(f"payload {payload.hex()}\n".rstrip() + "\n")
    with open(os.path.join(HERE, "topologies.txt"), "w", encoding="ascii") as out:
        out.write("# Topologies and their hashes; see README.md. Made by make_frames.py.\n")
        for name, vertices, indices in TOPOLOGIES:
            digest = hashlib.sha256(struct.pack(f"<{1 + len(indices)}I", vertices, *indices)).hexdigest()[:32]
            out.write(f"\ntopology {name}\nvertices {vertices}\n{row('indices', indices).rstrip()}\nhash {digest}\n")


main()
