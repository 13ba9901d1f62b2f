#include "physics/contact/contact_soft.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/limits.h"
#include "physics/rigid/contact_surface.h"
#include "physics/scene/shape.h"

namespace pneuma::physics {
namespace {

// A step of Newton along the gradient of the implicit function lands outside at once on a ball, and within a tenth of
// the depth of a 4:1 ellipsoid's surface; past this many the point stays where it got.
constexpr int push_out_iterations_max = 8;
// Put outside at once, as in the paper, a vertex gets elastic energy that nothing pays for: two gas balls that met at a
// restitution of 1 went apart with 7 % more energy, at any step. Slower than the bodies rebound, it is within the
// integrator's own error; a stack of two is none the lower for it.
constexpr double overlap_time_s = 0.3;
// Of the body's length: a flat sheet still has two sides.
constexpr double radius_min_share = 1e-6;

Vec3d ellipsoid_normal(const Vec3d& point, const Vec3d& radii) {
  const Vec3d gradient = point.cwiseQuotient(radii.cwiseProduct(radii));
  const double length = gradient.norm();
  return length > 0.0 ? Vec3d(gradient / length) : Vec3d::UnitY();
}

/// f(p) = sum (p_i / r_i)^2 - 1 is the implicit function. From its centre a point goes up.
SurfaceHit push_out(Vec3d point, const Vec3d& radii) {
  for (int i = 0; i < push_out_iterations_max; ++i) {
    const double root = point.cwiseQuotient(radii).norm();
    if (root >= 1.0) break;
    // f / |grad f| with f's square root taken, so that the step is exact on a ball.
    const Vec3d gradient =
        root > 0.0 ? Vec3d(point.cwiseQuotient(radii.cwiseProduct(radii)) / root) : Vec3d(Vec3d::UnitY() / radii.y());
    point += (1.0 - root) / gradient.squaredNorm() * gradient;
  }
  return {0.0, ellipsoid_normal(point, radii), point};
}

std::optional<SurfaceHit> hit_ellipsoid(const Vec3d& radii, const Vec3d& start, const Vec3d& end) {
  const Vec3d from = start.cwiseQuotient(radii);
  const Vec3d way = end.cwiseQuotient(radii) - from;
  const double outside = from.squaredNorm() - 1.0;
  if (outside < 0.0) {
    const SurfaceHit out = push_out(start, radii);
    const bool leaves = (end - start).dot(out.normal) >= 0.0 && (from + way).squaredNorm() >= 1.0;
    return leaves ? std::nullopt : std::optional(out);
  }
  const double towards = from.dot(way);
  const double discriminant = towards * towards - way.squaredNorm() * outside;
  if (towards >= 0.0 || !(discriminant > 0.0)) return std::nullopt;
  const double fraction = outside / (-towards + std::sqrt(discriminant));
  if (fraction > 1.0) return std::nullopt;
  const Vec3d point = start + fraction * (end - start);
  return SurfaceHit{fraction, ellipsoid_normal(point, radii), point};
}

ContactSurface surface_of(const SoftBody& a, const SoftBody& b) {
  return combine(a.surface, b.surface);
}

template <class Real>
Vec3d radii_of(const SoftState<Real>& body, const BodyBounds& bounds, const ContactSurface& surface) {
  const double least_m = radius_min_share * static_cast<double>(body.length_m);
  return (bounds.ellipsoid.radii_m.array() + surface.thickness_m).cwiseMax(least_m);
}

// A vertex's way about the centre of b's bounds, as b sees it: b moves on average by mean_move.
struct Way {
  Vec3d start;
  Vec3d end;
};

template <class Real>
Way way_of(const SoftState<Real>& a, std::size_t vertex, const BodyBounds& b) {
  const Vec3d x = a.position_m(vertex) - b.ellipsoid.centre;
  return {x + b.mean_move, x + a.dr[vertex].template cast<double>()};
}

// Where the way ends instead: the vertex slides along the surface for the rest of the substep. One that began inside
// goes out as fast as it moves, or else within overlap_time_s.
Vec3d stop_of(const Way& way, const SurfaceHit& hit, const Vec3d& relative_m_s, double dt_s) {
  const double away_m_s = relative_m_s.dot(hit.normal);
  const Vec3d slide = (1.0 - hit.fraction) * dt_s * (relative_m_s - away_m_s * hit.normal);
  const double depth_m = (hit.point - way.start).dot(hit.normal);
  if (hit.fraction > 0.0 || !(depth_m > 0.0)) return hit.point + slide;
  const double out = std::min(std::max(dt_s * away_m_s / depth_m, dt_s / overlap_time_s), 1.0);
  return way.start + out * (hit.point - way.start) + slide;
}

template <class Real>
void find_hits(const SoftState<Real>& a, const SoftState<Real>& b, const BodyBounds& bounds,
               const ContactSurface& surface, std::span<const std::uint32_t> near, std::vector<VertexHit>& hits) {
  const BoundsKind kind = b.body.collision.bounds;
  const double skin_m = skin_share * static_cast<double>(b.length_m);
  const Vec3d radii = radii_of(b, bounds, surface);
  hits.clear();
  for (const std::uint32_t i : near) {
    const Way way = way_of(a, i, bounds);
    const std::optional<SurfaceHit> hit = kind == BoundsKind::box
                                              ? first_hit(BoxShape{radii}, way.start, way.end, 0.0, skin_m)
                                              : hit_ellipsoid(radii, way.start, way.end);
    if (hit) hits.push_back({.vertex = i, .hit = *hit});
  }
}

/// What contact gave to a body, to be taken from its partner.
struct Exchange {
  Vec3d about = Vec3d::Zero();  // a place near both, so that far from the origin no digits are lost
  Vec3d impulse_n_s = Vec3d::Zero();
  Vec3d moment_n_m_s = Vec3d::Zero();  // of the impulses about that place
  Vec3d shift_kg_m = Vec3d::Zero();    // mass times displacement
};

// A vertex and its share of the body that it hits, as two masses; the body is split evenly among `hits`.
class SharedMasses {
 public:
  SharedMasses(const RigidPart& body, std::size_t hits)
      : share_kg_(body.mass_kg / static_cast<double>(hits)),
        inverse_inertia_1_kg_m2_(static_cast<double>(hits) * body.inverse_inertia_1_kg_m2) {}

  [[nodiscard]] Eigen::Matrix3d inverse_mass_1_kg(double vertex_mass_kg, const Vec3d& arm) const {
    const double sum_1_kg = 1.0 / vertex_mass_kg + (gives_way() ? 1.0 / share_kg_ : 0.0);
    return sum_1_kg * Eigen::Matrix3d::Identity() + turning_inverse_mass(arm, inverse_inertia_1_kg_m2_);
  }
  /// Of a move that parts the two: the vertex's part of it.
  [[nodiscard]] double moved_share(double vertex_mass_kg) const {
    return gives_way() ? share_kg_ / (vertex_mass_kg + share_kg_) : 1.0;
  }

 private:
  [[nodiscard]] bool gives_way() const { return share_kg_ > 0.0; }

  double share_kg_;
  Eigen::Matrix3d inverse_inertia_1_kg_m2_;
};

// The change of the rigid part alone; the vertices are the caller's.
void take(BodyBounds& bounds, const Exchange& given) {
  RigidPart& rigid = bounds.rigid;
  const Vec3d moment_n_m_s = given.moment_n_m_s + (given.about - rigid.centre).cross(given.impulse_n_s);
  rigid.velocity += given.impulse_n_s / rigid.mass_kg;
  rigid.angular_velocity += rigid.inverse_inertia_1_kg_m2 * moment_n_m_s;
  bounds.mean_move += given.shift_kg_m / rigid.mass_kg;
  bounds.stale = true;
}

// Moves the whole body: each free vertex as a point of the rigid part.
template <class Real>
void take_as_a_whole(SoftState<Real>& body, BodyBounds& bounds, const Exchange& given) {
  RigidPart& rigid = bounds.rigid;
  if (rigid.mass_kg <= 0.0) return;
  const Vec3d velocity = rigid.velocity;
  const Vec3d angular_velocity = rigid.angular_velocity;
  take(bounds, given);
  const Vec3d velocity_change = rigid.velocity - velocity;
  const Vec3d turn_change = rigid.angular_velocity - angular_velocity;
  const Vec3d shift = given.shift_kg_m / rigid.mass_kg;
  bounds.ellipsoid.centre += shift;
  for (std::size_t i = 0; i < body.x.size(); ++i) {
    if (body.is_pinned(i)) continue;
    const Vec3d arm = body.position_m(i) - rigid.centre;
    body.v[i] += velocity_at(velocity_change, turn_change, arm).template cast<Real>();
    body.dr[i] += shift.template cast<Real>();
  }
}

}  // namespace

template <class Real>
void find_near_vertices(const SoftState<Real>& a, const BodyBounds& bounds_a, const SoftState<Real>& b,
                        const BodyBounds& bounds_b, std::vector<std::uint32_t>& near) {
  if (!bounds_a.active || !bounds_b.active) return;
  const Vec3d radii = radii_of(b, bounds_b, surface_of(a.body, b.body));
  const auto speed_max = static_cast<Real>(base::speed_max_m_s);
  for (std::uint32_t i = 0; i < a.x.size(); ++i) {
    const Way way = way_of(a, i, bounds_b);
    // Footnote 4: the box about the volume first. The way from start to end may pass through it.
    const Vec3d over = (way.start + way.end).cwiseAbs() - 2.0 * radii - (way.end - way.start).cwiseAbs();
    if (over.x() > 0.0 || over.y() > 0.0 || over.z() > 0.0) continue;
    if (!a.is_pinned(i) && a.v[i].squaredNorm() <= speed_max * speed_max) near.push_back(i);
  }
}

template <class Real>
void meet_bounds(SoftState<Real>& a, BodyBounds& bounds_a, SoftState<Real>& b, BodyBounds& bounds_b,
                 std::span<const std::uint32_t> near, double resting_m_s, double dt_s, HitResponse response,
                 std::vector<VertexHit>& hits) {
  const ContactSurface surface = surface_of(a.body, b.body);
  find_hits(a, b, bounds_b, surface, near, hits);
  if (hits.empty()) return;
  fit_turning(a, bounds_a.rigid);
  fit_turning(b, bounds_b.rigid);

  const RigidPart own = bounds_a.rigid;
  const RigidPart& other = bounds_b.rigid;
  const auto shares = static_cast<double>(hits.size());
  const bool whole = response == HitResponse::whole && own.mass_kg > 0.0;
  const SharedMasses masses(other, hits.size());
  const Vec3d approach = own.velocity - other.velocity;
  Exchange to_a{.about = other.centre};
  for (auto& [i, hit, got_n_s] : hits) {
    const double hit_mass_kg = whole ? own.mass_kg / shares : a.mass_kg(i);
    const Vec3d arm = a.position_m(i) - other.centre;
    const Vec3d own_arm = a.position_m(i) - own.centre;
    const Vec3d velocity =
        whole ? velocity_at(own.velocity, own.angular_velocity, own_arm) : Vec3d(a.v[i].template cast<double>());
    const Vec3d relative = velocity - velocity_at(other.velocity, other.angular_velocity, arm);
    const bool pressed = approach.dot(hit.normal) >= -resting_m_s;
    const double impact_m_s = pressed ? 0.0 : impact_speed(relative.dot(hit.normal), 0.0, resting_m_s);
    Eigen::Matrix3d inverse_mass_1_kg = masses.inverse_mass_1_kg(hit_mass_kg, arm);
    if (whole) inverse_mass_1_kg += turning_inverse_mass(own_arm, shares * own.inverse_inertia_1_kg_m2);
    const Vec3d impulse_n_s = contact_impulse(relative, hit.normal, impact_m_s, surface,
                                              [&](const Vec3d& n) -> Vec3d { return inverse_mass_1_kg * n; });
    got_n_s = impulse_n_s;
    const Vec3d after = relative + inverse_mass_1_kg * impulse_n_s;
    const Way way = way_of(a, i, bounds_b);
    const Vec3d back = masses.moved_share(hit_mass_kg) * (stop_of(way, hit, after, dt_s) - way.end);
    if (whole) {
      to_a.impulse_n_s += impulse_n_s;
      to_a.moment_n_m_s += arm.cross(impulse_n_s);
      to_a.shift_kg_m += hit_mass_kg * back;
      continue;
    }
    // What the vertex took after rounding is what b gives.
    const Vec3<Real> v_before = a.v[i];
    const Vec3<Real> dr_before = a.dr[i];
    a.v[i] += (impulse_n_s / hit_mass_kg).template cast<Real>();
    a.dr[i] += back.template cast<Real>();
    const Vec3d taken_n_s = hit_mass_kg * (a.v[i] - v_before).template cast<double>();
    to_a.impulse_n_s += taken_n_s;
    to_a.moment_n_m_s += arm.cross(taken_n_s);
    to_a.shift_kg_m += hit_mass_kg * (a.dr[i] - dr_before).template cast<double>();
  }
  if (whole) {
    take_as_a_whole(a, bounds_a, to_a);
  } else {
    take(bounds_a, to_a);
  }
  take_as_a_whole(b, bounds_b, {other.centre, -to_a.impulse_n_s, -to_a.moment_n_m_s, -to_a.shift_kg_m});
}

#define PNEUMA_INSTANTIATE(Real)                                                                      \
  template void find_near_vertices(const SoftState<Real>&, const BodyBounds&, const SoftState<Real>&, \
                                   const BodyBounds&, std::vector<std::uint32_t>&);                   \
  template void meet_bounds(SoftState<Real>&, BodyBounds&, SoftState<Real>&, BodyBounds&,             \
                            std::span<const std::uint32_t>, double, double, HitResponse, std::vector<VertexHit>&);
PNEUMA_INSTANTIATE(float)
PNEUMA_INSTANTIATE(double)
#undef PNEUMA_INSTANTIATE

}  // namespace pneuma::physics
