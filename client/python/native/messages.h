// Messages cross the border as bytes: the package's are of a pool of its own (generate.py).
#pragma once

#include <string>
#include <string_view>

#include <pybind11/pybind11.h>

#include "errors.h"

namespace pneuma::python {

template <class Message>
Message parsed(std::string_view bytes) {
  Message message;
  if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
    raise({base::StatusCode::malformed, "is no " + Message::descriptor()->name()});
  }
  return message;
}

template <class Message>
pybind11::bytes serialised(const Message& message) {
  return pybind11::bytes(message.SerializeAsString());
}

}  // namespace pneuma::python
