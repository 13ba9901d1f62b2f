"""Soft bodies with gas inside: scripts and tests for a pneuma-server.

>>> import pneuma
>>> with pneuma.serve() as server:
...     world = server.world("bouncing-ball", paused=True)
...     world["ball"].kick((3, 0, 0))
...     world.step(60)["ball"].centre_of_mass

`pneuma.aio` is the same for asyncio.
"""

from importlib.metadata import version
from pkgutil import extend_path

from pneuma import aio
from pneuma._proto import session_pb2 as wire
from pneuma._proto.scene_types import (
    Anchor,
    Atmosphere,
    Collider,
    ColliderChange,
    Collision,
    Drag,
    Gas,
    Joint,
    LockedAxes,
    Mesh,
    RigidBody,
    RigidBodyChange,
    SceneChange,
    Shape,
    SoftBody,
    SoftBodyChange,
    Springs,
    Stepping,
    Surface,
    Volume,
)
from pneuma.client import Body, Grab, Recorder, Server, Stream, TouchStream, World, connect, serve
from pneuma.errors import Code, NotReached, PneumaError
from pneuma.frames import Contact, Event, Frame, FrameBody, Pose
from pneuma.mesh_files import read_mesh
from pneuma.recording import Change, RecordedBody, Recording, read
from pneuma.scene import Scene, triangles
from pneuma.state import RigidState, SoftState, State
from pneuma.surfaces import Surfaces
from pneuma.touch import Touch

# Others may have protoc's own pneuma.v1 on their path: it is found beside this package.
__path__ = extend_path(__path__, __name__)

__version__ = version("pneuma")

__all__ = [
    "Anchor",
    "Atmosphere",
    "Body",
    "Change",
    "Code",
    "Collider",
    "ColliderChange",
    "Collision",
    "Contact",
    "Drag",
    "Event",
    "Frame",
    "FrameBody",
    "Gas",
    "Grab",
    "Joint",
    "LockedAxes",
    "Mesh",
    "NotReached",
    "PneumaError",
    "Pose",
    "RecordedBody",
    "Recorder",
    "Recording",
    "RigidBody",
    "RigidBodyChange",
    "RigidState",
    "Scene",
    "SceneChange",
    "Server",
    "Shape",
    "SoftBody",
    "SoftBodyChange",
    "SoftState",
    "Springs",
    "State",
    "Stepping",
    "Stream",
    "Surface",
    "Surfaces",
    "Touch",
    "TouchStream",
    "Volume",
    "World",
    "__version__",
    "aio",
    "connect",
    "read",
    "read_mesh",
    "serve",
    "triangles",
    "wire",
]
