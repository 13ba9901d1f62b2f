#include "net/admission.h"

#include <utility>

namespace pneuma::net {

namespace {

using Counts = std::map<std::string, std::size_t>;

std::size_t count_in(const Counts& counts, const std::string& address) {
  const auto found = counts.find(address);
  return found == counts.end() ? 0 : found->second;
}

void count_down(Counts& counts, const std::string& address) {
  const auto found = counts.find(address);
  if (--found->second == 0) counts.erase(found);
}

}  // namespace

base::Status Admission::check_room(const std::string& address) const {
  const auto full = [](const std::string& what, std::size_t limit) {
    return base::Status(base::StatusCode::unavailable,
                        what + " has its " + std::to_string(limit) + " connections already; try again later");
  };
  if (connections_ >= limits_.connections_max) return full("the server", limits_.connections_max);
  if (count_in(by_address_, address) < limits_.connections_per_address_max) return {};
  return full("your address", limits_.connections_per_address_max);
}

std::shared_ptr<const Admission::Place> Admission::admit(const std::string& address, base::Status refusal) {
  if (refusal.ok()) refusal = check_room(address);
  const bool may_be_told =
      refusals_ < refusals_max && count_in(refusals_by_address_, address) < refusals_per_address_max;
  if (!refusal.ok() && !may_be_told) return nullptr;
  return std::make_shared<const Place>(*this, address, std::move(refusal));
}

Admission::Place::Place(Admission& admission, std::string address, base::Status refusal)
    : admission_(admission), address_(std::move(address)), refusal_(std::move(refusal)) {
  if (refused()) {
    ++admission_.refusals_;
    ++admission_.refusals_by_address_[address_];
  } else {
    ++admission_.connections_;
    ++admission_.by_address_[address_];
  }
}

Admission::Place::~Place() {
  if (refused()) {
    --admission_.refusals_;
    count_down(admission_.refusals_by_address_, address_);
  } else {
    --admission_.connections_;
    count_down(admission_.by_address_, address_);
  }
}

}  // namespace pneuma::net
