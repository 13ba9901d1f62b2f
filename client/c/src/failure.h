// How errors of C++ come out of the C interface.
#pragma once

#include <exception>

#include "base/status.h"
#include "pneuma.h"

namespace pneuma::c {

/// Tells what is wrong, and where; `error` may be null.
pneuma_code fail(const base::Status& status, pneuma_error* error);
/// Nothing is.
pneuma_code succeed(pneuma_error* error);

/// Calls work(), which gives a Status, and tells it. No exception leaves a function of C.
template <class Work>
pneuma_code guarded(pneuma_error* error, const Work& work) {
  try {
    const base::Status status = work();
    return status.ok() ? succeed(error) : fail(status, error);
  } catch (const std::exception& thrown) {
    return fail({base::StatusCode::internal, thrown.what()}, error);
  }
}

}  // namespace pneuma::c
