#include "base/status.h"

namespace pneuma::base {

Status Status::inside(const std::string& outer) const {
  if (where_.empty()) return {code_, what_, outer};
  return {code_, what_, outer + (where_.front() == '[' ? "" : ".") + where_};
}

std::string Status::message() const {
  return where_.empty() ? what_ : where_ + ": " + what_;
}

}  // namespace pneuma::base
