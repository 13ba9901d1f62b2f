"""Builds the wheel: the sources, and what generate.py makes of the .proto files."""

import os
import sys
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

here = Path(__file__).resolve().parent
sys.path.insert(0, str(here))  # a build without isolation does not look beside this file

from generate import generate  # noqa: E402

# The checkout's, unless a build from a copy of this folder says where they are.
proto_folder = Path(os.environ.get("PNEUMA_PROTO", here.parent.parent / "proto"))


class BuildWithMessages(build_py):
    def run(self) -> None:
        super().run()
        generate(proto_folder, Path(self.build_lib) / "pneuma" / "_proto")


setup(cmdclass={"build_py": BuildWithMessages})
