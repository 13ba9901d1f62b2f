#include "physics/xpbd/xpbd.h"

namespace pneuma::physics {
namespace {

template <class Real>
void find_inverse_masses(const SoftState<Real>& body, std::vector<Real>& inverse_masses_1_kg) {
  inverse_masses_1_kg.assign(body.x.size(), Real{1} / body.vertex_mass_kg);
  for (std::size_t i = 0; i < body.mass_shares.size(); ++i) {
    inverse_masses_1_kg[i] = static_cast<Real>(1.0 / body.mass_kg(i));
  }
  for (std::size_t i = 0; i < body.pinned.size(); ++i) {
    if (body.pinned[i] != 0) inverse_masses_1_kg[i] = Real{0};
  }
}

// Sets the move to where the velocities, pushed, lead.
template <class Real>
void predict(const XpbdPlace<Real>& place, XpbdTerms<Real>& terms) {
  SoftState<Real>& body = place.body;
  const auto h = static_cast<Real>(place.h_s);
  body.dr = body.v;
  terms.for_each([&](auto& part) { part.push(place, body.dr); });
  for (std::size_t i = 0; i < body.x.size(); ++i) {
    body.dr[i] = body.is_pinned(i) ? Vec3<Real>(Vec3<Real>::Zero()) : Vec3<Real>(h * body.dr[i]);
  }
}

// There and back, with the gas in between: a pass in one order only is no symmetric operator, and a step that takes its
// velocity from it may have growing modes (a ball at rest began to spin).
template <class Real>
void solve(const XpbdPlace<Real>& place, XpbdTerms<Real>& terms) {
  terms.for_each([&](auto& part) { part.begin(place); });
  terms.for_each([&](auto& part) { part.pass(place, XpbdWay::there); });
  terms.for_each([&](auto& part) { part.pass_between(place); });
  terms.for_each_back([&](auto& part) { part.pass(place, XpbdWay::back); });
}

template <class Real>
void finish(const XpbdPlace<Real>& place, XpbdTerms<Real>& terms) {
  // By the same rounded number that predict() multiplies with: its reciprocal would be off one way in every step.
  const auto h = static_cast<Real>(place.h_s);
  for (std::size_t i = 0; i < place.body.x.size(); ++i) place.body.v[i] = place.body.dr[i] / h;
  terms.for_each([&](auto& part) { part.damp(place); });
}

}  // namespace

template <class Real>
void xpbd(SoftState<Real>& body, const SubstepContext& context, XpbdScratch<Real>& scratch) {
  find_inverse_masses(body, scratch.inverse_masses_1_kg);
  const XpbdPlace<Real> place{body, context.surroundings, context.dt_s, scratch.inverse_masses_1_kg, context.profile};
  {
    const StageTimer timer(context.profile, Stage::integrate);
    predict(place, scratch.terms);
  }
  solve(place, scratch.terms);
  const StageTimer timer(context.profile, Stage::integrate);
  finish(place, scratch.terms);
}

template void xpbd<float>(SoftState<float>&, const SubstepContext&, XpbdScratch<float>&);
template void xpbd<double>(SoftState<double>&, const SubstepContext&, XpbdScratch<double>&);

}  // namespace pneuma::physics
