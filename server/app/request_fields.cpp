#include "app/request_fields.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include "app/world_clock.h"
#include "base/limits.h"
#include "base/number_text.h"
#include "persist/data_dir.h"

namespace pneuma::app {

namespace {

base::Result<physics::At> read_near(const v1::Impulse::Near& near, const std::string& field) {
  const auto position = read_vector(near.position(), base::coordinate_max_m, field + ".position");
  if (!position.ok()) return position.status();
  if (auto status = check_amount(near.radius_m(), base::coordinate_max_m, field + ".radius_m"); !status.ok()) {
    return status;
  }
  return physics::At(physics::NearPoint{*position, near.radius_m()});
}

base::Result<physics::At> read_ray_point(const v1::Impulse::Ray& asked, const std::string& field) {
  const auto ray = read_ray(asked.origin(), asked.direction(), field);
  if (!ray.ok()) return ray.status();
  if (auto status = check_amount(asked.radius_m(), base::coordinate_max_m, field + ".radius_m"); !status.ok()) {
    return status;
  }
  return physics::At(physics::RayPoint{ray->origin_m, ray->direction, asked.radius_m()});
}

base::Status past(double value, double limit, const std::string& field) {
  return {base::StatusCode::limit_exceeded,
          "is " + base::number_text(value) + "; its magnitude may be at most " + base::number_text(limit), field};
}

bool is_name_character(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '_' || c == '-';
}

}  // namespace

base::Result<physics::Vec3d> read_vector(const v1::Vec3& vector, double limit, const std::string& field) {
  const std::array<std::pair<const char*, double>, 3> components{
      {{".x", vector.x()}, {".y", vector.y()}, {".z", vector.z()}}};
  for (const auto& [axis, value] : components) {
    if (!std::isfinite(value)) return base::invalid("is not finite", field + axis);
    if (std::abs(value) > limit) return past(value, limit, field + axis);
  }
  return physics::Vec3d(vector.x(), vector.y(), vector.z());
}

base::Result<physics::Ray> read_ray(const v1::Vec3& origin, const v1::Vec3& direction, const std::string& field) {
  const auto from = read_vector(origin, base::coordinate_max_m, field + ".origin");
  if (!from.ok()) return from.status();
  const auto along = read_vector(direction, std::numeric_limits<double>::max(), field + ".direction");
  if (!along.ok()) return along.status();
  // stableNorm: the square of a tiny direction is 0 in double.
  const double length = along->stableNorm();
  if (!(length > 0.0)) return base::invalid("has no length", field + ".direction");
  return physics::Ray{*from, *along / length};
}

base::Result<std::vector<physics::BodyRef>> read_bodies(const physics::World& world,
                                                        const google::protobuf::RepeatedPtrField<std::string>& names,
                                                        const std::string& field) {
  const std::vector<physics::BodyRef> all = physics::all_bodies(world);
  if (names.empty()) return all;
  constexpr std::size_t most = base::world_bodies_max + base::world_colliders_max;
  if (static_cast<std::size_t>(names.size()) > most) {
    return base::Status(base::StatusCode::limit_exceeded,
                        "names " + std::to_string(names.size()) + "; may be at most " + std::to_string(most), field);
  }
  std::map<std::string_view, physics::BodyRef> by_name;
  for (const physics::BodyRef body : all) by_name.emplace(physics::name_of(world, body), body);
  std::set<physics::BodyRef> seen;
  std::vector<physics::BodyRef> bodies;
  for (int i = 0; i < names.size(); ++i) {
    const auto body = by_name.find(names[i]);
    const auto place = [&] { return std::string(field).append("[").append(std::to_string(i)).append("]"); };
    if (body == by_name.end()) return physics::no_such_body(world, names[i], place());
    if (!seen.insert(body->second).second) return base::invalid("\"" + names[i] + "\" is named twice", place());
    bodies.push_back(body->second);
  }
  return bodies;
}

base::Status check_amount(double value, double limit, const std::string& field) {
  if (!std::isfinite(value)) return base::invalid("is not finite", field);
  if (value < 0.0) return base::invalid("must not be negative", field);
  if (value > limit) return past(value, limit, field);
  return {};
}

base::Result<physics::At> read_at(const v1::Impulse& impulse) {
  switch (impulse.at_case()) {
    case v1::Impulse::kVertex:
      return physics::At(impulse.vertex());
    case v1::Impulse::kNear:
      return read_near(impulse.near(), "impulse.near");
    case v1::Impulse::kRay:
      return read_ray_point(impulse.ray(), "impulse.ray");
    case v1::Impulse::AT_NOT_SET:
      return physics::At(physics::WholeBody{});
  }
  return base::invalid("unknown", "impulse.at");
}

base::Result<physics::At> read_at(const v1::Grab& grab) {
  switch (grab.at_case()) {
    case v1::Grab::kVertex:
      return physics::At(grab.vertex());
    case v1::Grab::kNear:
      return read_near(grab.near(), "grab.near");
    case v1::Grab::kRay:
      return read_ray_point(grab.ray(), "grab.ray");
    case v1::Grab::AT_NOT_SET:
      break;
  }
  return base::invalid("names no vertex, point or ray", "grab.at");
}

base::Status check_time_scale(const v1::Resume& resume) {
  if (!resume.has_time_scale()) return {};
  const double scale = resume.time_scale();
  if (scale >= WorldClock::time_scale_min && scale <= WorldClock::time_scale_max) return {};
  // What is no pace at all, or one that another server might have.
  const bool is_pace = scale > 0.0 && std::isfinite(scale);
  return {is_pace ? base::StatusCode::limit_exceeded : base::StatusCode::invalid_argument,
          "is " + base::number_text(scale) + "; may be " + base::number_text(WorldClock::time_scale_min) + " to " +
              base::number_text(WorldClock::time_scale_max),
          "resume.time_scale"};
}

base::Status check_world_name(const std::string& name, const std::string& field) {
  if (name.empty()) return base::invalid("must not be empty", field);
  if (name.size() > base::name_bytes_max) {
    return {base::StatusCode::limit_exceeded,
            "has " + std::to_string(name.size()) + " bytes; at most " + std::to_string(base::name_bytes_max), field};
  }
  if (name.front() == '.' || !std::all_of(name.begin(), name.end(), is_name_character)) {
    return base::invalid("may hold letters, digits, '.', '_' and '-', and not begin with '.'", field);
  }
  // Where a world can be kept does not depend on whether this server keeps any.
  if (base::Status too_long = persist::DataDir::check_name(name); !too_long.ok()) return too_long.inside(field);
  return {};
}

std::string to_world_name(const std::string& scene_name) {
  constexpr std::string_view behind = "-1024";  // where the name is taken
  std::string name = scene_name.substr(0, base::name_bytes_max - behind.size());
  std::replace_if(name.begin(), name.end(), [](char c) { return !is_name_character(c); }, '-');
  if (name.empty()) name = "world";
  if (name.front() == '.') name.front() = '-';
  while (!persist::DataDir::check_name(name + std::string(behind)).ok()) name.pop_back();
  return name;
}

}  // namespace pneuma::app
