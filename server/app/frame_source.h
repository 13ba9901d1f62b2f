// What the frames of a world show, whether the world is stepped or played from a recording.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "codec/simulated_motion.h"
#include "physics/mesh/mesh.h"
#include "physics/world.h"
#include "pneuma/v1/frame.pb.h"

namespace pneuma::app {

/// One number each of a soft body, as v1::Scalars tells them.
struct BodyScalars {
  double volume_m3 = 0.0;
  double pressure_pa = 0.0;
  double kinetic_j = 0.0;
  double elastic_j = 0.0;
  bool asleep = false;
};

/// A vertex that is held off another body.
struct TouchedVertex {
  std::uint32_t vertex = 0;
  bool is_of_soft_body = false;  // the other; else a solid, counted as poses() counts them
  std::size_t other = 0;
  physics::Vec3d normal = physics::Vec3d::Zero();  // unit, out of the other
};

/// What mechanics are told for.
struct MechanicsTerms {
  double frame_s = 0.0;         // from one frame to the next
  double grid_step_m = 0.0;     // of the frames
  std::uint64_t work_left = 0;  // of codec::simulated_work(): what they may take
};

class FrameSource {
 public:
  virtual ~FrameSource() = default;
  [[nodiscard]] virtual double time_s() const = 0;
  [[nodiscard]] virtual double tick_period_s() const = 0;
  [[nodiscard]] virtual std::size_t soft_body_count() const = 0;
  [[nodiscard]] virtual const std::string& soft_body_name(std::size_t index) const = 0;
  /// The faces, and where their vertices are in some shape of the body, from which coarser versions are made.
  [[nodiscard]] virtual std::shared_ptr<const physics::Mesh> mesh(std::size_t index) const = 0;
  /// Writes x, y, z of each vertex in order.
  virtual void copy_positions(std::size_t index, std::span<double> out_m) const = 0;
  /// Where the mesh is itself a coarser version: which of the other one's vertices its own are. Otherwise empty.
  [[nodiscard]] virtual const std::vector<std::uint32_t>& kept_vertices(std::size_t index) const = 0;
  /// A recording may have none, of velocities, of scalars and of contacts.
  [[nodiscard]] virtual bool has_velocities() const = 0;
  virtual void copy_velocities(std::size_t index, std::span<double> out_m_s) const = 0;
  [[nodiscard]] virtual bool has_scalars() const = 0;
  [[nodiscard]] virtual BodyScalars scalars(std::size_t index) const = 0;
  [[nodiscard]] virtual bool has_contacts() const = 0;
  /// By vertex; a vertex may be held off several, and by several walls of one.
  [[nodiscard]] virtual std::vector<TouchedVertex> contacts(std::size_t index) const = 0;
  /// What its motion from frame to frame follows from, where that tells it well; nothing of a recording.
  /// Takes from terms.work_left.
  [[nodiscard]] virtual std::optional<codec::Mechanics> mechanics(std::size_t, const codec::MeshOrder&,
                                                                  MechanicsTerms&) const {
    return std::nullopt;
  }
  /// Appends the solids, in the order of poses().
  virtual void describe_solids(v1::Layout& layout) const = 0;
  [[nodiscard]] virtual std::vector<physics::Pose> poses() const = 0;
  /// Appends the joints; their soft bodies are counted as the source counts them, their vertices those of the full
  /// mesh.
  virtual void describe_joints(v1::Layout&) const {}
};

/// A world that is stepped: its solids are the rigid bodies, then the colliders.
class LiveFrames final : public FrameSource {
 public:
  explicit LiveFrames(const physics::World& world) : world_(world) {}
  [[nodiscard]] double time_s() const override { return world_.time_s(); }
  [[nodiscard]] double tick_period_s() const override { return world_.tick_period_s(); }
  [[nodiscard]] std::size_t soft_body_count() const override { return world_.soft_body_count(); }
  [[nodiscard]] const std::string& soft_body_name(std::size_t index) const override {
    return world_.soft_body(index).name;
  }
  [[nodiscard]] std::shared_ptr<const physics::Mesh> mesh(std::size_t index) const override {
    return world_.soft_body(index).mesh;
  }
  void copy_positions(std::size_t index, std::span<double> out_m) const override {
    world_.copy_positions(index, out_m);
  }
  [[nodiscard]] const std::vector<std::uint32_t>& kept_vertices(std::size_t) const override { return all_vertices_; }
  [[nodiscard]] bool has_velocities() const override { return true; }
  void copy_velocities(std::size_t index, std::span<double> out_m_s) const override {
    world_.copy_velocities(index, out_m_s);
  }
  [[nodiscard]] bool has_scalars() const override { return true; }
  [[nodiscard]] BodyScalars scalars(std::size_t index) const override;
  [[nodiscard]] bool has_contacts() const override { return true; }
  /// Those that the world notes (World::note_contacts).
  [[nodiscard]] std::vector<TouchedVertex> contacts(std::size_t index) const override;
  [[nodiscard]] std::optional<codec::Mechanics> mechanics(std::size_t index, const codec::MeshOrder& order,
                                                          MechanicsTerms& terms) const override;
  void describe_solids(v1::Layout& layout) const override;
  [[nodiscard]] std::vector<physics::Pose> poses() const override;
  void describe_joints(v1::Layout& layout) const override;

 private:
  const physics::World& world_;
  const std::vector<std::uint32_t> all_vertices_;  // none named
};

}  // namespace pneuma::app
