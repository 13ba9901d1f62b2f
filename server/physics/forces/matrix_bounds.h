// What the preconditioner of an implicit step holds of the forces, and what that depends on.
#pragma once

#include <tuple>

#include "physics/forces/force_terms.h"

namespace pneuma::physics {

/// Of a term without a part in the preconditioner.
struct NoBound {
  bool operator==(const NoBound&) const = default;
  [[nodiscard]] static std::size_t bytes() { return 0; }
};
template <class Term>
struct BoundOf {
  NoBound bound;
  bool operator==(const BoundOf&) const = default;
};
template <class Term>
  requires(!term_parts::NoStiffening<Term>)
struct BoundOf<Term> {
  typename Term::Bound bound;
  bool operator==(const BoundOf&) const = default;
};

/// One a term. Bodies with equal bounds have equal matrices.
template <class List>
struct BoundsOf;
template <class... Terms>
struct BoundsOf<ForceList<Terms...>> {
  std::tuple<BoundOf<Terms>...> of_terms;

  template <class Real>
  [[nodiscard]] static BoundsOf of(const SoftState<Real>& body, const Surroundings& surroundings) {
    BoundsOf bounds;
    ForceList<Terms...>::for_each([&]<class Term>() {
      if constexpr (!term_parts::NoStiffening<Term>)
        bounds.template get<Term>().bound = Term::bound(body, surroundings);
    });
    return bounds;
  }
  /// Adds what the terms bound for `body`, which these are of.
  template <class Real>
  void stiffen(const SoftState<Real>& body, const MatrixPlace& at, MatrixEntries& entries) const {
    ForceList<Terms...>::for_each([&]<class Term>() {
      if constexpr (!term_parts::NoStiffening<Term>) Term::stiffen(body, get<Term>().bound, at, entries);
    });
  }
  bool operator==(const BoundsOf&) const = default;
  [[nodiscard]] std::size_t bytes() const {
    std::size_t sum = 0;
    ForceList<Terms...>::for_each([&]<class Term>() { sum += get<Term>().bound.bytes(); });
    return sum;
  }

 private:
  template <class Term>
  [[nodiscard]] BoundOf<Term>& get() {
    return std::get<BoundOf<Term>>(of_terms);
  }
  template <class Term>
  [[nodiscard]] const BoundOf<Term>& get() const {
    return std::get<BoundOf<Term>>(of_terms);
  }
};
using MatrixBounds = BoundsOf<ForceTerms>;

}  // namespace pneuma::physics
