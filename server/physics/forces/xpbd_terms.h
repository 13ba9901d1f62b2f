// The forces' own rooms in XPBD, one a term.
#pragma once

#include <tuple>

#include "physics/forces/force_terms.h"

namespace pneuma::physics {

template <class Real, class List>
class XpbdTermsOf;
template <class Real, class... Terms>
class XpbdTermsOf<Real, ForceList<Terms...>> {
 public:
  /// Calls work(part) for each term's, in the order of the list.
  template <class Work>
  void for_each(const Work& work) {
    std::apply([&](auto&... parts) { (work(parts), ...); }, parts_);
  }
  /// The last first.
  template <class Work>
  void for_each_back(const Work& work) {
    [&]<std::size_t... I>(std::index_sequence<I...>) {
      (work(std::get<sizeof...(I) - 1 - I>(parts_)), ...);
    }(std::index_sequence_for<Terms...>());
  }
  [[nodiscard]] std::size_t bytes() const {
    return std::apply([](const auto&... parts) { return (parts.bytes() + ...); }, parts_);
  }

 private:
  std::tuple<typename Terms::template Xpbd<Real>...> parts_;
};
template <class Real>
using XpbdTerms = XpbdTermsOf<Real, ForceTerms>;

}  // namespace pneuma::physics
