#include "physics/contact_soft.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/limits.h"
#include "physics/contact_surface.h"
#include "physics/shape.h"

namespace pneuma::physics {
namespace {

// A step of Newton along the gradient of the implicit function lands outside at once on a ball, and within a tenth of
// the depth of a 4:1 ellipsoid's surface; past this many the point stays where it got.
constexpr int push_out_iterations_max = 8;
// A flat sheet still has two sides.
constexpr double radius_min_m = 1e-6;

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

// What all vertices of a see of b.
struct Obstacle {
  Vec3d centre;
  Vec3d radii;
  Vec3d velocity;
  Vec3d approach;  // the mean velocity of a, seen from b
  Vec3d move;
  BoundsKind kind;
  ContactSurface surface;
  double vertex_share;  // of a change, by the masses; the rest is b's
};

struct Stopped {
  Vec3d velocity_change;
  Vec3d shift;
};

/// The vertex's way is seen from b, which moves on average by `obstacle.move`.
std::optional<Stopped> stop_vertex(const Obstacle& obstacle, const Vec3d& start, const Vec3d& end,
                                   const Vec3d& velocity, double resting_m_s, double dt_s) {
  const std::optional<SurfaceHit> hit = obstacle.kind == BoundsKind::box
                                            ? first_hit(BoxShape{obstacle.radii}, start, end, 0.0)
                                            : hit_ellipsoid(obstacle.radii, start, end);
  if (!hit) return std::nullopt;
  const Vec3d before = velocity - obstacle.velocity;
  const bool pressed = obstacle.approach.dot(hit->normal) >= -resting_m_s;
  const double impact_m_s = pressed ? 0.0 : impact_speed(before.dot(hit->normal), 0.0, resting_m_s);
  const Vec3d after = respond(before, hit->normal, impact_m_s, obstacle.surface);
  const Vec3d slide = after - after.dot(hit->normal) * hit->normal;
  const Vec3d stop = hit->point + (1.0 - hit->fraction) * dt_s * slide;
  return Stopped{after - before, stop - end};
}

}  // namespace

template <class Real>
void meet_bounds(SoftState<Real>& a, const BodyBounds& bounds_a, const SoftState<Real>& b, const BodyBounds& bounds_b,
                 double resting_m_s, double dt_s, SoftPair& pair) {
  if (!bounds_a.active || !bounds_b.active) return;
  const ContactSurface surface = combine(a.body.surface, b.body.surface);
  const double vertex_mass_kg = static_cast<double>(a.vertex_mass_kg);
  const double share =
      bounds_b.free_mass_kg > 0.0 ? bounds_b.free_mass_kg / (vertex_mass_kg + bounds_b.free_mass_kg) : 1.0;
  const Obstacle obstacle{bounds_b.ellipsoid.centre,
                          (bounds_b.ellipsoid.radii_m.array() + surface.thickness_m).cwiseMax(radius_min_m),
                          bounds_b.mean_velocity,
                          bounds_a.mean_velocity - bounds_b.mean_velocity,
                          bounds_b.mean_move,
                          b.body.collision.bounds,
                          surface,
                          share};
  const Vec3d origin = obstacle.centre;
  const double speed_max = base::speed_max_m_s;

  for (std::size_t i = 0; i < a.x.size(); ++i) {
    const Vec3d x = a.x[i].template cast<double>() - origin;
    const Vec3d end = x + a.dr[i].template cast<double>();
    const Vec3d start = x + obstacle.move;
    // Footnote 4: the box about the volume first. The way from start to end may pass through it.
    const Vec3d middle = (start + end).cwiseAbs() - 2.0 * obstacle.radii - (end - start).cwiseAbs();
    if (middle.x() > 0.0 || middle.y() > 0.0 || middle.z() > 0.0) continue;
    const Vec3d velocity = a.v[i].template cast<double>();
    if (a.is_pinned(i) || !(velocity.squaredNorm() <= speed_max * speed_max)) continue;

    const std::optional<Stopped> stopped = stop_vertex(obstacle, start, end, velocity, resting_m_s, dt_s);
    if (!stopped) continue;
    const Vec3<Real> v_before = a.v[i];
    const Vec3<Real> dr_before = a.dr[i];
    a.v[i] += (obstacle.vertex_share * stopped->velocity_change).template cast<Real>();
    a.dr[i] += (obstacle.vertex_share * stopped->shift).template cast<Real>();
    pair.hit = true;
    if (bounds_b.free_mass_kg <= 0.0) continue;
    pair.impulse_n_s -= vertex_mass_kg * (a.v[i] - v_before).template cast<double>();
    pair.shift_kg_m -= vertex_mass_kg * (a.dr[i] - dr_before).template cast<double>();
  }
}

template <class Real>
void take_reactions(SoftState<Real>& body, BodyBounds& bounds) {
  if (bounds.free_mass_kg <= 0.0) return;
  const Vec3<Real> dv = (bounds.impulse_n_s / bounds.free_mass_kg).cast<Real>();
  const Vec3<Real> shift = (bounds.shift_kg_m / bounds.free_mass_kg).cast<Real>();
  for (std::size_t i = 0; i < body.x.size(); ++i) {
    if (body.is_pinned(i)) continue;
    body.v[i] += dv;
    body.dr[i] += shift;
  }
  bounds.stale = true;
}

template void meet_bounds(SoftState<float>&, const BodyBounds&, const SoftState<float>&, const BodyBounds&, double,
                          double, SoftPair&);
template void meet_bounds(SoftState<double>&, const BodyBounds&, const SoftState<double>&, const BodyBounds&, double,
                          double, SoftPair&);
template void take_reactions(SoftState<float>&, BodyBounds&);
template void take_reactions(SoftState<double>&, BodyBounds&);

}  // namespace pneuma::physics
