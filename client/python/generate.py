"""Makes the package pneuma._proto of the .proto files: `generate.py PROTO_FOLDER PACKAGE_FOLDER`.

It holds protoc's messages and their stubs, and `scene_types`: a dataclass for each message of scene.proto, with the
comments of that file as docstrings. So names, units and texts are those of the wire, and nothing is written down twice.
"""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

from generate_scene_types import scene_types

protos = ["scene", "frame", "session", "recording", "world_file"]

# Another package in the same program may have messages of the same names, of another version. So ours are in a pool of
# their own.
pool = '''"""Where the messages of this package are known by name."""
from google.protobuf.descriptor_pool import DescriptorPool

POOL = DescriptorPool()
'''


def in_own_package(source: str, *, is_stub: bool) -> str:
    """What protoc made, in the package pneuma._proto and in its pool."""
    source = re.sub(r"^from pneuma\.v1 import", "from pneuma._proto import", source, flags=re.MULTILINE)
    if is_stub:
        # Collision has a field named self, with which its stub would not parse.
        return re.sub(r"def __init__\(self, (?=.*\bself: )", "def __init__(self_, ", source)
    source, imports = re.subn(
        r"^from google\.protobuf import descriptor_pool as _descriptor_pool$",
        "from pneuma._proto import _pool",
        source,
        flags=re.MULTILINE,
    )
    source, uses = re.subn(r"_descriptor_pool\.Default\(\)", "_pool.POOL", source)
    if (imports, uses) != (1, 1):
        raise RuntimeError(f"this protoc writes code of another form: {imports} imports of the pool, {uses} uses")
    return source


def generate(proto_folder: Path, package: Path) -> None:
    """Makes `package`, a folder, anew."""
    package.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder)
        descriptors = made / "descriptors"
        subprocess.run(
            [
                "protoc",
                f"-I{proto_folder}",
                f"--python_out={made}",
                f"--pyi_out={made}",
                f"--descriptor_set_out={descriptors}",
                "--include_source_info",
                *(f"pneuma/v1/{proto}.proto" for proto in protos),
            ],
            check=True,
        )
        for proto in protos:
            for suffix in (".py", ".pyi"):
                name = f"{proto}_pb2{suffix}"
                source = (made / "pneuma" / "v1" / name).read_text()
                (package / name).write_text(in_own_package(source, is_stub=suffix == ".pyi"))
        (package / "scene_types.py").write_text(scene_types(descriptors.read_bytes()))
    (package / "_pool.py").write_text(pool)
    (package / "__init__.py").write_text('"""Generated: see generate.py."""\n')


if __name__ == "__main__":
    generate(Path(sys.argv[1]), Path(sys.argv[2]))
