// Shows that no number of a scene may be NaN or infinite: every one that scene.proto has, found by reflection in a
// scene that sets them all, is put out of bounds by itself and refused under its own path.
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <google/protobuf/message.h>
#include <gtest/gtest.h>

#include "scene_io/translate.h"

namespace pneuma::scene_io {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

/// Sets every message that is not set; lists stay as they are, and of a oneof the case that is set.
void fill(Message& message) {
  const auto* reflection = message.GetReflection();
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor* field = message.GetDescriptor()->field(i);
    const auto* group = field->real_containing_oneof();
    if (group != nullptr && !reflection->HasField(message, field)) continue;
    if (field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
      if (field->is_repeated()) {
        for (int k = 0; k < reflection->FieldSize(message, field); ++k) {
          fill(*reflection->MutableRepeatedMessage(&message, field, k));
        }
      } else {
        fill(*reflection->MutableMessage(&message, field));
      }
    }
  }
}

/// Calls visit(path, set) for each double of the message; set(value) changes it.
using Set = std::function<void(double)>;
void for_each_number(Message& message, const std::string& path,
                     const std::function<void(const std::string&, const Set&)>& visit) {
  const auto* reflection = message.GetReflection();
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor* field = message.GetDescriptor()->field(i);
    const bool is_message = field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE;
    const bool may_be_unset = is_message || field->real_containing_oneof() != nullptr;
    if (!field->is_repeated() && may_be_unset && !reflection->HasField(message, field)) continue;
    const std::string name = path + (path.empty() ? "" : ".") + field->name();
    const int count = field->is_repeated() ? reflection->FieldSize(message, field) : 1;
    for (int k = 0; k < count; ++k) {
      const std::string element = field->is_repeated() ? name + "[" + std::to_string(k) + "]" : name;
      if (is_message) {
        for_each_number(field->is_repeated() ? *reflection->MutableRepeatedMessage(&message, field, k)
                                             : *reflection->MutableMessage(&message, field),
                        element, visit);
      } else if (field->cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE) {
        visit(element, [&message, reflection, field, k](double value) {
          if (field->is_repeated()) {
            reflection->SetRepeatedDouble(&message, field, k, value);
          } else {
            reflection->SetDouble(&message, field, value);
          }
        });
      }
    }
  }
}

v1::Mesh& add_mesh(v1::Scene& scene, const std::string& name) {
  v1::Mesh& mesh = *scene.add_meshes();
  mesh.set_name(name);
  return mesh;
}

/// Every kind of mesh, body, solid and shape.
v1::Scene whole_scene() {
  v1::Scene scene;
  add_mesh(scene, "icosphere").mutable_icosphere()->set_radius_m(1.0);
  v1::Mesh::Grid& grid = *add_mesh(scene, "grid").mutable_grid();
  grid.set_columns(1);
  grid.set_rows(1);
  add_mesh(scene, "box").mutable_box();
  v1::Mesh& mesh = add_mesh(scene, "triangles");
  mesh.mutable_mend();
  v1::Mesh::Triangles& list = *mesh.mutable_triangles();
  list.add_positions();
  list.add_positions()->set_x(1.0);
  list.add_positions()->set_y(1.0);
  list.add_positions()->set_z(1.0);
  for (const std::uint32_t index : {0U, 2U, 1U, 0U, 1U, 3U, 0U, 3U, 2U}) list.add_indices(index);
  v1::SoftBody& body = *scene.add_soft_bodies();
  body.set_name("body");
  body.set_mesh("triangles");
  for (int i = 0; i < 12; ++i) body.add_start_positions(0.1 * i);
  for (int i = 0; i < 4; ++i) body.add_vertex_mass_scale(1.0);
  v1::RigidBody& rigid = *scene.add_rigid_bodies();
  rigid.set_name("rigid");
  rigid.mutable_shape()->mutable_sphere();
  const auto add_collider = [&scene] {
    v1::Collider& collider = *scene.add_colliders();
    collider.set_name("collider-" + std::to_string(scene.colliders_size()));
    return &collider;
  };
  add_collider()->mutable_shape()->mutable_plane();
  add_collider()->mutable_shape()->mutable_sphere();
  add_collider()->mutable_shape()->mutable_box();
  add_collider()->mutable_shape()->mutable_ellipsoid();
  add_collider()->mutable_shape()->mutable_capsule();
  add_collider()->mutable_shape()->mutable_room();
  fill(scene);
  for (v1::Mesh& any : *scene.mutable_meshes()) {
    if (!any.has_triangles()) any.clear_mend();
  }
  for_each_number(scene, "", [](const std::string& path, const Set& set) {
    if (path.find("start_positions") != std::string::npos || path.find("triangles") != std::string::npos) return;
    set(path.ends_with("error_target") ? 0.01 : path.ends_with("weld_m") ? 1e-9 : path.ends_with("ratio") ? 1.4 : 1.0);
  });
  return scene;
}

TEST(NotFinite, TheWholeSceneIsGoodOtherwise) {
  const auto scene = to_physics(whole_scene());
  EXPECT_TRUE(scene.ok()) << scene.status().message();
}

TEST(NotFinite, EveryNumberOfASceneIsRefusedByItsPath) {
  v1::Scene scene = whole_scene();
  std::vector<std::string> paths;
  for_each_number(scene, "", [&paths](const std::string& path, const Set&) { paths.push_back(path); });
  EXPECT_GT(paths.size(), 120U);
  for (const double value : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                             -std::numeric_limits<double>::infinity()}) {
    for (const std::string& wanted : paths) {
      v1::Scene bad = whole_scene();
      for_each_number(bad, "", [&](const std::string& path, const Set& set) {
        if (path == wanted) set(value);
      });
      const auto refused = to_physics(bad);
      ASSERT_FALSE(refused.ok()) << wanted << " = " << value;
      // A vector or rotation that is turned into another form is named as a whole.
      EXPECT_TRUE(wanted.starts_with(refused.status().where()) && !refused.status().where().empty())
          << wanted << " = " << value << " gave " << refused.status().message();
      EXPECT_LE(wanted.size(), refused.status().where().size() + 2) << wanted << ": " << refused.status().message();
    }
  }
}

}  // namespace
}  // namespace pneuma::scene_io
