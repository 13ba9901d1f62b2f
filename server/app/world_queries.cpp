#include "app/world_queries.h"

#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/request_fields.h"
#include "app/world_state.h"
#include "base/limits.h"
#include "physics/queries.h"
#include "scene_io/vectors.h"

namespace pneuma::app {

using base::Result;
using base::Status;
using scene_io::set;

namespace {

Status check_count(int count, const std::string& field) {
  if (static_cast<std::size_t>(count) <= base::query_points_max) return {};
  return {base::StatusCode::limit_exceeded,
          "are " + std::to_string(count) + "; may be at most " + std::to_string(base::query_points_max), field};
}

/// A question is answered in one go, between two ticks.
Status check_looks(const physics::SurfaceQueries& queries, const std::string& field) {
  if (queries.looks() <= base::query_looks_max) return {};
  return {base::StatusCode::limit_exceeded,
          "take more than " + std::to_string(base::query_looks_max) +
              " looks at faces; ask for fewer at once, or name the bodies",
          field};
}

/// 0 means no bound.
Result<double> read_reach(double reach_m, const std::string& field) {
  if (Status wrong = check_amount(reach_m, std::numeric_limits<double>::max(), field); !wrong.ok()) return wrong;
  return reach_m == 0.0 ? std::numeric_limits<double>::infinity() : reach_m;
}

void write(const physics::World& world, const std::optional<physics::FoundSurface>& found, v1::SurfacePoint& to) {
  if (!found) return;
  to.set_body(physics::name_of(world, found->body));
  set(*to.mutable_position(), found->position);
  set(*to.mutable_normal(), found->normal);
  to.set_distance_m(found->distance_m);
  if (!found->on_face) return;
  to.set_face(found->on_face->face);
  set(*to.mutable_weights(), found->on_face->barycentric);
}

}  // namespace

Result<v1::SurfacePoints> cast_rays(const physics::World& world, const v1::Raycast& request) {
  if (Status wrong = check_count(request.rays_size(), "raycast.rays"); !wrong.ok()) return wrong;
  const auto bodies = read_bodies(world, request.bodies(), "raycast.bodies");
  if (!bodies.ok()) return bodies.status();
  physics::SurfaceQueries queries(world, *bodies);
  v1::SurfacePoints reply;
  for (int i = 0; i < request.rays_size(); ++i) {
    const v1::Raycast::Ray& asked = request.rays(i);
    const std::string field = "raycast.rays[" + std::to_string(i) + "]";
    const auto ray = read_ray(asked.origin(), asked.direction(), field);
    if (!ray.ok()) return ray.status();
    const auto length_m = read_reach(asked.length_m(), field + ".length_m");
    if (!length_m.ok()) return length_m.status();
    write(world, queries.first_hit(*ray, *length_m), *reply.add_points());
    if (Status much = check_looks(queries, "raycast.rays"); !much.ok()) return much;
  }
  return reply;
}

Result<v1::SurfacePoints> find_nearest(const physics::World& world, const v1::NearestPoint& request) {
  if (Status wrong = check_count(request.points_size(), "nearest_point.points"); !wrong.ok()) return wrong;
  const auto bodies = read_bodies(world, request.bodies(), "nearest_point.bodies");
  if (!bodies.ok()) return bodies.status();
  const auto within_m = read_reach(request.within_m(), "nearest_point.within_m");
  if (!within_m.ok()) return within_m.status();
  physics::SurfaceQueries queries(world, *bodies);
  v1::SurfacePoints reply;
  for (int i = 0; i < request.points_size(); ++i) {
    const std::string field = "nearest_point.points[" + std::to_string(i) + "]";
    const auto point = read_vector(request.points(i), base::coordinate_max_m, field);
    if (!point.ok()) return point.status();
    write(world, queries.nearest(*point, *within_m), *reply.add_points());
    if (Status much = check_looks(queries, "nearest_point.points"); !much.ok()) return much;
  }
  return reply;
}

Result<v1::BodyBoxes> find_bodies(const physics::World& world, const v1::BodiesInBox& request) {
  const auto low = read_vector(request.low(), base::coordinate_max_m, "bodies_in_box.low");
  if (!low.ok()) return low.status();
  const auto high = read_vector(request.high(), base::coordinate_max_m, "bodies_in_box.high");
  if (!high.ok()) return high.status();
  if ((low->array() > high->array()).any()) return base::invalid("is below `low` on an axis", "bodies_in_box.high");
  v1::BodyBoxes reply;
  for (const physics::BodyRef body : physics::all_bodies(world)) {
    if (body.kind == physics::BodyKind::collider) continue;
    const physics::FaceTree::Box box = physics::box_about(world, body);
    if (!box.overlaps({*low, *high})) continue;
    v1::BodyBoxes::Box& found = *reply.add_boxes();
    found.set_body(physics::name_of(world, body));
    set(*found.mutable_low(), box.low_m);
    set(*found.mutable_high(), box.high_m);
  }
  return reply;
}

std::optional<Result<v1::ServerMessage>> answer_question(const physics::World& world, const v1::ClientMessage& request,
                                                         const std::string& name, std::uint64_t tick) {
  v1::ServerMessage reply;
  reply.set_request_id(request.request_id());
  using Answer = Result<v1::ServerMessage>;
  const auto tell = [&](auto found, auto* (v1::ServerMessage::*place)()) -> Answer {
    if (!found.ok()) return found.status();
    found->set_world(name);
    found->set_tick(tick);
    *(reply.*place)() = std::move(*found);
    return reply;
  };
  switch (request.request_case()) {
    case v1::ClientMessage::kGetState: {
      const v1::Observe& asked = request.get_state().observe();
      if (Status wrong = check_observed(world, asked); !wrong.ok()) return Answer(wrong.inside("get_state.observe"));
      *reply.mutable_state() = state_of(world, asked, name, tick);
      return Answer(std::move(reply));
    }
    case v1::ClientMessage::kRaycast:
      return tell(cast_rays(world, request.raycast()), &v1::ServerMessage::mutable_surface_points);
    case v1::ClientMessage::kNearestPoint:
      return tell(find_nearest(world, request.nearest_point()), &v1::ServerMessage::mutable_surface_points);
    case v1::ClientMessage::kBodiesInBox:
      return tell(find_bodies(world, request.bodies_in_box()), &v1::ServerMessage::mutable_body_boxes);
    default:
      return std::nullopt;
  }
}

}  // namespace pneuma::app
