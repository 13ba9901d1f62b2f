// How many connections there are, in all and of each address, against their limits.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>

#include "base/limits.h"
#include "base/status.h"

namespace pneuma::net {

/// Connections past a limit that are told so at the same time; more than these are closed without a word.
inline constexpr std::size_t refusals_max = 64;
/// Of one address: some are left for the others' health checks.
inline constexpr std::size_t refusals_per_address_max = 8;

class Admission {
 public:
  explicit Admission(const base::Limits& limits) : limits_(limits) {}
  Admission(const Admission&) = delete;
  Admission& operator=(const Admission&) = delete;

  /// A connection's place, held for as long as it lives; not longer than the Admission.
  class Place {
   public:
    /// `refusal` is OK, or why the connection gets no place.
    Place(Admission& admission, std::string address, base::Status refusal);
    ~Place();
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;
    /// The connection is past a limit: it is only to be told so.
    [[nodiscard]] bool refused() const { return !refusal_.ok(); }
    /// Which limit.
    [[nodiscard]] const base::Status& refusal() const { return refusal_; }

   private:
    Admission& admission_;
    std::string address_;
    base::Status refusal_;
  };
  /// `refusal` is why nobody gets a place now; OK: only the limits count. Null where not even a refusal has room.
  [[nodiscard]] std::shared_ptr<const Place> admit(const std::string& address, base::Status refusal = {});

 private:
  [[nodiscard]] base::Status check_room(const std::string& address) const;

  base::Limits limits_;
  std::size_t connections_ = 0;
  std::size_t refusals_ = 0;
  std::map<std::string, std::size_t> by_address_;
  std::map<std::string, std::size_t> refusals_by_address_;
};

}  // namespace pneuma::net
