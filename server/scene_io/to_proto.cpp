#include <algorithm>
#include <string_view>
#include <unordered_map>
#include <variant>

#include "scene_io/translate.h"
#include "scene_io/vectors.h"

namespace pneuma::scene_io {
namespace {

// Calls visitor(from, to) for the things of each list that have the same name.
template <class From, class To, class Visitor>
void visit_pairs(const std::vector<From>& from, google::protobuf::RepeatedPtrField<To>& to, const Visitor& visitor) {
  std::unordered_map<std::string_view, const From*> by_name;
  for (const From& thing : from) by_name.emplace(thing.name, &thing);
  for (To& thing : to) {
    if (const auto found = by_name.find(thing.name()); found != by_name.end()) visitor(*found->second, thing);
  }
}

struct ShapeWriter {
  v1::Shape& out;
  void operator()(const physics::PlaneShape& plane) const { set(*out.mutable_plane()->mutable_normal(), plane.normal); }
  void operator()(const physics::SphereShape& sphere) const { out.mutable_sphere()->set_radius_m(sphere.radius_m); }
  void operator()(const physics::BoxShape& box) const {
    set(*out.mutable_box()->mutable_half_extents(), box.half_extents_m);
  }
  void operator()(const physics::EllipsoidShape& ellipsoid) const {
    set(*out.mutable_ellipsoid()->mutable_radii(), ellipsoid.radii_m);
  }
  void operator()(const physics::CapsuleShape& capsule) const {
    out.mutable_capsule()->set_radius_m(capsule.radius_m);
    out.mutable_capsule()->set_half_height_m(capsule.half_height_m);
  }
  void operator()(const physics::RoomShape& room) const {
    set(*out.mutable_room()->mutable_half_extents(), room.half_extents_m);
  }
  void operator()(const physics::MeshShape& mesh) const { out.set_mesh(mesh.name); }
  void operator()(const physics::ConvexShape& convex) const { out.set_mesh(convex.name); }
};

}  // namespace

v1::Shape to_proto(const physics::Shape& shape) {
  v1::Shape out;
  std::visit(ShapeWriter{out}, shape);
  return out;
}

v1::Scene to_proto(const physics::Scene& live, const v1::Scene& current) {
  v1::Scene out = current;
  visit_pairs(live.soft_bodies, *out.mutable_soft_bodies(), [](const physics::SoftBody& from, v1::SoftBody& to) {
    if (!from.gas) to.clear_gas();  // it burst
    if (!from.gas || !to.has_gas()) return;
    to.mutable_gas()->set_moles(from.gas->moles);
    to.mutable_gas()->set_temperature_k(from.gas->temperature_k);
  });
  visit_pairs(live.rigid_bodies, *out.mutable_rigid_bodies(), [](const physics::RigidBody& from, v1::RigidBody& to) {
    set(*to.mutable_position(), from.position);
    set(*to.mutable_orientation(), from.orientation);
    set(*to.mutable_velocity(), from.velocity);
    set(*to.mutable_angular_velocity(), from.angular_velocity);
  });
  visit_pairs(live.colliders, *out.mutable_colliders(), [](const physics::Collider& from, v1::Collider& to) {
    set(*to.mutable_position(), from.position);
    set(*to.mutable_orientation(), from.orientation);
  });
  for (int i = out.joints_size() - 1; i >= 0; --i) {
    const auto is_it = [&](const physics::Joint& joint) { return joint.name == out.joints(i).name(); };
    if (std::ranges::none_of(live.joints, is_it)) out.mutable_joints()->DeleteSubrange(i, 1);  // it broke
  }
  return out;
}

}  // namespace pneuma::scene_io
