// The parts of the module pneuma._native. Python's side of them is in src/pneuma: engine.py, decoding.py, recording.py.
#pragma once

#include <pybind11/pybind11.h>

namespace pneuma::python {

void add_worlds(pybind11::module_& module);
void add_frames(pybind11::module_& module);
void add_recordings(pybind11::module_& module);

}  // namespace pneuma::python
