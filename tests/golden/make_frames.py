#!/usr/bin/env python3
"""Writes frames.txt and topologies.txt: golden vectors made from proto/WIRE.md alone, by no code of the product.

The modes, levels and weights of each block are given by hand, so that the vectors cover what the format allows, not
what one encoder chooses.
"""
import hashlib
import os
import re
import struct

HERE = os.path.dirname(os.path.abspath(__file__))
REST = 255
STEADY = (32, 0, 0, 0)


def s32(value):
    return (value + 2**31) % 2**32 - 2**31


# --- Order of the vertices


class Order:
    def __init__(self, vertex_count, indices):
        faces = [indices[i:i + 3] for i in range(0, len(indices), 3)]
        at = [[f for f, face in enumerate(faces) for corner in face if corner == v] for v in range(vertex_count)]
        rings = [sorted({c for f in at[v] for c in faces[f]} - {v}) for v in range(vertex_count)]
        self.vertices = []
        for start in range(vertex_count):
            queue = [] if start in self.vertices else [start]
            while queue:
                vertex = queue.pop(0)
                self.vertices.append(vertex)
                queue += [n for n in rings[vertex] if n not in self.vertices and n not in queue]
        slot = {v: s for s, v in enumerate(self.vertices)}
        self.rings = [[slot[n] for n in rings[v]] for v in self.vertices]
        self.parents = []
        self.parallelograms = []  # lists of (a, b, c)
        for s, v in enumerate(self.vertices):
            earlier = sorted((n for n in self.rings[s] if n < s), reverse=True)
            self.parents.append([earlier[i % min(len(earlier), 4)] for i in range(4)] if earlier else [])
            found = []
            for f in at[v]:
                corner = faces[f].index(v)
                a, b = faces[f][(corner + 1) % 3], faces[f][(corner + 2) % 3]
                if len(found) == 2 or slot[a] >= s or slot[b] >= s:
                    continue
                near = at[b] if len(at[b]) < len(at[a]) else at[a]
                third = [c for g in near[:32] if a in faces[g] and b in faces[g]
                         for c in faces[g] if c not in (a, b) and slot[c] < s]
                if third:
                    found.append((slot[a], slot[b], slot[third[0]]))
            self.parallelograms.append(found * 2 if len(found) == 1 else found)

    def __len__(self):
        return len(self.vertices)


# --- Residuals

with open(os.path.join(HERE, "../../proto/WIRE.md"), encoding="utf-8") as wire:
    RATIOS = [int(n) for n in re.search(r"<!-- ratios -->(.*?)<!-- end -->", wire.read(), re.S)[1].replace("`", "").replace(",", " ").split()]
assert len(RATIOS) == 32


def make_table(ratio):
    weights, power = [], 65536
    for _ in range(33):
        weights.append((power << 32) // (65536 + power) ** 2)
        power = power * ratio >> 16
    total = weights[0] + 2 * sum(weights[1:])
    frequency = {u: 2048 * weights[abs(u)] // total for u in range(-31, 32)}
    frequency[32] = 1 + 2048 * 2 * weights[32] // total
    frequency[0] = 2048 - sum(f for u, f in frequency.items() if u != 0)
    begin, ranges = 0, {}
    for u in range(-31, 33):
        ranges[u] = (begin, frequency[u])
        begin += frequency[u]
    return ranges


TABLES = [make_table(r) for r in RATIOS]


def level_of(size):
    octave = (size + 4).bit_length() - 3
    return 4 * octave + ((size + 4 >> octave) & 3)


def size_of(level):
    return ((4 + level % 4) << level // 4) - 4


class Steps:
    """A step: begin and length of its range, bits of the whole range, low bits."""

    def __init__(self):
        self.steps = []

    def plain(self, value, bits):
        self.steps.append((value, 1, bits, 0))

    def put(self, level, residual):
        extra = 0 if level < 32 else level // 4 - 7
        ranges = TABLES[level - 4 * extra]
        raised = residual + (2**extra >> 1)
        low_bits = min(extra, 5)
        if extra > 5:
            self.plain((raised & 2**extra - 1) >> 5, extra - 5)
        top = s32(raised) >> extra
        escapes = abs(top) > 31 or ranges[top][1] == 0
        begin, length = ranges[32 if escapes else top]
        self.steps.append(((begin << low_bits) + (raised & 2**low_bits - 1), length, 11 + low_bits, low_bits))
        if escapes:
            code = 2 * residual if residual >= 0 else -2 * residual - 1
            bits = max(code.bit_length(), 1)
            self.plain(bits, 6)
            if bits > 16:
                self.plain(code >> 16, bits - 16)
            self.plain(code & 2**min(bits, 16) - 1, min(bits, 16))

    def finish(self):
        if not self.steps:
            return b""
        states, words = [2**16, 2**16], []
        for i in reversed(range(len(self.steps))):
            begin, length, bits, low_bits = self.steps[i]
            state = states[i % 2]
            if state >= length << 32 - bits:
                words.append(state & 0xffff)
                state >>= 16
            states[i % 2] = ((state // length) << bits) + ((state % length) << low_bits) + begin
        return struct.pack("<2I", *states) + struct.pack(f"<{len(words)}H", *reversed(words))


# --- Prediction


def drift_of(order, move, before, weights):
    w1, w2, w3, w4 = weights
    drift = []
    for s in range(len(order)):
        one = []
        for k in range(3):
            field = lambda t: w3 * move[t][k] + w4 * before[t][k]
            one.append(8 * (w1 * move[s][k] + w2 * before[s][k]) + sum(field(t) - field(s) for t in order.rings[s]))
        drift.append(one)
    return drift


def put_moves(steps, order, neighbours, level, moves, drift):
    found, sizes = [], []
    for s in range(len(order)):
        predicted = list(drift[s])
        parents = order.parents[s]
        if neighbours == 2 and order.parallelograms[s]:
            (a, b, c), (d, e, f) = order.parallelograms[s]
            add = [s32(found[a][k] + found[b][k] + found[d][k] + found[e][k] - found[c][k] - found[f][k]) >> 1 for k in range(3)]
            around = sizes[a] + sizes[b] + sizes[d] + sizes[e]
        elif neighbours == 2:
            add = [s32(found[parents[0]][k] + found[parents[1]][k]) >> 1 if parents else 0 for k in range(3)]
            around = sizes[parents[0]] + sizes[parents[1]] if parents else 0
        else:
            add = [s32(sum(found[p][k] for p in parents)) >> 2 if neighbours == 1 else 0 for k in range(3)]
            around = sum(sizes[p] for p in parents)
        predicted = [s32(predicted[k] + add[k]) for k in range(3)]
        move, parity = moves[s], moves[s][0] & 1
        x = s32(move[0] - (s32(predicted[0] + 128) >> 8))
        y, z = (s32((move[k] - parity >> 1) - (s32(predicted[k] - 256 * parity + 256) >> 9)) for k in (1, 2))
        at = min(level_of(around + size_of(level)), 91)
        steps.put(at, x)
        steps.put(max(at - 4, 0), y)
        steps.put(max(at - 4, 0), z)
        found.append([s32(256 * move[k] - drift[s][k]) for k in range(3)])
        sizes.append(min(4 * (abs(x) + 2 * abs(y) + 2 * abs(z)), 2**24))


# --- Frames


class Body:
    def __init__(self, order, points):
        self.order = order
        zero = [[0, 0, 0]] * len(order)
        self.points, self.move, self.before = points, zero, zero

    def advance(self, points):
        self.before = self.move
        self.move = [[s32(a - b) for a, b in zip(p, q)] for p, q in zip(points, self.points)]
        self.points = points

    def rest(self, points):
        zero = [[0, 0, 0]] * len(self.order)
        self.points, self.move, self.before = points, zero, zero

    def key(self, steps, level, move_level, before_level, plain=False):
        nothing = [[0, 0, 0]] * len(self.order)
        flat = [c for p in self.points for c in p]
        if plain:
            head = b"\x01" + struct.pack(f"<{len(flat)}q", *flat)
        else:
            anchor = self.points[0]
            head = b"\x02" + struct.pack("<3q", *anchor) + bytes([level])
            put_moves(steps, self.order, 2, level, [[a - b for a, b in zip(p, anchor)] for p in self.points], nothing)
        if move_level != REST:
            put_moves(steps, self.order, 1, move_level, self.move, nothing)
        if before_level != REST:
            put_moves(steps, self.order, 1, before_level, self.before,
                      drift_of(self.order, self.move, self.move, STEADY))
        return head + bytes([move_level, before_level])

    def moved(self, steps, points, neighbours, level, weights):
        drift = drift_of(self.order, self.move, self.before, weights)
        self.advance(points)
        put_moves(steps, self.order, neighbours, level, self.move, drift)
        return bytes([3 + neighbours, level]) + struct.pack("4b", *weights)

    def still(self):
        self.advance(self.points)
        return b"\x00"

    def in_vertex_order(self):
        placed = dict(zip(self.order.vertices, self.points))
        return [c for v in range(len(self.order)) for c in placed[v]]


def frame(heads, steps):
    return b"\x03" + b"".join(heads) + steps.finish()


TETRAHEDRON = (4, [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3])
SHEET = (20, [v for r in range(4) for c in range(3) for a in [4 * r + c]
              for v in (a, a + 4, a + 1, a + 1, a + 4, a + 5)])
BROKEN = (7, [0, 1, 2, 2, 2, 5, 0, 1, 3, 0, 1, 5, 5, 5, 5])  # an edge of three faces, repeated corners, loose vertices


def wave(count, amplitude, phase=0):
    """Points of the grid, of either parity."""
    points = []
    for i in range(count):
        odd = (i + phase) % 2
        j = i + 7 * phase
        points.append([2 * (((j * j * (37 + k) + 11 * j * (k + 1)) % (2 * amplitude + 1)) - amplitude) + odd for k in range(3)])
    return points


def plus(points, moves):
    return [[a + b for a, b in zip(p, m)] for p, m in zip(points, moves)]


def write_stream(out, name, meshes, script):
    """script(bodies) yields (kind, payload, is good)."""
    out.write(f"\nstream {name}\n")
    orders = [Order(*mesh) for mesh in meshes]
    for vertex_count, indices in meshes:
        out.write(row("mesh", [vertex_count] + indices))
    bodies = [Body(order, wave(len(order), 400, i)) for i, order in enumerate(orders)]
    for kind, payload, good in script(bodies):
        out.write(f"{'' if good else 'bad-'}{kind} {payload.hex()}".rstrip() + "\n")
        for body in bodies if good else []:
            out.write(row("points", body.in_vertex_order()))


def row(key, values):
    return f"{key} {' '.join(map(str, values))}".rstrip() + "\n"


def key_of(bodies, level=30, move_level=REST, before_level=REST, plain=False):
    steps = Steps()
    return frame([b.key(steps, level, move_level, before_level, plain) for b in bodies], steps)


def one_vertex(bodies):
    yield "key", key_of(bodies, 0), True
    steps = Steps()
    yield "delta", frame([bodies[0].moved(steps, [[-1, 3, -5]], 1, 4, STEADY)], steps), True
    yield "delta", frame([bodies[0].still()], Steps()), True


def every_way(bodies):
    yield "key", key_of(bodies), True
    for neighbours in range(3):
        for weights in (STEADY, (64, -32, 0, 0), (20, -7, 41, -13), (-128, 127, -128, 127)):
            steps = Steps()
            points = [plus(b.points, plus(b.move, wave(len(b.order), 3, neighbours))) for b in bodies]
            heads = [b.moved(steps, p, neighbours, 14, weights) for b, p in zip(bodies, points)]
            yield "delta", frame(heads, steps), True
    yield "key", key_of(bodies, 28, 20, 9), True
    steps = Steps()
    heads = [b.moved(steps, plus(b.points, b.move), 1, 0, STEADY) for b in bodies]
    yield "delta", frame(heads, steps), True


def every_level(bodies):
    for level in range(0, 92, 7):
        yield "key", key_of(bodies, level), True
    for level in range(3, 92, 8):
        steps = Steps()
        points = plus(bodies[0].points, wave(len(bodies[0].order), 2 ** (level // 4)))
        yield "delta", frame([bodies[0].moved(steps, points, level % 3, level, (16, 0, 8, 0))], steps), True


def rest_and_leaps(bodies):
    yield "key", key_of(bodies), True
    steps = Steps()
    leap = bodies[0]
    leap.rest(wave(len(leap.order), 2**20))
    heads = [leap.key(steps, 60, REST, REST), bodies[1].still()]
    heads.append(bodies[2].moved(steps, plus(bodies[2].points, wave(20, 30, 1)), 2, 18, STEADY))
    yield "delta", frame(heads, steps), True
    yield "delta", frame([b.still() for b in bodies], Steps()), True
    bodies[0].rest([[2**43, -2**43, 2**42], [-2**43, 0, 0], [2**41, 2, 2], [2, 2, 2]])
    steps = Steps()
    heads = [bodies[0].key(steps, 0, REST, REST, plain=True), bodies[1].still(), bodies[2].still()]
    yield "delta", frame(heads, steps), True
    steps = Steps()
    heads = [bodies[0].moved(steps, plus(bodies[0].points, [[1, -1, 1]] * 4), 1, 6, STEADY),
             bodies[1].still(), bodies[2].still()]
    yield "delta", frame(heads, steps), True
    yield "key", key_of(bodies, 30, 12, 14, plain=True), True


def refused(bodies):
    good = key_of(bodies, 30)
    yield "key", good, True
    yield "key", b"", False
    yield "key", b"\x02" + good[1:], False
    yield "key", good[:-1], False
    yield "key", good[:-2], False
    yield "key", good + b"\x00", False
    yield "key", good + b"\x00\x00", False
    yield "key", good[:20], False
    yield "key", b"\x03\x00", False
    yield "delta", b"\x03", False
    yield "delta", b"\x03\x06", False
    yield "delta", b"\x03\x03\x5c\x00\x00\x00\x00" + good[-16:], False
    yield "delta", b"\x03\x03\x00\x00\x00\x00", False
    yield "delta", b"\x03\x03\x00\x00\x00\x00\x00", False
    yield "delta", b"\x03\x00\x00", False
    yield "delta", b"\x03\x03\x00\x00\x00\x00\x00" + struct.pack("<2I", 2**16 - 1, 2**16), False
    yield "delta", b"\x03\x00", True


TOPOLOGIES = [
    ("nothing", 0, []),
    ("one face", 3, [0, 1, 2]),
    ("one face of four vertices", 4, [0, 1, 2]),
    ("tetrahedron", 4, [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]),
    ("wide indices", 65536, [65535, 256, 1, 0, 65535, 4660]),
]


def main():
    with open(os.path.join(HERE, "frames.txt"), "w", encoding="ascii") as out:
        out.write("# Streams of frame payloads and what they mean; see README.md. Made by make_frames.py.\n")
        write_stream(out, "one vertex", [(1, [])], one_vertex)
        write_stream(out, "every way to predict", [TETRAHEDRON, SHEET, BROKEN], every_way)
        write_stream(out, "every level", [SHEET], every_level)
        write_stream(out, "rest, leaps and points far out", [TETRAHEDRON, BROKEN, SHEET], rest_and_leaps)
        write_stream(out, "refused", [TETRAHEDRON], refused)
    with open(os.path.join(HERE, "topologies.txt"), "w", encoding="ascii") as out:
        out.write("# Topologies and their hashes; see README.md. Made by make_frames.py.\n")
        for name, vertices, indices in TOPOLOGIES:
            digest = hashlib.sha256(struct.pack(f"<{1 + len(indices)}I", vertices, *indices)).hexdigest()[:32]
            out.write(f"\ntopology {name}\nvertices {vertices}\n{row('indices', indices).rstrip()}\nhash {digest}\n")


main()
