"""What the Python package takes, for python_bench.cpp: prints one number.

    python_figures.py worlds SCENE COUNT TICKS     ticks of a world in a second, on all cores
    python_figures.py frames RECORDING             milliseconds to decode a frame
    python_figures.py steps SERVER-PROGRAM         milliseconds that a call takes over the tick that it steps
"""

import os
import statistics
import sys
import time

import pneuma
from pneuma import _native, engine
from pneuma._proto import recording_pb2
from pneuma.recording import Contents


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
    contents = Contents(stream)
    contents.take(messages)
    return 1e3 * (time.perf_counter() - begun_s) / len(contents.frames)


def milliseconds_on_top(server_program: str) -> float:
    os.environ["PNEUMA_SERVER_PROGRAM"] = server_program
    calls_s, steps_s = [], []
    with pneuma.serve() as server:
        world = server.world("five-balls", paused=True)
        world.step(60)
        for _ in range(300):
            before_s = stepped_s(world)
            begun_s = time.perf_counter()
            world.step()
            calls_s.append(time.perf_counter() - begun_s)
            steps_s.append(stepped_s(world) - before_s)
    return 1e3 * (statistics.median(calls_s) - statistics.median(steps_s))


def stepped_s(world: pneuma.World) -> float:
    """What the stages of its ticks have taken so far."""
    return sum(stage.time_s for stage in world.stats().stages)


if __name__ == "__main__":
    what, where, *numbers = sys.argv[1:]
    if what == "worlds":
        print(worlds_ticks_a_second(where, *map(int, numbers)))
    elif what == "steps":
        print(milliseconds_on_top(where))
    else:
        print(milliseconds_a_frame(where))
