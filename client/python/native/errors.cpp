#include "errors.h"

#include "app/protocol.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::python {

namespace py = pybind11;

void raise(const base::Status& status) {
  const v1::Error error = app::to_error(status);
  const py::object kind = py::module_::import("pneuma.errors").attr("PneumaError");
  const py::object raised = kind(v1::Error::Code_Name(error.code()), error.what(), error.where());
  PyErr_SetObject(kind.ptr(), raised.ptr());
  throw py::error_already_set();
}

}  // namespace pneuma::python
