#include "app/stream_terms.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "base/limits.h"
#include "base/nearest_word.h"
#include "base/number_text.h"
#include "codec/topology_hash.h"

namespace pneuma::app {

using base::Status;
using base::StatusCode;

namespace {

/// Plain frames take the same whatever moves.
Status check_bandwidth(const v1::Subscribe& request, const FrameSource& source) {
  if (request.encoding() != v1::Subscribe::PLAIN) return {};
  const std::set<std::string> wanted(request.bodies().begin(), request.bodies().end());
  double vertices = 0.0;
  for (std::size_t i = 0; i < source.soft_body_count(); ++i) {
    if (!wanted.empty() && !wanted.contains(source.soft_body_name(i))) continue;
    const auto all = static_cast<double>(source.mesh(i)->positions_m.size());
    const auto coarsest = static_cast<double>(base::coarse_vertices_min);
    vertices += std::max(all * std::pow(0.25, request.level_of_detail()), std::min(all, coarsest));
  }
  const double numbers = request.velocities() ? 6.0 : 3.0;
  constexpr double number_bytes = 4.0;  // 16 bits where they hold the bodies, which may part
  const double world_rate_hz = 1.0 / source.tick_period_s();
  const double divisions = request.rate_hz() == 0.0 ? 1.0 : std::round(world_rate_hz / request.rate_hz());
  const double rate_hz = world_rate_hz / std::max(divisions, 1.0);
  const double bytes_s = vertices * numbers * number_bytes * rate_hz;
  if (bytes_s <= base::plain_bytes_s_max) return {};
  return {StatusCode::limit_exceeded,
          "plain frames would take " + base::number_text(std::round(1e-6 * bytes_s)) + " MB a second; at most " +
              base::number_text(1e-6 * base::plain_bytes_s_max) +
              " are sent. Ask for fewer frames, some of the bodies, or ERROR_BOUNDED",
          "subscribe.encoding"};
}

}  // namespace

Status check_terms(const v1::Subscribe& request) {
  if (!v1::Subscribe::Encoding_IsValid(request.encoding())) {
    return base::invalid("is none that this server knows", "subscribe.encoding");
  }
  if (request.encoding() == v1::Subscribe::PLAIN && request.time_layers()) {
    return base::invalid("plain frames have no layers: each stands alone", "subscribe.time_layers");
  }
  if (request.encoding() == v1::Subscribe::PLAIN && request.adaptive()) {
    return base::invalid("plain frames have one quality", "subscribe.adaptive");
  }
  if (!std::isfinite(request.rate_hz()) || request.rate_hz() < 0.0) {
    return base::invalid("must be 0 or more", "subscribe.rate_hz");
  }
  const double max_error_m = request.max_error_m();
  if (!std::isfinite(max_error_m) || max_error_m < 0.0) {
    return base::invalid("must be 0 or more", "subscribe.max_error_m");
  }
  if (max_error_m != 0.0 && (max_error_m < base::max_error_min_m || max_error_m > base::max_error_max_m)) {
    return Status(StatusCode::limit_exceeded,
                  "is " + base::number_text(max_error_m) + "; must be 0 or from " +
                      base::number_text(base::max_error_min_m) + " to " + base::number_text(base::max_error_max_m),
                  "subscribe.max_error_m");
  }
  if (!std::isfinite(request.key_interval_s()) || request.key_interval_s() < 0.0) {
    return base::invalid("must be 0 or more", "subscribe.key_interval_s");
  }
  if (request.level_of_detail() > base::level_of_detail_max) {
    return Status(StatusCode::limit_exceeded,
                  "is " + std::to_string(request.level_of_detail()) + "; may be at most " +
                      std::to_string(base::level_of_detail_max),
                  "subscribe.level_of_detail");
  }
  for (int i = 0; i < request.known_topologies_size(); ++i) {
    if (const std::size_t bytes = request.known_topologies(i).size(); bytes != codec::topology_hash_bytes) {
      return base::invalid(
          "has " + std::to_string(bytes) + " bytes; a hash has " + std::to_string(codec::topology_hash_bytes),
          "subscribe.known_topologies[" + std::to_string(i) + "]");
    }
  }
  return {};
}

Status check_subscribed(const v1::Subscribe& request, const FrameSource& source) {
  if (Status wrong = check_terms(request); !wrong.ok()) return wrong;
  if (static_cast<std::size_t>(request.bodies_size()) > base::world_bodies_max) {
    return {StatusCode::limit_exceeded,
            "names " + std::to_string(request.bodies_size()) + " bodies; a world holds at most " +
                std::to_string(base::world_bodies_max),
            "subscribe.bodies"};
  }
  std::set<std::string> names;
  for (std::size_t i = 0; i < source.soft_body_count(); ++i) names.insert(source.soft_body_name(i));
  for (int i = 0; i < request.bodies_size(); ++i) {
    if (names.contains(request.bodies(i))) continue;
    return base::not_found("no soft body is named \"" + request.bodies(i) + "\"" +
                               base::nearest_or_all(request.bodies(i), std::vector(names.begin(), names.end())),
                           "subscribe.bodies[" + std::to_string(i) + "]");
  }
  if (request.velocities() && !source.has_velocities()) {
    return {StatusCode::failed_precondition, "the recording holds no velocities", "subscribe.velocities"};
  }
  if (request.scalars() && !source.has_scalars()) {
    return {StatusCode::failed_precondition, "the recording holds no scalars", "subscribe.scalars"};
  }
  if (request.contacts() && !source.has_contacts()) {
    return {StatusCode::failed_precondition, "a recording tells no contacts", "subscribe.contacts"};
  }
  if (request.has_touches() && !source.has_contacts()) {
    return {StatusCode::failed_precondition, "a recording tells no touches", "subscribe.touches"};
  }
  return check_bandwidth(request, source);
}

}  // namespace pneuma::app
