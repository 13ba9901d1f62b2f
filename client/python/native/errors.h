// Statuses of the server's parts as exceptions of Python.
#pragma once

#include <utility>

#include <pybind11/pybind11.h>

#include "base/status.h"

namespace pneuma::python {

/// Raises pneuma.PneumaError.
[[noreturn]] void raise(const base::Status& status);

inline void check(const base::Status& status) {
  if (!status.ok()) raise(status);
}

template <class T>
T checked(base::Result<T> result) {
  if (!result.ok()) raise(result.status());
  return std::move(*result);
}

}  // namespace pneuma::python
