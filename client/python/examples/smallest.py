"""The smallest useful client: prints how high the centre of each soft body is, frame by frame.

protoc -Iproto --python_out=/tmp/messages proto/pneuma/v1/*.proto
PYTHONPATH=/tmp/messages python3 client/python/examples/smallest.py 127.0.0.1:7420 five-balls

It needs nothing but protobuf. PNEUMA_TOKEN is said where it is set; a third argument is a file of certificates, for TLS.
"""

import os
import socket
import ssl
import struct
import sys

from pneuma.v1.session_pb2 import ClientMessage, Hello, Pong, ServerMessage, Subscribe

address, world, *ca = sys.argv[1:]
host, port = address.rsplit(":", 1)
connection = socket.create_connection((host, int(port)))
if ca:
    connection = ssl.create_default_context(cafile=ca[0]).wrap_socket(connection, server_hostname=host)
incoming = connection.makefile("rb")


def send(**request):
    """A message goes behind its length, 4 bytes, big-endian. Each request has an id of our choice, not 0."""
    data = ClientMessage(request_id=1, **request).SerializeToString()
    connection.sendall(struct.pack(">I", len(data)) + data)


def receive():
    (length,) = struct.unpack(">I", incoming.read(4))
    message = ServerMessage.FromString(incoming.read(length))
    kind = message.WhichOneof("message")
    if kind == "error" or kind == "goodbye":
        sys.exit(f"refused: {message}")
    return kind, message


send(hello=Hello(protocol_version=1, token=os.environ.get("PNEUMA_TOKEN", "")))
send(subscribe=Subscribe(world=world, rate_hz=10, encoding=Subscribe.PLAIN))
vertices, layout, frames = {}, None, 0
while frames < 20:
    kind, message = receive()
    if kind == "topology":
        vertices[message.topology.hash] = message.topology.vertex_count
    elif kind == "layout":
        layout = message.layout
    elif kind == "frame":
        # x y z of each vertex, of one body after the other.
        numbers, begin, frames = struct.unpack(f"<{len(message.frame.payload) // 4}f", message.frame.payload), 0, frames + 1
        for body in layout.soft_bodies:
            end = begin + 3 * vertices[body.topology_hash]
            heights, begin = numbers[begin + 1 : end : 3], end
            print(f"tick {message.frame.tick}  {body.name}  {sum(heights) / len(heights):.3f} m")
    elif kind == "ping":
        send(pong=Pong(nonce=message.ping.nonce))
