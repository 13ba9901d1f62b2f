#include "net/admission.h"

#include <utility>

namespace pneuma::net {

std::shared_ptr<const Admission::Place> Admission::admit(const std::string& address) {
  const auto same_address = by_address_.find(address);
  const std::size_t of_address = same_address == by_address_.end() ? 0 : same_address->second;
  const bool refused = connections_ >= limits_.connections_max || of_address >= limits_.connections_per_address_max;
  if (refused && refusals_ >= refusals_max) return nullptr;
  return std::make_shared<const Place>(*this, address, refused);
}

Admission::Place::Place(Admission& admission, std::string address, bool refused)
    : admission_(admission), address_(std::move(address)), refused_(refused) {
  if (refused_) {
    ++admission_.refusals_;
  } else {
    ++admission_.connections_;
    ++admission_.by_address_[address_];
  }
}

Admission::Place::~Place() {
  if (refused_) {
    --admission_.refusals_;
    return;
  }
  --admission_.connections_;
  const auto of_address = admission_.by_address_.find(address_);
  if (--of_address->second == 0) admission_.by_address_.erase(of_address);
}

}  // namespace pneuma::net
