"""Builds the wheel: the sources, and what generate.py makes of the .proto files."""

import os
import shutil
import sys
from pathlib import Path

from setuptools import Distribution, setup
from setuptools.command.build_py import build_py

here = Path(__file__).resolve().parent
sys.path.insert(0, str(here))  # a build without isolation does not look beside this file

from generate import generate  # noqa: E402

# The checkout's, unless a build from a copy of this folder says where they are.
proto_folder = Path(os.environ.get("PNEUMA_PROTO", here.parent.parent / "proto"))


# The module in C++, which CMake builds. Without it the package is a client, and what needs the module says so.
native = os.environ.get("PNEUMA_NATIVE", "")


class BuildWithMessages(build_py):
    def run(self) -> None:
        super().run()
        package = Path(self.build_lib) / "pneuma"
        generate(proto_folder, package / "_proto")
        if native:
            shutil.copy(native, package)


class ForThisMachine(Distribution):
    """A wheel with the module is for this Python and processor alone."""

    def has_ext_modules(self) -> bool:
        return bool(native)


setup(cmdclass={"build_py": BuildWithMessages}, distclass=ForThisMachine)
