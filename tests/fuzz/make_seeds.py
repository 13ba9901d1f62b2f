#!/usr/bin/env python3
"""make_seeds.py FRAMES_TXT FOLDER: the payloads of tests/golden/frames.txt as inputs of decode_fuzz, a file each."""
import os
import sys


def main(frames_txt, folder):
    os.makedirs(folder, exist_ok=True)
    sizes = []
    with open(frames_txt, encoding="ascii") as frames:
        for number, line in enumerate(frames):
            key, _, value = line.rstrip("\n").partition(" ")
            if key == "stream":
                sizes = []
            elif key == "mesh":
                sizes.append(int(value.split()[0]))
            elif key.removeprefix("bad-") in ("key", "delta") and len(sizes) <= 3 and max(sizes) <= 255:
                flags = int(key.endswith("key")) + 2 * len(sizes)
                with open(os.path.join(folder, f"line_{number}"), "wb") as seed:
                    seed.write(bytes([flags] + sizes) + bytes.fromhex(value))


main(*sys.argv[1:])
