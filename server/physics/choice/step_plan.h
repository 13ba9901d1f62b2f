// A scene compiled to what its explicit and implicit steps need: the tables its meshes share, the bodies that can go
// abreast, and whether anything can touch anything.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "physics/lanes/lane_step.h"

namespace pneuma::physics {

/// Bodies that one fleet kernel can take: the same mesh and stiffness scales, damping or none, lane gas or none, mass
/// shares (each its own) or none, the same vertices pinned.
struct StepGroup {
  std::size_t mesh = 0;                // in StepPlan::meshes
  std::vector<std::uint32_t> members;  // soft bodies, in order
};

template <class Real>
struct StepPlan {
  const LaneKernels<Real>* kernels = nullptr;
  std::vector<std::shared_ptr<const LaneMesh<Real>>> meshes;
  std::vector<std::shared_ptr<const Mesh>> shapes;  // whose tables `meshes` are; one more than once where scales differ
  std::vector<std::size_t> mesh_of_body;
  std::vector<StepGroup> groups;
  bool may_touch = false;  // there are two soft bodies that could meet, or a solid

  [[nodiscard]] const LaneMesh<Real>& mesh_of(std::size_t body) const { return *meshes[mesh_of_body[body]]; }
};

/// Whose bodies the method steps side by side, where that pays.
enum class Abreast { none, of_the_world, of_several_worlds };

/// Tables of `before`, which may be empty, are taken over where the mesh is the same.
template <class Real>
[[nodiscard]] StepPlan<Real> make_step_plan(std::span<const SoftState<Real>> bodies, bool solids, Abreast abreast,
                                            const StepPlan<Real>& before);

/// Whether two bodies of one lane mesh can share a StepGroup.
template <class Real>
[[nodiscard]] bool go_abreast(const SoftState<Real>& a, const SoftState<Real>& b, const Rings& rings);
/// Whether a body of a lane mesh can go beside others at all: the lanes know each force on it, and have room.
template <class Real>
[[nodiscard]] bool fits_abreast(const SoftState<Real>& body, const LaneTables<Real>& lanes,
                                const SubstepContext& context);
/// Whether so many bodies are faster abreast than one by one.
[[nodiscard]] bool makes_fleet(std::size_t bodies, std::size_t width);

/// Bodies that one thread steps in one go: one alone, or several of a group abreast.
struct StepTask {
  std::size_t mesh = 0;
  std::vector<std::uint32_t> bodies;
};

/// The bodies that are awake, cut into tasks: abreast where that is faster than one by one, and each thread has some.
template <class Real>
[[nodiscard]] std::vector<StepTask> cut_into_tasks(const StepPlan<Real>& plan, std::span<const SoftState<Real>> bodies,
                                                   const SubstepContext& context);

}  // namespace pneuma::physics
