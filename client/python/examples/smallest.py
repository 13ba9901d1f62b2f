"""The smallest useful client: prints how high the centre of each soft body is, frame by frame.

mkdir -p /tmp/messages
protoc -Iproto --python_out=/tmp/messages proto/pneuma/v1/*.proto
PYTHONPATH=/tmp/messages python3 client/python/examples/smallest.py 127.0.0.1:7420 five-balls

It needs protobuf, and protoc for the messages. PNEUMA_TOKEN is said if it is set. A third argument: certificates, TLS.
"""

import os
import socket
import ssl
import struct
import sys

from pneuma.v1.session_pb2 import ClientMessage, Hello, Pong, ServerMessage, Subscribe

if not 3 <= len(sys.argv) <= 4:
    sys.exit(f"usage: {sys.argv[0]} HOST:PORT WORLD [CERTIFICATES]")
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
    if kind in ("error", "goodbye"):
        sys.exit(f"refused: {message}")
    return kind, getattr(message, kind)


send(hello=Hello(protocol_version=1, token=os.environ.get("PNEUMA_TOKEN", "")))
send(subscribe=Subscribe(world=world, rate_hz=10, encoding=Subscribe.PLAIN))
vertices, layout, frames = {}, None, 0
while frames < 20:
    kind, message = receive()
    if kind == "topology":
        vertices[message.hash] = message.vertex_count
    elif kind == "layout":
        layout = message
    elif kind == "frame":
        # x y z of each vertex, one body after the other.
        points = list(struct.iter_unpack("<3f", message.payload))
        for body in layout.soft_bodies:
            own, points = points[: vertices[body.topology_hash]], points[vertices[body.topology_hash] :]
            print(f"tick {message.tick}  {body.name}  {sum(y for _, y, _ in own) / len(own):.3f} m")
        frames += 1
    elif kind == "ping":
        send(pong=Pong(nonce=message.nonce))
