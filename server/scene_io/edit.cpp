#include "scene_io/edit.h"

#include <string>
#include <utility>
#include <vector>

#include "base/limits.h"
#include "base/nearest_word.h"
#include "scene_io/finite_numbers.h"
#include "scene_io/quoted.h"

namespace pneuma::scene_io {
namespace {

using base::Status;
using base::StatusCode;

template <class List>
Status no_such(const List& list, const std::string& kind, const std::string& name, const std::string& field = {}) {
  std::vector<std::string> names;
  for (const auto& item : list) names.push_back(item.name());
  return base::not_found("no " + kind + " is named " + in_quotes(name) + base::nearest_or_all(name, names), field);
}

template <class List>
int index_of(const List& list, const std::string& name) {
  for (int i = 0; i < list.size(); ++i) {
    if (list[i].name() == name) return i;
  }
  return -1;
}

/// Soft bodies, rigid bodies and colliders are addressed by name alone.
bool is_taken(const v1::Scene& scene, const std::string& name) {
  return index_of(scene.soft_bodies(), name) >= 0 || index_of(scene.rigid_bodies(), name) >= 0 ||
         index_of(scene.colliders(), name) >= 0;
}

/// `limit` is checked here so that no edit makes a list longer than a scene may have it, however much it adds.
template <class List, class Item>
Status add(List& list, const Item& item, bool taken, std::size_t limit) {
  if (item.name().empty()) return base::invalid("is empty", "name");
  if (taken) return {StatusCode::already_exists, in_quotes(item.name()) + " is taken", "name"};
  if (static_cast<std::size_t>(list.size()) >= limit) {
    return {StatusCode::limit_exceeded, "a world has at most " + std::to_string(limit) + " of these"};
  }
  *list.Add() = item;
  return {};
}

template <class List>
Status remove(List& list, const std::string& kind, const std::string& name) {
  const int index = index_of(list, name);
  if (index < 0) return no_such(list, kind, name);
  list.DeleteSubrange(index, 1);
  return {};
}

Status remove_mesh(v1::Scene& scene, const std::string& name) {
  for (const v1::SoftBody& body : scene.soft_bodies()) {
    if (body.mesh() == name) {
      return {StatusCode::failed_precondition, "soft body " + in_quotes(body.name()) + " is made of it"};
    }
  }
  for (const v1::RigidBody& body : scene.rigid_bodies()) {
    if (body.shape().has_mesh() && body.shape().mesh() == name) {
      return {StatusCode::failed_precondition, "rigid body " + in_quotes(body.name()) + " is made of it"};
    }
  }
  for (const v1::Collider& collider : scene.colliders()) {
    if (collider.shape().has_mesh() && collider.shape().mesh() == name) {
      return {StatusCode::failed_precondition, "collider " + in_quotes(collider.name()) + " is made of it"};
    }
  }
  return remove(*scene.mutable_meshes(), "mesh", name);
}

/// A body that a joint holds stays until the joint is gone.
template <class Held>
Status check_not_held(const v1::Scene& scene, const Held& holds) {
  for (const v1::Joint& joint : scene.joints()) {
    if (!holds(joint.first()) && !holds(joint.second())) continue;
    return {StatusCode::failed_precondition, "joint " + in_quotes(joint.name()) + " holds it"};
  }
  return {};
}

/// Finds what a change names and applies `change` to it.
template <class List, class Change, class Apply>
Status change(List& list, const std::string& kind, const Change& change, Apply apply) {
  const int index = index_of(list, change.name());
  if (index < 0) return no_such(list, kind, change.name(), "name");
  return apply(list[index], change);
}

// In Springs, Gas, Volume, Surface, Drag and Collision every field says whether it is set, so merging is what is meant.
// A vector, rotation or shape is one value, and replaced.

// But a resolution belongs to its method: 32 cells an edge are no 32 samples.
void change_volume(v1::Volume& volume, const v1::Volume& change) {
  if (change.has_method() && change.method() != volume.method()) volume.clear_resolution();
  volume.MergeFrom(change);
}

// And merged lists would be one behind the other.
void change_springs(v1::Springs& springs, const v1::Springs& change) {
  if (!change.vertex_stiffness_scale().empty()) springs.clear_vertex_stiffness_scale();
  springs.MergeFrom(change);
}

Status change_soft_body(v1::SoftBody& body, const v1::SoftBodyChange& change) {
  if (change.remove_gas() && change.has_gas()) return base::invalid("stands beside gas", "remove_gas");
  if (change.has_mass_kg()) body.set_mass_kg(change.mass_kg());
  if (change.has_springs()) change_springs(*body.mutable_springs(), change.springs());
  if (change.has_gas()) body.mutable_gas()->MergeFrom(change.gas());
  if (change.remove_gas()) body.clear_gas();
  if (change.has_volume()) change_volume(*body.mutable_volume(), change.volume());
  if (change.has_pressure_spread()) body.set_pressure_spread(change.pressure_spread());
  if (change.has_surface()) body.mutable_surface()->MergeFrom(change.surface());
  if (change.has_pins()) {
    *body.mutable_pins() = change.pins().vertices();
    body.set_pin_boundary(change.pins().boundary());
  }
  if (change.has_drag()) body.mutable_drag()->MergeFrom(change.drag());
  if (change.has_collision()) body.mutable_collision()->MergeFrom(change.collision());
  if (change.has_vertex_mass_scale()) *body.mutable_vertex_mass_scale() = change.vertex_mass_scale().scale();
  return {};
}

/// What rigid bodies and colliders have alike.
template <class Solid, class Change>
void change_motion(Solid& solid, const Change& change) {
  if (change.has_position()) *solid.mutable_position() = change.position();
  if (change.has_orientation()) *solid.mutable_orientation() = change.orientation();
  if (change.has_velocity()) *solid.mutable_velocity() = change.velocity();
  if (change.has_angular_velocity()) *solid.mutable_angular_velocity() = change.angular_velocity();
  if (change.has_surface()) solid.mutable_surface()->MergeFrom(change.surface());
}

Status change_rigid_body(v1::RigidBody& body, const v1::RigidBodyChange& change) {
  if (change.has_mass_kg()) body.set_mass_kg(change.mass_kg());
  if (change.has_locked()) *body.mutable_locked() = change.locked();
  change_motion(body, change);
  return {};
}

Status change_collider(v1::Collider& collider, const v1::ColliderChange& change) {
  if (change.has_shape()) *collider.mutable_shape() = change.shape();
  change_motion(collider, change);
  return {};
}

v1::Stepping::Precision known_precision(v1::Stepping::Precision precision) {
  return precision == v1::Stepping::PRECISION_UNSPECIFIED ? v1::Stepping::DOUBLE : precision;
}

Status set_stepping(v1::Stepping& stepping, const v1::Stepping& change) {
  if (change.precision() != v1::Stepping::PRECISION_UNSPECIFIED &&
      change.precision() != known_precision(stepping.precision())) {
    return {StatusCode::failed_precondition, "a running world keeps its precision", "precision"};
  }
  stepping.MergeFrom(change);
  return {};
}

Status apply_change(v1::Scene& scene, const v1::SceneChange& made) {
  auto& soft_bodies = *scene.mutable_soft_bodies();
  auto& rigid_bodies = *scene.mutable_rigid_bodies();
  auto& colliders = *scene.mutable_colliders();
  const auto add_named = [&scene](auto& list, const auto& item, std::size_t limit) {
    return add(list, item, is_taken(scene, item.name()), limit);
  };
  Status status;
  switch (made.change_case()) {
    case v1::SceneChange::kAddMesh:
      return add(*scene.mutable_meshes(), made.add_mesh(), index_of(scene.meshes(), made.add_mesh().name()) >= 0,
                 base::world_bodies_max);
    case v1::SceneChange::kAddSoftBody:
      return add_named(soft_bodies, made.add_soft_body(), base::world_bodies_max);
    case v1::SceneChange::kAddRigidBody:
      return add_named(rigid_bodies, made.add_rigid_body(), base::world_bodies_max);
    case v1::SceneChange::kAddCollider:
      return add_named(colliders, made.add_collider(), base::world_colliders_max);
    case v1::SceneChange::kAddJoint:
      return add(*scene.mutable_joints(), made.add_joint(), index_of(scene.joints(), made.add_joint().name()) >= 0,
                 base::world_joints_max);
    case v1::SceneChange::kRemoveJoint:
      return remove(*scene.mutable_joints(), "joint", made.remove_joint());
    case v1::SceneChange::kRemoveSoftBody:
      status = check_not_held(scene, [&](const v1::Anchor& anchor) {
        return anchor.has_soft_body() && anchor.soft_body() == made.remove_soft_body();
      });
      if (!status.ok()) return status;
      return remove(soft_bodies, "soft body", made.remove_soft_body());
    case v1::SceneChange::kRemoveRigidBody:
      status = check_not_held(scene, [&](const v1::Anchor& anchor) {
        return anchor.has_rigid_body() && anchor.rigid_body() == made.remove_rigid_body();
      });
      if (!status.ok()) return status;
      return remove(rigid_bodies, "rigid body", made.remove_rigid_body());
    case v1::SceneChange::kRemoveCollider:
      status = check_not_held(scene, [&](const v1::Anchor& anchor) {
        return anchor.has_collider() && anchor.collider() == made.remove_collider();
      });
      if (!status.ok()) return status;
      return remove(colliders, "collider", made.remove_collider());
    case v1::SceneChange::kRemoveMesh:
      return remove_mesh(scene, made.remove_mesh());
    case v1::SceneChange::kChangeSoftBody:
      return change(soft_bodies, "soft body", made.change_soft_body(), change_soft_body);
    case v1::SceneChange::kChangeRigidBody:
      return change(rigid_bodies, "rigid body", made.change_rigid_body(), change_rigid_body);
    case v1::SceneChange::kChangeCollider:
      return change(colliders, "collider", made.change_collider(), change_collider);
    case v1::SceneChange::kSetGravity:
      *scene.mutable_gravity() = made.set_gravity();
      return {};
    case v1::SceneChange::kSetAtmosphere:
      *scene.mutable_atmosphere() = made.set_atmosphere();
      return {};
    case v1::SceneChange::kSetWind:
      *scene.mutable_atmosphere()->mutable_wind() = made.set_wind();
      return {};
    case v1::SceneChange::kSetStepping:
      return set_stepping(*scene.mutable_stepping(), made.set_stepping());
    case v1::SceneChange::CHANGE_NOT_SET:
      break;
  }
  return base::invalid("holds no change");
}

/// The name in scene.proto of the change that is set.
std::string change_name(const v1::SceneChange& made) {
  const auto* field = v1::SceneChange::descriptor()->FindFieldByNumber(static_cast<int>(made.change_case()));
  return field == nullptr ? std::string() : field->name();
}

}  // namespace

base::Result<v1::Scene> apply_edit(const v1::Scene& scene, const v1::SceneEdit& edit) {
  // Of what a later change overwrites too, which the result does not show.
  if (Status status = check_finite(edit); !status.ok()) return status;
  v1::Scene edited = scene;
  for (int i = 0; i < edit.changes_size(); ++i) {
    const std::string path = "changes[" + std::to_string(i) + "]";
    const std::string name = change_name(edit.changes(i));
    const Status status = apply_change(edited, edit.changes(i));
    if (!status.ok()) return (name.empty() ? status : status.inside(name)).inside(path);
  }
  return edited;
}

std::vector<std::string> renewed_bodies(const v1::SceneEdit& edit) {
  std::vector<std::string> names;
  for (const v1::SceneChange& made : edit.changes()) {
    if (made.has_add_soft_body()) names.push_back(made.add_soft_body().name());
    if (made.has_add_rigid_body()) names.push_back(made.add_rigid_body().name());
    const v1::RigidBodyChange& rigid = made.change_rigid_body();
    if (rigid.has_position() || rigid.has_orientation() || rigid.has_velocity() || rigid.has_angular_velocity()) {
      names.push_back(rigid.name());
    }
  }
  return names;
}

}  // namespace pneuma::scene_io
