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
NO_HISTORY = (REST,) * 4
NO_WEIGHTS = (0,) * 9
STEADY = (128,) + (0,) * 8
FULL = (80, -28, 9, 3, 164, -52, 31, -17, 40)
WEIGHTS_LEVEL = 44


def s32(value):
    return (value + 2**31) % 2**32 - 2**31


# --- Order of the vertices


class Level:
    def __init__(self, members, lists):
        self.members, self.lists, self.colours = list(members), lists, {}
        for r in self.members:
            taken = {self.colours.get(n) for n in lists[r]}
            self.colours[r] = min([c for c in range(7) if c not in taken] + [7])

    def coarser(self):
        lists = [[] for _ in self.lists]
        for r in self.members:
            for between in self.lists[r][:16] if self.colours[r] == 0 else []:
                for far in self.lists[between][:16]:
                    if self.colours[far] == 0 and far != r and far not in lists[r] and len(lists[r]) < 16:
                        lists[r].append(far)
        return Level([r for r in self.members if self.colours[r] == 0], lists)


class Order:
    def __init__(self, vertex_count, indices):
        faces = [indices[i:i + 3] for i in range(0, len(indices), 3)]
        near = [set() for _ in range(vertex_count)]
        for face in faces:
            for corner in face:
                near[corner] |= set(face)
        rings = [sorted(near[v] - {v}) for v in range(vertex_count)]
        ranked, seen = [], set()
        for start in range(vertex_count):
            queue = [] if start in seen else [start]
            seen |= set(queue)
            while queue:
                vertex = queue.pop(0)
                ranked.append(vertex)
                found = [n for n in rings[vertex] if n not in seen]
                seen |= set(found)
                queue += found
        rank = {v: r for r, v in enumerate(ranked)}
        levels = [Level(range(vertex_count), [sorted(rank[n] for n in rings[v]) for v in ranked])]
        while any(levels[-1].lists) and len(levels) < 12:
            levels.append(levels[-1].coarser())
        slots, lists = [], []
        for i, level in reversed(list(enumerate(levels))):
            for colour in range(0 if level is levels[-1] else 1, 8):
                for r in level.members:
                    if level.colours[r] == colour:
                        slots.append(r)
                        lists.append(level.lists[r])
        slot = {r: s for s, r in enumerate(slots)}
        self.vertices = [ranked[r] for r in slots]
        self.parents = [[slot[n] for n in near if slot[n] < s][:6] for s, near in enumerate(lists)]
        self.rings = [[slot[n] for n in levels[0].lists[r]] for r in slots]

    def __len__(self):
        return len(self.vertices)


# --- Residuals

with open(os.path.join(HERE, "../../proto/WIRE.md"), encoding="utf-8") as wire:
    RATIOS = [int(n) for n in re.search(r"<!-- ratios -->(.*?)<!-- end -->", wire.read(), re.S)[1].replace("`", "").replace(",", " ").split()]
assert len(RATIOS) == 16


def make_table(ratio):
    weights = [2**32]
    for _ in range(32):
        weights.append(weights[-1] * ratio >> 16)
    total = weights[0] + 2 * sum(weights[1:])
    frequency = {u: 1024 * weights[abs(u)] // total for u in range(-31, 32)}
    frequency[32] = 1 + 1024 * 2 * weights[32] // total
    frequency[0] = 1024 - sum(f for u, f in frequency.items() if u != 0)
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


class Text:
    """Steps of the three states: begin and length of a range, bits of the whole range, low bits."""

    def __init__(self):
        self.steps = []

    def plain(self, state, value, bits):
        self.steps.append((state, value, 1, bits, 0))

    def put(self, state, table, extra, number):
        ranges = TABLES[table]
        raised = number + (2**extra >> 1)
        low_bits = min(extra, 6)
        if extra > 6:
            self.plain(state, (raised & 2**extra - 1) >> 6, extra - 6)
        top = s32(raised) >> extra
        escapes = abs(top) > 31 or ranges[top][1] == 0
        begin, length = ranges[32 if escapes else top]
        self.steps.append((state, (begin << low_bits) + (raised & 2**low_bits - 1), length, 10 + low_bits, low_bits))
        if escapes:
            code = 2 * number if number >= 0 else -2 * number - 1
            bits = max(code.bit_length(), 1)
            self.escape(state, bits, code)

    def escape(self, state, bits, code):
        self.plain(state, bits, 6)
        if bits > 16:
            self.plain(state, code >> 16, bits - 16)
        self.plain(state, code & 2**min(bits, 16) - 1, min(bits, 16))

    def triple(self, level, numbers):
        extra = 0 if level < 32 else level // 4 - 7
        table = level // 2 - 2 * extra
        for state, number in enumerate(numbers):
            self.put(state, table if state == 0 else max(table - 2, 0), extra, number)

    def weights(self, weights):
        for i in (0, 3, 6):
            self.triple(WEIGHTS_LEVEL, weights[i:i + 3])

    def finish(self, end_states=(2**16,) * 3):
        if not self.steps:
            return b""
        states, words = list(end_states), []
        for which, begin, length, bits, low_bits in reversed(self.steps):
            state = states[which]
            if state >= length << 32 - bits:
                words.append(state & 0xffff)
                state >>= 16
            states[which] = ((state // length) << bits) + ((state % length) << low_bits) + begin
        return struct.pack("<3I", *states) + struct.pack(f"<{len(words)}H", *reversed(words))


# --- Prediction


def ring_sums(order, field):
    return [[sum(field[t][k] - field[s][k] for t in order.rings[s]) for k in range(3)] for s in range(len(order))]


def drift_of(order, moves, weights):
    a, b, c = weights[:4], weights[4:8], weights[8]
    last = ring_sums(order, moves[0])
    field = [[sum(b[i] * moves[i][s][k] for i in range(4)) + c * last[s][k] for k in range(3)]
             for s in range(len(order))]
    around = ring_sums(order, field)
    return [[s32(8 * sum(a[i] * moves[i][s][k] for i in range(4)) + around[s][k] + 32) >> 6 for k in range(3)]
            for s in range(len(order))]


def put_moves(text, order, level, moves, drift):
    errors, sizes = [], []
    for s, move in enumerate(moves):
        parents = order.parents[s]
        count = max(len(parents), 1)
        p = [s32(drift[s][k] + s32(sum(errors[q][k] for q in parents)) // count) for k in range(3)]
        parity = move[0] & 1
        x = s32(move[0] - (s32(p[0] + 8) >> 4))
        y, z = (s32((move[k] - parity >> 1) - (s32(p[k] - 16 * parity + 16) >> 5)) for k in (1, 2))
        size = 4 * (sum(sizes[q] for q in parents) // count)
        text.triple(min(level_of(size + size_of(level)), 91), (x, y, z))
        errors.append([s32(16 * move[k] - drift[s][k]) for k in range(3)])
        sizes.append(min(4 * (abs(x) + 2 * abs(y) + 2 * abs(z)), 2**24))


# --- Frames


class Body:
    def __init__(self, order, points):
        self.order = order
        self.rest(points)

    def advance(self, points):
        move = [[s32(a - b) for a, b in zip(p, q)] for p, q in zip(points, self.points)]
        self.points, self.moves = points, [move] + self.moves[:3]

    def rest(self, points):
        self.points, self.moves, self.weights = points, [self.nothing()] * 4, NO_WEIGHTS

    def nothing(self):
        return [[0, 0, 0]] * len(self.order)

    def key(self, text, level, history=NO_HISTORY, plain=False):
        text.weights(self.weights)
        if plain:
            flat = [c for p in self.points for c in p]
            head = b"\x01" + struct.pack(f"<{len(flat)}q", *flat)
        else:
            anchor = self.points[0]
            head = b"\x02" + struct.pack("<3q", *anchor) + bytes([level])
            put_moves(text, self.order, level, [[a - b for a, b in zip(p, anchor)] for p in self.points],
                      self.nothing())
        for k, its_level in enumerate(history):
            expected = [[s32(16 * c) for c in move] for move in self.moves[k - 1]] if k > 0 else self.nothing()
            if its_level != REST:
                put_moves(text, self.order, its_level, self.moves[k], expected)
        return head + bytes(history)

    def moved(self, text, points, level, weights=None):
        if weights is not None:
            self.weights = weights
            text.weights(weights)
        drift = drift_of(self.order, self.moves, self.weights)
        self.advance(points)
        put_moves(text, self.order, level, self.moves[0], drift)
        return bytes([4 if weights is None else 3, level])

    def still(self):
        self.advance(self.points)
        return b"\x00"

    def in_vertex_order(self):
        placed = dict(zip(self.order.vertices, self.points))
        return [c for v in range(len(self.order)) for c in placed[v]]


def check_of(bodies):
    """Of the points of all bodies, by slot."""
    total = 0
    for body in bodies:
        x = y = z = 0
        for point in body.points:
            x, y, z = ((16777619 * s + c % 2**32 + 3 * (c + 2**31 >> 32)) % 2**32 for s, c in zip((x, y, z), point))
        total = (16777619 * total + 16777619 * (16777619 * x + y) + z) % 2**32
    return ((total ^ total >> 15) * 2654435761 % 2**32) >> 18


def frame(heads, text):
    return b"\x05" + b"".join(heads) + text.finish()


TETRAHEDRON = (4, [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3])
SHEET = (20, [v for r in range(4) for c in range(3) for a in [4 * r + c]
              for v in (a, a + 4, a + 1, a + 1, a + 4, a + 5)])
FAN = (24, [v for i in range(1, 23) for v in (0, i, i + 1)])  # a vertex of more neighbours than are looked at
BROKEN = (7, [0, 1, 2, 2, 2, 5, 0, 1, 3, 0, 1, 5, 5, 5, 5])  # an edge of three faces, repeated corners, loose vertices


def strip(vertex_count):
    return vertex_count, [v for i in range(vertex_count - 2) for v in (i, i + 1, i + 2)]


def split(vertex_count, indices):
    """Each face in four, with a vertex in the middle of each edge."""
    middles, faces = {}, []

    def middle(a, b):
        return middles.setdefault((min(a, b), max(a, b)), vertex_count + len(middles))

    for i in range(0, len(indices), 3):
        a, b, c = indices[i:i + 3]
        ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
        faces += [a, ab, ca, b, bc, ab, c, ca, bc, ab, bc, ca]
    return vertex_count + len(middles), faces


BALL = split(*split(*TETRAHEDRON))


def torus(rows, columns, stride):
    """A closed mesh whose vertices are named anyhow: not as they lie, and not as they are ranked."""
    count = rows * columns

    def name(r, c):
        return (stride * (columns * (r % rows) + c % columns) + 77) % count

    quads = [[name(r, c), name(r, c + 1), name(r + 1, c + 1), name(r + 1, c)] for r in range(rows) for c in range(columns)]
    return count, [v for a, b, c, d in quads for v in (a, b, c, a, c, d)]


def anything(count, end):
    """Numbers below `end`, the same in every run."""
    state, numbers = 12345, []
    for _ in range(count):
        state = (1103515245 * state + 12345) % 2**31
        numbers.append((state >> 8) % end)
    return numbers


def crowd(vertex_count, face_count):
    """Faces of any three vertices, some of one twice: more neighbours, colours and parents than are looked at."""
    return vertex_count, anything(3 * face_count, vertex_count)


def hubs(hub_count, leaf_count, edge_count):
    """Leaves that are near hubs alone, each several: the next level has all leaves, and each near most others."""
    ends = zip(anything(edge_count, hub_count), anything(2 * edge_count, leaf_count)[edge_count:])
    return hub_count + leaf_count, [v for hub, leaf in ends for v in (leaf, hub + leaf_count, leaf)]


def cliques(size):
    """Two, of vertices that are all near each other: the second one's colours come again after the first one's."""
    pairs = [(first + a, first + b) for first in (0, size) for a in range(size) for b in range(a)]
    return 2 * size, [v for a, b in pairs for v in (a, a, b)]


def late_neighbour():
    """Of vertex 6, which has 18 neighbours, the last one alone leads to vertex 5; that comes earlier in the order."""
    edges = [(0, 1), (0, 2), (0, 3), (1, 4), (2, 5), (3, 6), (5, 23), (6, 23)]
    edges += [(end, between) for end in (4, 6) for between in range(7, 23)]
    return 24, [v for a, b in edges for v in (a, a, b)]


def path(vertex_count):
    return vertex_count, [v for i in range(vertex_count - 1) for v in (i, i, i + 1)]


TORUS = torus(15, 20, 77)


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


def write_stream(out, name, meshes, script, with_points=True):
    """script(bodies) yields (kind, payload, is good)."""
    out.write(f"\nstream {name}\n")
    orders = [Order(*mesh) for mesh in meshes]
    for vertex_count, indices in meshes:
        is_path = vertex_count > 1000 and (vertex_count, indices) == path(vertex_count)
        out.write(row("path", [vertex_count]) if is_path else row("mesh", [vertex_count] + indices))
    bodies = [Body(order, wave(len(order), 400, i)) for i, order in enumerate(orders)]
    for kind, payload, good in script(bodies):
        out.write(f"{'' if good else 'bad-'}{kind} {payload.hex()}".rstrip() + "\n")
        for body in bodies if good and with_points else []:
            out.write(row("points", body.in_vertex_order()))
        if good:
            out.write(row("check", [check_of(bodies)]))


def row(key, values):
    return f"{key} {' '.join(map(str, values))}".rstrip() + "\n"


def key_of(bodies, level=30, history=NO_HISTORY, plain=False):
    text = Text()
    return frame([b.key(text, level, history, plain) for b in bodies], text)


def one_vertex(bodies):
    yield "key", key_of(bodies, 0), True
    text = Text()
    yield "delta", frame([bodies[0].moved(text, [[-1, 3, -5]], 4, STEADY)], text), True
    yield "delta", frame([bodies[0].still()], Text()), True


def every_way(bodies):
    yield "key", key_of(bodies), True
    ways = (STEADY, None, (256, -128, 0, 0, 0, 0, 0, 0, 0), FULL, None, None,
            (-8192, 8191, -5000, 3, -8192, 8191, 70, -8192, 8191), (0, 0, 0, 0, 0, 0, 0, 0, -300),
            (2**31 - 1, -2**31, 70000, 0, 2**31 - 1, -2**31, -70000, 1, -2**31), None)
    for i, weights in enumerate(ways):
        text = Text()
        points = [plus(b.points, plus(b.moves[0], wave(len(b.order), 3, i))) for b in bodies]
        yield "delta", frame([b.moved(text, p, 14, weights) for b, p in zip(bodies, points)], text), True
    yield "key", key_of(bodies, 28, (20, 9, 12, 30)), True
    text = Text()
    yield "delta", frame([b.moved(text, plus(b.points, b.moves[0]), 0, STEADY) for b in bodies], text), True
    text = Text()
    yield "delta", frame([b.moved(text, plus(b.points, b.moves[1]), 3) for b in bodies], text), True
    yield "key", key_of(bodies, 28, (14, 9, 12, 10)), True
    text = Text()
    yield "delta", frame([b.moved(text, plus(b.points, b.moves[3]), 12) for b in bodies], text), True


def delta_of(bodies, amplitude, phase, level, weights=None):
    text = Text()
    points = [plus(b.points, plus(b.moves[0], wave(len(b.order), amplitude, phase + i))) for i, b in enumerate(bodies)]
    return frame([b.moved(text, p, level, weights) for b, p in zip(bodies, points)], text)


def long_memory(bodies):
    """Each move before counts, also past a key frame and a frame in which nothing moved."""
    yield "key", key_of(bodies), True
    for i in range(4):
        yield "delta", delta_of(bodies, 3, i, 14, FULL), True
    yield "key", key_of(bodies, 28, (14, 12, 12, 30)), True
    yield "delta", delta_of(bodies, 3, 4, 14), True
    yield "delta", frame([b.still() for b in bodies], Text()), True
    yield "delta", delta_of(bodies, 3, 5, 14), True


def crowded(bodies):
    yield "key", key_of(bodies), True
    for i in range(2):
        yield "delta", delta_of(bodies, 9, i, 18, FULL), True


def far_moves(bodies):
    """Errors whose sums wrap around, and sizes past the largest."""
    yield "key", key_of(bodies), True
    for i in range(2):
        text = Text()
        points = [plus(b.points, [[2**26 + c for c in m] for m in wave(len(b.order), 2**20, i)]) for b in bodies]
        yield "delta", frame([b.moved(text, p, 91, FULL) for b, p in zip(bodies, points)], text), True
    text = Text()
    moves = [[[c << 4 * (s % 7) for c in m] for s, m in enumerate(wave(len(b.order), 3, 2))] for b in bodies]
    moves = [[[c - (c - m[0]) % 2 for c in m] for m in own] for own in moves]  # all odd or all even
    yield "delta", frame([b.moved(text, plus(b.points, m), 20, STEADY) for b, m in zip(bodies, moves)], text), True


def coarse_to_fine(bodies):
    yield "key", key_of(bodies, 12), True
    yield "delta", delta_of(bodies, 1, 1, 6, STEADY), True


def every_level(bodies):
    for level in range(0, 92, 7):
        yield "key", key_of(bodies, level), True
    for level in range(3, 92, 8):
        text = Text()
        points = plus(bodies[0].points, wave(len(bodies[0].order), 2 ** (level // 4)))
        yield "delta", frame([bodies[0].moved(text, points, level, (64, 0, 0, 0, 32, 0, 0, 0, 0))], text), True


def rest_and_leaps(bodies):
    yield "key", key_of(bodies), True
    text = Text()
    leap = bodies[0]
    leap.rest(wave(len(leap.order), 2**20))
    heads = [leap.key(text, 60), bodies[1].still()]
    heads.append(bodies[2].moved(text, plus(bodies[2].points, wave(20, 30, 1)), 18, STEADY))
    yield "delta", frame(heads, text), True
    for _ in range(2):
        yield "delta", frame([b.still() for b in bodies], Text()), True
    bodies[0].rest([[2**43, -2**43, 2**42], [-2**43, 0, 0], [2**41, 2, 2], [2, 2, 2]])
    text = Text()
    heads = [bodies[0].key(text, 0, plain=True), bodies[1].still(), bodies[2].still()]
    yield "delta", frame(heads, text), True
    text = Text()
    heads = [bodies[0].moved(text, plus(bodies[0].points, [[1, -1, 1]] * 4), 6, STEADY),
             bodies[1].still(), bodies[2].still()]
    yield "delta", frame(heads, text), True
    yield "key", key_of(bodies, 30, (12, 14, 0, 60), plain=True), True


def escaped_by(lengths):
    """A delta of one vertex whose x, y and z escape, with these lengths of their codes."""
    text = Text()
    for state, bits in enumerate(lengths):
        begin, length = TABLES[0][32]
        text.steps.append((state, begin, length, 10, 0))
        if 0 < bits <= 32:
            text.escape(state, bits, 2 ** (bits - 1))
        else:
            text.plain(state, bits, 6)
    return text


def refused(bodies):
    good = key_of(bodies, 30)
    yield "key", good, True
    yield "key", b"", False
    yield "key", b"\x04" + good[1:], False
    yield "key", good[:-1], False
    yield "key", good[:-2], False
    yield "key", good + b"\x00", False
    yield "key", good + b"\x00\x00", False
    yield "key", good[:20], False
    yield "key", b"\x05\x00", False
    yield "delta", b"\x05", False
    yield "delta", b"\x05\x05", False
    yield "delta", b"\x05\x04\x5c" + good[-16:], False
    yield "delta", b"\x05\x04\x00", False
    yield "delta", b"\x05\x04\x00\x00", False
    yield "delta", b"\x05\x00\x00", False
    for at in range(3):
        states = [2**16] * 3
        states[at] -= 1
        yield "delta", b"\x05\x04\x00" + struct.pack("<3I", *states), False
    for at in range(3):
        for bits in (0, 33, 63):
            lengths = [6] * 3
            lengths[at] = bits
            yield "delta", b"\x05\x04\x00" + escaped_by(lengths).finish(), False
    for at in range(3):
        states = [2**16] * 3
        states[at] += 1
        yield "delta", b"\x05\x04\x00" + escaped_by([6, 6, 6]).finish(states), False
    # An escape of 33 bits, all of them there.
    text = escaped_by([6, 6, 33])
    text.plain(2, 2**16, 17)
    text.plain(2, 0, 16)
    yield "delta", b"\x05\x04\x00" + text.finish(), False
    # States below 2^16 at the start that come back to 2^16 all the same.
    begin, _ = TABLES[0][0]
    yield "delta", b"\x05\x04\x00" + struct.pack("<3I3H", *[begin + 1] * 3, 0, 0, 0), False
    # A level of 255 or 92, which is none of these, over a text as of the highest.
    text = Text()
    text.triple(91, (5, 6, 7))
    yield "delta", b"\x05\x04\xff" + text.finish(), False
    yield "delta", b"\x05\x04\xff", False
    text = Text()
    text.weights(NO_WEIGHTS)
    text.triple(91, (0, 0, 0))
    yield "key", good[:26] + b"\xff" + good[27:31] + text.finish(), False
    text = Text()
    text.weights(NO_WEIGHTS)
    text.triple(level_of(size_of(30)), (0, 0, 0))
    text.triple(91, (5, 6, 7))
    yield "key", good[:27] + b"\x5c" + good[28:31] + text.finish(), False
    # Blocks that build on a base, in a key frame.
    yield "key", b"\x05\x00", False
    text = Text()
    text.triple(0, (1, 1, 1))
    yield "key", b"\x05\x04\x00" + text.finish(), False
    yield "delta", b"\x05\x00", True
    text = escaped_by([32, 17, 1])
    bodies[0].advance([[2**30 + bodies[0].points[0][0], 2**16 + bodies[0].points[0][1], bodies[0].points[0][2] - 2]])
    yield "delta", b"\x05\x04\x00" + text.finish(), True


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
        write_stream(out, "every way to predict", [TETRAHEDRON, SHEET, BROKEN, FAN, BALL], every_way)
        write_stream(out, "strips, as the fuzzer has them", [strip(40), strip(7), strip(3)], every_way)
        write_stream(out, "every level", [SHEET], every_level)
        write_stream(out, "rest, leaps and points far out", [TETRAHEDRON, BROKEN, SHEET], rest_and_leaps)
        write_stream(out, "refused", [(1, [])], refused)
        write_stream(out, "a torus of 300 vertices", [TORUS], long_memory)
        write_stream(out, "more near each other than is looked at", [crowd(60, 300), cliques(12), hubs(30, 40, 500),
                      late_neighbour()], crowded)
        write_stream(out, "moves past what sums hold", [SHEET, FAN], far_moves)
        write_stream(out, "more levels than there are", [path(4097)], coarse_to_fine, with_points=False)
    with open(os.path.join(HERE, "topologies.txt"), "w", encoding="ascii") as out:
        out.write("# Topologies and their hashes; see README.md. Made by make_frames.py.\n")
        for name, vertices, indices in TOPOLOGIES:
            digest = hashlib.sha256(struct.pack(f"<{1 + len(indices)}I", vertices, *indices)).hexdigest()[:32]
            out.write(f"\ntopology {name}\nvertices {vertices}\n{row('indices', indices).rstrip()}\nhash {digest}\n")


if __name__ == "__main__":
    main()
