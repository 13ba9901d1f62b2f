#include "module.h"

PYBIND11_MODULE(_native, module) {
  module.doc() = "The engine, the frame codec and the recordings of Pneuma, in C++.";
  pneuma::python::add_worlds(module);
  pneuma::python::add_frames(module);
  pneuma::python::add_recordings(module);
}
