"""What the Python package takes, for python_bench.cpp: prints one number.

    python_figures.py worlds SCENE COUNT TICKS     ticks of a world in a second, on all cores
    python_figures.py frames RECORDING             milliseconds to decode a frame
"""

import sys
import time

from pneuma import _native, engine
from pneuma._proto import recording_pb2
from pneuma.recording import frames_of


def worlds_ticks_a_second(scene: str, count: int, ticks: int) -> float:
    worlds = engine.Worlds(scene, count)
    begun_s = time.perf_counter()
    for _ in range(ticks):
        worlds.step()
    return count * ticks / (time.perf_counter() - begun_s)


def milliseconds_a_frame(path: str) -> float:
    reader = _native.RecordingReader(path)
    stream = recording_pb2.RecordingHeader.FromString(reader.header).stream
    messages = list(iter(reader.next, None))
    begun_s = time.perf_counter()
    frames = sum(1 for _ in frames_of(stream, iter(messages)))
    return 1e3 * (time.perf_counter() - begun_s) / frames


if __name__ == "__main__":
    what, where, *numbers = sys.argv[1:]
    if what == "worlds":
        print(worlds_ticks_a_second(where, *map(int, numbers)))
    else:
        print(milliseconds_a_frame(where))
