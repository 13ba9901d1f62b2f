// Where the surfaces of a world are, for those who ask between two ticks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "physics/contact/contact_note.h"
#include "physics/mesh/face_tree.h"
#include "physics/mesh/mesh_tree.h"
#include "physics/scene/shape.h"
#include "physics/world.h"

namespace pneuma::physics {

/// The body or collider of that name.
[[nodiscard]] std::optional<BodyRef> find_body(const World& world, const std::string& name);
[[nodiscard]] const std::string& name_of(const World& world, BodyRef body);
/// All of them: soft bodies, rigid bodies, colliders.
[[nodiscard]] std::vector<BodyRef> all_bodies(const World& world);

/// NOT_FOUND at `field`, with the nearest of the world's bodies and colliders, or with those that there are.
[[nodiscard]] base::Status no_such_body(const World& world, const std::string& name, const std::string& field);

/// The box along the world's axes about a soft or rigid body.
[[nodiscard]] FaceTree::Box box_about(const World& world, BodyRef body);

/// A place on the surface of a body or collider.
struct FoundSurface {
  BodyRef body;
  Vec3d position = Vec3d::Zero();
  Vec3d normal = Vec3d::UnitY();  // unit, out of the body; of an open mesh, as its face is wound
  double distance_m = 0.0;
  /// Of a soft body: the face, and the weights of its vertices in their order.
  struct OnFace {
    std::uint32_t face = 0;
    Vec3d barycentric = Vec3d::Zero();
  };
  std::optional<OnFace> on_face;
};

/// Answers any number of questions about some bodies of a world as it is. The world must not change meanwhile.
class SurfaceQueries {
 public:
  SurfaceQueries(const World& world, const std::vector<BodyRef>& among);
  /// How many faces of meshes were looked at so far, and what the finding of them cost, in such looks.
  [[nodiscard]] std::uint64_t looks() const { return looks_; }

  /// Where the ray first meets a surface within `length_m`; one that begins inside, where it leaves. `distance_m` is
  /// that from its origin.
  [[nodiscard]] std::optional<FoundSurface> first_hit(const Ray& ray,
                                                      double length_m = std::numeric_limits<double>::infinity());
  /// The nearest place of a surface within `within_m`. `distance_m` is that from the point: negative in a solid or a
  /// closed skin. Nearest is what the least way leads to, whether from inside or outside.
  [[nodiscard]] std::optional<FoundSurface> nearest(const Vec3d& point,
                                                    double within_m = std::numeric_limits<double>::infinity());

 private:
  // Of a soft body: where it is now, and how to find a face.
  struct Skin {
    std::vector<Vec3d> positions_m;
    std::shared_ptr<const Mesh> mesh;
    FaceTree tree;
    std::size_t questions = 0;
    bool is_split = false;

    [[nodiscard]] FacesAt surface() const { return {positions_m, mesh->faces}; }
    /// Adds to `looks` what it costs.
    [[nodiscard]] const FaceTree& take_tree(std::uint64_t& looks);
  };
  struct Candidate {
    BodyRef body;
    FaceTree::Box box;  // infinite where it has no end
    Skin skin;          // of soft bodies
    Frame frame;        // of solids, as what follows
    const Shape* shape = nullptr;
    const MeshTree* mesh = nullptr;  // of a collider that is one

    void set_solid(const Frame& at, const Shape& of_shape, const MeshTree* of_mesh);
    /// In the solid's own frame.
    [[nodiscard]] FoundSurface found(const Vec3d& position, const Vec3d& normal, double distance_m) const;
    [[nodiscard]] bool is_endless() const { return !box.low_m.allFinite(); }
  };

  /// The nearest of what `find` finds of candidates, in the order of what they are away at least.
  template <class Distance, class Find>
  [[nodiscard]] std::optional<FoundSurface> least(double within_m, const Distance& distance_m, const Find& find);
  [[nodiscard]] std::optional<FoundSurface> hit(Candidate& candidate, const Ray& ray);
  [[nodiscard]] FoundSurface nearest_of(Candidate& candidate, const Vec3d& point);

  std::vector<Candidate> candidates_;
  std::uint64_t looks_ = 0;
  std::vector<std::pair<double, std::size_t>> order_;  // of a question: what a candidate is away at least, and which
};

}  // namespace pneuma::physics
