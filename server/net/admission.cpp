#include "net/admission.h"

#include <utility>

namespace pneuma::net {

base::Status Admission::check_room(const std::string& address) const {
  const auto full = [](const std::string& what, std::size_t limit) {
    return base::Status(base::StatusCode::unavailable,
                        what + " has its " + std::to_string(limit) + " connections already; try again later");
  };
  if (connections_ >= limits_.connections_max) return full("the server", limits_.connections_max);
  const auto same_address = by_address_.find(address);
  const std::size_t of_address = same_address == by_address_.end() ? 0 : same_address->second;
  if (of_address < limits_.connections_per_address_max) return {};
  return full("your address", limits_.connections_per_address_max);
}

std::shared_ptr<const Admission::Place> Admission::admit(const std::string& address) {
  base::Status refusal = check_room(address);
  if (!refusal.ok() && refusals_ >= refusals_max) return nullptr;
  return std::make_shared<const Place>(*this, address, std::move(refusal));
}

Admission::Place::Place(Admission& admission, std::string address, base::Status refusal)
    : admission_(admission), address_(std::move(address)), refusal_(std::move(refusal)) {
  if (refused()) {
    ++admission_.refusals_;
  } else {
    ++admission_.connections_;
    ++admission_.by_address_[address_];
  }
}

Admission::Place::~Place() {
  if (refused()) {
    --admission_.refusals_;
    return;
  }
  --admission_.connections_;
  const auto of_address = admission_.by_address_.find(address_);
  if (--of_address->second == 0) admission_.by_address_.erase(of_address);
}

}  // namespace pneuma::net
