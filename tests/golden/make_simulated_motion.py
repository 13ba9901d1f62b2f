#!/usr/bin/env python3
"""Writes simulated_motion.txt, bodies that are simulated frame by frame, and simulated_frames.txt, streams of such
bodies: by plain numbers and none of the product's code.

What a frame shows is made up: the prediction, rounded to the grid, and a little more.
"""
import math
import os
import struct

import make_frames as frames
from make_frames import NO_HISTORY, Order, REST, STEADY, Text, check_of, frame, put_moves, row, s32

SHIFT = 1.5 * 2.0**52


def nearest(value):
    return int((value + SHIFT) - SHIFT)


def dot(a, b):
    return (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]


def times(factor, a):
    return [factor * c for c in a]


def plus(a, b):
    return [x + y for x, y in zip(a, b)]


def minus(a, b):
    return [x - y for x, y in zip(a, b)]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def power(base, exponent):
    result, root = 1.0, base
    for _ in range(exponent >> 16):
        result *= base
    bits = exponent & 0xFFFF
    while bits:
        root = math.sqrt(root)
        bits <<= 1
        if bits & 0x10000:
            result *= root
        bits &= 0xFFFF
    return result


def total(vectors):
    out = [0.0, 0.0, 0.0]
    for v in vectors:
        out = plus(out, v)
    return (out[0] + out[1]) + out[2]


class Body:
    def __init__(self, order, indices, m, step):
        self.order, self.m, self.step, self.S = order, m, step, float(m['substeps'])
        n = len(order.vertices)
        slot = {v: s for s, v in enumerate(order.vertices)}
        self.faces = [[slot[v] for v in indices[i:i + 3]] for i in range(0, len(indices), 3)]
        self.edges = [(s, o) for s in range(n) for o in order.rings[s] if o > s]
        h = m['frame_s'] / self.S
        hh = h * h
        self.damping = m['damping'] * h
        area = step * hh / 6.0
        self.pressure, self.outside = m['gas'][0] * area, m['gas'][3] * area
        self.six = 6.0 * m['gas'][1] / (step * step * step)
        self.gravity = [g * hh / step for g in m['gravity']]
        masses = m['masses'] * n if len(m['masses']) == 1 else m['masses']
        self.inverse = [1.0 / masses[v] if masses[v] > 0 else 0.0 for v in order.vertices]
        stiffnesses = m['stiffnesses'] * len(self.edges) if len(m['stiffnesses']) == 1 else m['stiffnesses']
        self.k = [k * hh for k in stiffnesses]
        self.rest = [k * (r / step) for k, r in zip(self.k, m['rest_lengths'])]

    def predict(self, points, velocities):
        S, n = self.S, len(points)
        x0 = [[float(c - a) for c, a in zip(p, points[0])] for p in points]
        d = [times(0.125 / S, v) for v in velocities]
        fall = math.sqrt(dot(self.gravity, self.gravity)) * S
        way = 2.0 * S * (math.sqrt(max(dot(v, v) for v in d)) + fall)
        planes = []
        for *normal, offset, restitution, friction in self.m['planes']:
            w = dot(normal, [float(c) for c in points[0]]) - offset / self.step

            def distance(p, normal=normal, w=w):
                return (normal[0] * p[0] + normal[1] * p[1]) + (normal[2] * p[2] + w)

            if min(distance(p) for p in x0) < way:
                planes.append((normal, distance, restitution, friction))
        lengths, inverses = [], []
        for a, b in self.edges:
            square = dot(minus(x0[a], x0[b]), minus(x0[a], x0[b]))
            lengths.append(math.sqrt(square))
            inverses.append(1.0 / lengths[-1] if square >= 2.0**-10 else 0.0)
        x = [plus(p, times(0.5, v)) for p, v in zip(x0, d)]
        for q in range(int(S)):
            pulls = []
            for e, (a, b) in enumerate(self.edges):
                square, last = dot(minus(x[a], x[b]), minus(x[a], x[b])), inverses[e]
                inverse = last * (1.5 - 0.5 * min(square * last * last, 2.0))
                length = square * inverse
                rate = (2.0 * self.damping if q == 0 else self.damping) * (length - lengths[e])
                pulls.append(self.k[e] - self.rest[e] * inverse + rate * inverse)
                lengths[e], inverses[e] = length, inverse
            if q % 2 == 0:
                middle = [plus(p, times(0.5, v)) for p, v in zip(x, d)]
                grad = [[0.0] * 3 for _ in x]
                for a, b, c in self.faces:
                    normal = cross(minus(middle[b], middle[a]), minus(middle[c], middle[a]))
                    for corner in (a, b, c):
                        grad[corner] = plus(grad[corner], normal)
                base = total([[g * p for g, p in zip(*gp)] for gp in zip(grad, middle)]) * (2.0 / 3.0)
            volume = total([[g * p for g, p in zip(*gp)] for gp in zip(grad, x)]) - base
            pressure = self.pressure * power(self.six / max(volume, self.six * 2.0**-6), self.m['gas'][2]) - self.outside
            named = {ends: pull for ends, pull in zip(self.edges, pulls)}
            nx = []
            for s in range(n):
                pulled, pull_sum = [0.0] * 3, 0.0
                for o in self.order.rings[s]:
                    pull = named[min(s, o), max(s, o)]
                    pulled, pull_sum = plus(pulled, times(pull, x[o])), pull_sum + pull
                force = plus(minus(pulled, times(pull_sum, x[s])), times(pressure, grad[s]))
                falls = 1.0 if self.inverse[s] > 0 else 0.0
                v = plus(d[s], plus(times(self.inverse[s], force), times(falls, self.gravity)))
                end = plus(x[s], times(0.5, v))
                for normal, distance, restitution, friction in planes:
                    below = distance(end)
                    if below >= 0.0:
                        continue
                    end = minus(end, times(below, normal))
                    inward = dot(normal, v)
                    if inward >= 0.0:
                        continue
                    along = minus(v, times(inward, normal))
                    bounce = -(1.0 + restitution) * inward
                    speed = math.sqrt(dot(along, along))
                    kept = 1.0 - friction * bounce / speed if friction * bounce < speed else 0.0
                    v = plus(times(kept, along), times(inward + bounce, normal))
                d[s] = v
                nx.append(plus(end, times(0.5, v)) if q + 1 < int(S) else end)
            x = nx
        self.moved = [minus(a, b) for a, b in zip(x, x0)]
        self.speeds = [times(S, v) for v in d]
        if all(abs(c) < 2.0**26 for v in self.moved + self.speeds for c in v):
            return [[nearest(16.0 * c) for c in v] for v in self.moved]
        self.moved = self.speeds = [times(0.125, v) for v in velocities]
        self.speeds = [times(S, times(0.125 / S, v)) for v in velocities]
        return [[2 * c for c in v] for v in velocities]

    def correct(self, moves):
        return [[nearest(min(max((s + 0.2 * (float(m) - p)) * 8.0, -2.0**29), 2.0**29)) for s, m, p in zip(*three)]
                for three in zip(self.speeds, moves, self.moved)]


def mechanics_text(m):
    text = line('frame_s', [m['frame_s']]) + line('substeps', [m['substeps']]) + line('masses_kg', m['masses'])
    text += line('rest_lengths_m', m['rest_lengths']) + line('stiffnesses_n_m', m['stiffnesses'])
    text += line('damping_n_s_m', [m['damping']]) + line('gas', m['gas']) + line('gravity_m_s2', m['gravity'])
    for plane in m['planes']:
        text += line('plane', plane)
    return text


def single(values):
    """As they are sent: in single precision."""
    return list(struct.unpack(f'<{len(values)}f', struct.pack(f'<{len(values)}f', *values)))


def line(name, numbers):
    return name + ' ' + ' '.join(repr(n) for n in numbers) + '\n'


def record(name, count, indices, mechanics, step, points, velocities, frames):
    order = Order(count, indices)
    body = Body(order, indices, mechanics, step)
    text = f'body {name}\n' + line('mesh', [count] + indices) + line('grid_step_m', [step])
    text += mechanics_text(mechanics)
    text += line('points', sum(points, [])) + line('velocities', sum(velocities, []))
    for frame in range(frames):
        drift = body.predict(points, velocities)
        moves = [[(c >> 4) + (7 * s + 3 * axis + frame) % 5 - 2 for axis, c in enumerate(v)] for s, v in enumerate(drift)]
        velocities = body.correct(moves)
        points = [[a + b for a, b in zip(p, m)] for p, m in zip(points, moves)]
        text += line('drift', sum(drift, [])) + line('moves', sum(moves, [])) + line('velocities', sum(velocities, []))
    return text


def bad_record(name, count, indices, mechanics, step):
    text = f'bad-body {name}\n' + line('mesh', [count] + indices) + line('grid_step_m', [step])
    return text + mechanics_text(mechanics)


class StreamBody(frames.Body):
    """A body of a stream; `mechanics` None: it is not simulated."""

    def __init__(self, order, indices, points, mechanics, step):
        self.simulation = Body(order, indices, mechanics, step) if mechanics else None
        super().__init__(order, points)

    def rest(self, points):
        super().rest(points)
        self.velocities = self.nothing()

    def advance(self, points):
        super().advance(points)
        self.velocities = [[8 * min(max(c, -2**26), 2**26) for c in m] for m in self.moves[0]]

    def key(self, text, level, history=NO_HISTORY, plain=False, velocities=REST):
        head = super().key(text, level, history, plain)
        if not self.simulation:
            return head
        if velocities != REST:
            put_moves(text, self.order, velocities, [[2 * c + s % 2 for c in v] for s, v in enumerate(self.velocities)],
                      [[s32(256 * c) for c in move] for move in self.moves[0]])
        return head + bytes([velocities])

    def simulated(self, text, noise, level, far=0):
        """`far`: by so many steps the slots are off, one in three this way and one the other."""
        drift = self.simulation.predict(self.points, self.velocities)
        points = []
        for s, (point, v) in enumerate(zip(self.points, drift)):
            x, y, z = (p + (c >> 4) + (7 * s + 3 * axis + noise) % 5 - 2 + far * (s % 3 - 1)
                       for axis, (p, c) in enumerate(zip(point, v)))
            points.append([x, y + (x + y) % 2, z - (x + z) % 2])  # all odd or all even
        self.advance(points)
        self.velocities = self.simulation.correct(self.moves[0])
        put_moves(text, self.order, level, self.moves[0], drift)
        return bytes([5, level])


def write_streams(octahedron, ball, hub, fan, torus):
    step = 0.00022

    def stream(name, meshes, mechanics, script, places=None):
        orders = [Order(*mesh) for mesh in meshes]
        bodies = [StreamBody(order, mesh[1], places(order) if places else frames.wave(len(order), 900, i), m, step)
                  for i, (order, mesh, m) in enumerate(zip(orders, meshes, mechanics))]
        text = f'\nstream {name}\n' + line('grid_step_m', [step])
        for (count, indices), m in zip(meshes, mechanics):
            text += row('mesh', [count] + indices) + (mechanics_text(m) if m else '')
        for kind, payload, good in script(bodies):
            text += f"{'' if good else 'bad-'}{kind} {payload.hex()}".rstrip() + '\n'
            for body in bodies if good else []:
                text += row('points', body.in_vertex_order())
            if good:
                text += row('check', [check_of(bodies)])
        return text

    def simulated(bodies, noise, level=20):
        text = Text()
        return 'delta', frame([body.simulated(text, noise + i, level) for i, body in enumerate(bodies)], text), True

    def key(bodies, history=NO_HISTORY, velocities=REST, plain=False):
        text = Text()
        return 'key', frame([body.key(text, 44, history, plain, velocities) for body in bodies], text), True

    def alone(bodies):
        yield key(bodies)
        for noise in range(4):
            yield simulated(bodies, noise, 24 - noise)
        yield key(bodies, (40, 20, 20, 36), 30)
        for noise in range(3):
            yield simulated(bodies, noise)
        yield key(bodies, (40, 20, 20, 36), 30, True)
        yield simulated(bodies, 5)

    def among_others(bodies):
        first, other, last = bodies
        yield key(bodies)
        moved = frames.plus
        for noise in range(3):
            text = Text()
            heads = [first.simulated(text, noise, 24), other.moved(text, moved(other.points, frames.wave(20, 9, noise)), 20, STEADY),
                     last.simulated(text, noise + 1, 22)]
            yield 'delta', frame(heads, text), True
        text = Text()
        heads = [first.moved(text, moved(first.points, first.moves[0]), 12, STEADY), other.still(), last.still()]
        yield 'delta', frame(heads, text), True
        text = Text()
        heads = [first.simulated(text, 1, 20), other.still(), last.simulated(text, 1, 24)]
        yield 'delta', frame(heads, text), True
        text = Text()
        heads = [first.moved(text, moved(first.points, first.moves[0]), 12), other.still(), last.moved(text, moved(last.points, last.moves[1]), 18, STEADY)]
        yield 'delta', frame(heads, text), True
        yield key(bodies, (40, 20, 20, 36))
        text = Text()
        first.rest(frames.wave(6, 2**20))
        heads = [first.key(text, 60), other.still(), last.simulated(text, 3, 20)]
        yield 'delta', frame(heads, text), True
        text = Text()
        heads = [first.simulated(text, 2, 24), other.still(), last.simulated(text, 2, 24)]
        good = frame(heads, text)
        yield 'delta', good, True
        yield 'delta', b'\x05\x05' + good[2:3] + b'\x05\x14' + good[4:], False  # of the body that is not simulated
        yield 'delta', b'\x05\x06' + good[2:], False
        yield 'delta', b'\x05\x05\x5c' + good[3:], False
        yield 'delta', good[:-2], False
        _, whole, _ = key(bodies)
        yield 'key', whole[:31] + b'\x5c' + whole[32:], False  # no such level, of the first body's velocities
        yield 'key', whole[:-4], False
        text = Text()
        yield 'delta', frame([first.simulated(text, 4, 24), other.still(), last.simulated(text, 4, 24)], text), True

    def ring_shaped(order):
        """The torus as it is: its vertices are named by 77 times their places, and 77 more."""
        points = []
        for vertex in order.vertices:
            row_of, column = divmod((vertex - 77) * pow(77, -1, 300) % 300, 20)
            along, around = math.tau * row_of / 15, math.tau * column / 20
            from_axis = 2000 + 900 * math.cos(around)
            points.append([2 * round(c) for c in (from_axis * math.cos(along), 900 * math.sin(around),
                                                  from_axis * math.sin(along))])
        return points

    def uneven(bodies):
        """Also where a key frame leaves out the velocities, as they follow from the moves."""
        yield key(bodies)
        for noise in range(3):
            yield simulated(bodies, noise, 20)
        yield key(bodies, (40, 20, 20, 36), 30)
        yield simulated(bodies, 3)
        text = Text()
        heads = [body.moved(text, frames.plus(body.points, body.moves[0]), 20, STEADY) for body in bodies]
        yield 'delta', frame(heads, text), True
        yield key(bodies, (40, 20, 20, 36))
        yield simulated(bodies, 4)

    def too_fast(bodies):
        """Moves and corrections past what velocities count."""
        body, = bodies
        yield key(bodies)
        far = [[2**27 * (s % 3 - 1) + c for c in m] for s, m in enumerate(frames.wave(len(body.order), 9))]
        text = Text()
        yield 'delta', frame([body.moved(text, frames.plus(body.points, far), 91, STEADY)], text), True
        yield simulated(bodies, 1, 91)
        text = Text()
        yield 'delta', frame([body.simulated(text, 2, 91, 2**28)], text), True
        yield simulated(bodies, 3, 91)

    def strips(bodies):
        first, other = bodies
        yield key(bodies)
        for noise in range(3):
            text = Text()
            yield 'delta', frame([first.simulated(text, noise, 24), other.still()], text), True
        yield key(bodies, (40, 20, 20, 36), 30)
        text = Text()
        yield 'delta', frame([first.simulated(text, 4, 20), other.still()], text), True

    text = stream('one simulated body', [(6, octahedron)], [ball], alone)
    text += stream('simulated bodies among others', [(6, octahedron), frames.SHEET, (9, hub)], [ball, None, fan], among_others)
    text += stream('a torus of 300 vertices and uneven masses', [frames.TORUS], [torus], uneven, ring_shaped)
    text += stream('a body that is too fast', [(6, octahedron)], [ball], too_fast)
    tetrahedron = dict(ball, masses=[0.5], rest_lengths=[0.25] * 6, stiffnesses=[1e9], substeps=64)
    text += stream('a body that leaves the numbers', [frames.TETRAHEDRON], [tetrahedron], alone)
    strip = dict(fan, masses=[0.25], rest_lengths=single([0.1] * 77))
    text += stream('strips, as the fuzzers have them', [frames.strip(40), frames.strip(7)], [strip, None], strips)
    with open(os.path.join(frames.HERE, 'simulated_frames.txt'), 'w') as out:
        out.write('# Streams of frame payloads with bodies that are simulated; see README.md. Made by make_simulated_motion.py.\n')
        out.write(text)


def main():
    octahedron = [0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5]
    corners = [[1, 0, 0], [-1, 0, 0], [0, 0, -1], [0, 0, 1], [0, 1, 0], [0, -1, 0]]
    order = Order(6, octahedron)
    step = 0.00022
    place = [[1700 * c + o for c, o in zip(corners[v], (40000, 1745, -9000))] for v in order.vertices]
    edges = 12
    ball = {'frame_s': 1.0 / 60.0, 'substeps': 5, 'masses': single([0.1, 0.12, 0.1, 0.15, 0.1, 0.1]),
            'rest_lengths': single([0.5 - 0.004 * e for e in range(edges)]),
            'stiffnesses': [300.0 + 11.0 * e for e in range(edges)],
            'damping': 0.08, 'gas': [110.0, 0.07, 91750, 20.0], 'gravity': [0.3, -9.81, 0.0],
            'planes': [[0.0, 1.0, 0.0, 0.0, 0.8, 0.3], [-0.6, 0.8, 0.0, -5.29, 0.1, 2.0]]}
    falling = [[60 + 9 * s, -900 + 40 * s, 25 * s] for s in range(6)]
    text = record('that bounces off planes', 6, octahedron, ball, step, place, falling, 14)

    hub = [i for k in range(1, 9) for i in (0, k, k % 8 + 1)]  # more neighbours than six, and a pinned vertex
    rim = [[0, 0, 0]] + [[round(900 * math.cos(k)), 30 * k, round(900 * math.sin(k))] for k in range(8)]
    fan = {'frame_s': 0.02, 'substeps': 4, 'masses': single([0.0] + [0.05] * 8), 'rest_lengths': single([0.2] * 16),
           'stiffnesses': [40.0], 'damping': 0.01, 'gas': [0.0, 1.0, 65536, 0.0], 'gravity': [0.0, -9.81, 0.0],
           'planes': []}
    order = Order(9, hub)
    text += '\n' + record('of an open mesh', 9, hub, fan, 0.0003, [rim[v] for v in order.vertices],
                          [[0, 8, 0] for _ in range(9)], 6)

    wild = dict(ball, stiffnesses=[1e9], substeps=64)
    text += '\n' + record('that leaves the numbers', 6, octahedron, wild, step, place, falling, 3)
    corners_at = place
    still = [[5, 5, 5]] * 3 + place[3:]
    text += '\n' + record('with edges of no length', 6, octahedron, ball, step, still, falling, 4)
    edges = 900
    torus = dict(ball, masses=single([0.002 + 0.00001 * (v * v % 97) for v in range(300)]),
                 rest_lengths=single([0.2 + 0.0005 * (e % 31) for e in range(edges)]),
                 stiffnesses=single([20.0 + 0.5 * (e % 23) for e in range(edges)]), damping=0.01,
                 gas=[2.0, 0.9, 91750, 0.5])

    # A vertex alone, on numbers that are halves and powers of two.
    dot = dict(fan, frame_s=1.0, substeps=1, masses=[1.0], rest_lengths=[], stiffnesses=[1.0], damping=0.0,
               gravity=[0.0, 0.0, 0.0])
    floor = [0.0, 1.0, 0.0, 0.0]
    place, still = [[0, 0, 0]], [[0, 0, 0]]
    text += '\n' + record('half-way between two numbers', 1, [], dict(dot, gravity=[0.0625, -0.0625, 0.1875]), 1.0, place,
                          [[8, 8, -8]], 4)
    deep = dict(dot, planes=[floor + [0.0, 0.0]])
    text += '\n' + record('that is put back from afar', 1, [], deep, 1.0, [[0, -2**27, 0]], [[8, 16, 24]], 3)
    flung = dict(dot, planes=[floor + [9.0, 0.0]])
    text += '\n' + record('that is flung off', 1, [], flung, 1.0, [[0, 5, 0]], [[8, -2**28, 24]], 3)
    corner = dict(dot, planes=[floor + [0.5, 0.1]] + [[-1.0, 0.0, 0.0, -1000.0 * k, 0.0, 0.0] for k in range(15)],
                  substeps=64, gas=[1.0, 2.0, 2**20, 0.5])
    text += '\n' + record('within every limit', 1, [], corner, 1.0, [[9, 9, 9]], [[-70, -800, 9]], 3)
    steep = dict(ball, gas=[110.0, 0.07, 2**20, 20.0])
    text += '\n' + record('of a gas of the largest exponent', 6, octahedron, steep, step, corners_at, falling, 3)
    for name, wrong in (('65 substeps', {'substeps': 65}), ('17 planes', {'planes': corner['planes'] + [floor + [0.0, 0.0]]}),
                        ('a gas of a larger exponent', {'gas': [1.0, 2.0, 2**20 + 1, 0.5]}),
                        ('a gas without volume', {'gas': [1.0, 0.0, 65536, 0.5]})):
        text += '\n' + bad_record('of ' + name, 1, [], dict(corner, **wrong), 1.0)
    leaning = dict(ball, planes=[[0.0, 1.0625, 0.0, 0.0, 0.8, 0.3]])
    text += '\n' + bad_record('off a plane whose normal is longer than 1', 6, octahedron, leaning, step)
    huge = dict(ball, frame_s=1e160)
    text += '\n' + bad_record('whose stiffness in steps is no number', 6, octahedron, huge, step)
    far = dict(ball, planes=[[0.0, 1.0, 0.0, 1e307, 0.8, 0.3]])
    text += '\n' + bad_record('off a plane further than numbers go', 6, octahedron, far, step)
    with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), 'simulated_motion.txt'), 'w') as out:
        out.write('# Bodies that are simulated frame by frame; see README.md. Made by make_simulated_motion.py.\n\n')
        out.write(text)
    write_streams(octahedron, ball, hub, fan, torus)


if __name__ == '__main__':
    main()
