#include "physics/choice/step_plan.h"

#include <algorithm>

#include "physics/lanes/isa.h"

namespace pneuma::physics {

namespace {

// A fleet's lanes cost the same, used or not. Measured on balls of 162 vertices: a body alone takes as long as 0.4
// (AVX-512) to 0.6 (AVX2) of a full fleet's lanes.
constexpr std::size_t fleet_share_min = 2;  // fleets are at least half full

// What a fleet works on must stay in the second cache level; bodies one by one take a width'th of it.
constexpr std::size_t fleet_bytes_max = std::size_t{512} * 1024;

// Of the mesh's edges; empty where the body has no factors.
std::vector<double> stiffness_scales(const Mesh& mesh, const Springs& springs) {
  std::vector<double> scales;
  if (springs.vertex_stiffness_scale.empty()) return scales;
  for (const Edge& edge : mesh.edges) scales.push_back(springs.stiffness_scale(edge));
  return scales;
}

// Where the plan has the tables of such a body: plan.meshes.size() where it has not.
template <class Real>
std::size_t mesh_in(const StepPlan<Real>& plan, const SoftBody& body) {
  std::size_t i = 0;
  while (i < plan.meshes.size() && !(same_mesh(*plan.shapes[i], *body.mesh) &&
                                     plan.meshes[i]->vertex_stiffness_scale == body.springs.vertex_stiffness_scale)) {
    ++i;
  }
  return i;
}

template <class Real>
std::shared_ptr<const LaneMesh<Real>> lane_mesh_of(const SoftBody& body, const LaneKernels<Real>& kernels,
                                                   const StepPlan<Real>& before) {
  const Mesh& mesh = *body.mesh;
  auto lanes = std::make_shared<LaneMesh<Real>>();
  if (before.kernels == &kernels) {
    if (const std::size_t known = mesh_in(before, body); known < before.meshes.size()) return before.meshes[known];
    const auto shape = std::ranges::find_if(before.shapes, [&](const auto& other) { return same_mesh(*other, mesh); });
    if (shape != before.shapes.end()) {
      lanes->rings = before.meshes[static_cast<std::size_t>(shape - before.shapes.begin())]->rings;
    }
  }
  if (lanes->rings.vertices.empty()) lanes->rings = make_rings(mesh);
  lanes->lengths_m = ring_lengths_m<Real>(mesh, lanes->rings, kernels.slot_of_place);
  if (body.springs.vertex_stiffness_scale.empty()) return lanes;
  lanes->vertex_stiffness_scale = body.springs.vertex_stiffness_scale;
  lanes->stiffness_scales =
      along_rings<Real>(mesh, lanes->rings, stiffness_scales(mesh, body.springs), kernels.slot_of_place);
  return lanes;
}

// Whether fleets work out the pull of each spring once and store it, or twice, at either end. Measured on balls of 162
// vertices: where 16 square roots take about as long as 8, twice is faster.
template <class Real>
bool pulls_come_first(const LaneKernels<Real>& kernels) {
  return !(std::is_same_v<Real, float> && kernels.width == 16 && has_fast_wide_roots());
}

// The moves of bodies that may touch, and stored pulls, come on top.
template <class Real>
std::size_t arrays_of(Integrator integrator, bool gas, bool weighed) {
  const std::size_t staged = integrator == Integrator::midpoint ? 2 : integrator == Integrator::rk4 ? 4 : 0;
  return 3 + staged + (gas ? 1 : 0) + (weighed ? 1 : 0);
}

}  // namespace

bool makes_fleet(std::size_t bodies, std::size_t width) {
  return bodies > 1 && bodies * fleet_share_min >= width;
}

template <class Real>
bool go_abreast(const SoftState<Real>& a, const SoftState<Real>& b, const Rings& rings) {
  const auto damped = [](const SoftState<Real>& body) { return body.body.springs.damping_n_s_m > 0.0; };
  return damped(a) == damped(b) && has_lane_gas(a, rings) == has_lane_gas(b, rings) &&
         a.mass_shares.empty() == b.mass_shares.empty() && a.pinned == b.pinned;
}

template <class Real>
bool fits_abreast(const SoftState<Real>& body, const LaneTables<Real>& lanes, const SubstepContext& context) {
  const Rings& rings = lanes.mesh->rings;
  const std::size_t arrays = arrays_of<Real>(context.integrator, has_lane_gas(body, rings), !body.mass_shares.empty());
  return rings.slot_count() * 3 * lanes.kernels->width * sizeof(Real) * arrays <= fleet_bytes_max &&
         !has_other_forces(body, rings, context.surroundings);
}

template <class Real>
StepPlan<Real> make_step_plan(std::span<const SoftState<Real>> bodies, bool solids, Abreast abreast,
                              const StepPlan<Real>& before) {
  StepPlan<Real> plan;
  plan.kernels = &lane_kernels<Real>(isa_in_use());
  for (std::uint32_t i = 0; i < bodies.size(); ++i) {
    const SoftBody& body = bodies[i].body;
    plan.mesh_of_body.push_back(mesh_in(plan, body));
    if (plan.mesh_of_body[i] == plan.meshes.size()) {
      plan.shapes.push_back(body.mesh);
      plan.meshes.push_back(lane_mesh_of(body, *plan.kernels, before));
    }
    const auto group = std::ranges::find_if(plan.groups, [&](const StepGroup& other) {
      return other.mesh == plan.mesh_of_body[i] &&
             go_abreast(bodies[other.members.front()], bodies[i], plan.mesh_of(i).rings);
    });
    if (group != plan.groups.end()) {
      group->members.push_back(i);
    } else {
      plan.groups.push_back({plan.mesh_of_body[i], {i}});
    }
  }
  const auto meets_soft = [](const SoftState<Real>& body) { return body.body.collision.soft != SoftCollision::none; };
  const auto meets_itself = [](const SoftState<Real>& body) { return body.body.collision.self; };
  plan.may_touch = solids || std::ranges::count_if(bodies, meets_soft) > 1 || std::ranges::any_of(bodies, meets_itself);
  for (const StepGroup& group : plan.groups) {
    std::shared_ptr<const LaneMesh<Real>>& lanes = plan.meshes[group.mesh];
    const bool is_batched = abreast == Abreast::of_several_worlds && !plan.may_touch;
    const bool in_fleet =
        is_batched || (abreast != Abreast::none && makes_fleet(group.members.size(), plan.kernels->width));
    if (in_fleet && pulls_come_first(*plan.kernels) && lanes->edges.lengths_m.empty()) {
      auto with_edges = std::make_shared<LaneMesh<Real>>(*lanes);
      const Springs& springs = bodies[group.members.front()].body.springs;
      with_edges->edges = make_ring_edges<Real>(*plan.shapes[group.mesh], lanes->rings,
                                                stiffness_scales(*plan.shapes[group.mesh], springs));
      lanes = std::move(with_edges);
    }
  }
  return plan;
}

template <class Real>
std::vector<StepTask> cut_into_tasks(const StepPlan<Real>& plan, std::span<const SoftState<Real>> bodies,
                                     const SubstepContext& context) {
  std::vector<StepTask> tasks;
  const std::size_t width = plan.kernels->width;
  const std::size_t threads = context.workers != nullptr ? context.workers->threads() : 1;
  for (const StepGroup& group : plan.groups) {
    const LaneTables<Real> lanes{plan.meshes[group.mesh].get(), plan.kernels};
    std::vector<std::uint32_t> abreast;
    for (const std::uint32_t i : group.members) {
      if (!bodies[i].is_awake()) continue;
      if (fits_abreast(bodies[i], lanes, context)) {
        abreast.push_back(i);
      } else {
        tasks.push_back({group.mesh, {i}});
      }
    }
    const std::size_t a_thread = (abreast.size() + threads - 1) / threads;
    for (auto rest = std::span(abreast); !rest.empty();) {
      const std::size_t taken = std::min({rest.size(), width, a_thread});
      if (makes_fleet(taken, width)) {
        tasks.push_back({group.mesh, {rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(taken)}});
      } else {
        for (const std::uint32_t i : rest.first(taken)) tasks.push_back({group.mesh, {i}});
      }
      rest = rest.subspan(taken);
    }
  }
  return tasks;
}

#define PNEUMA_INSTANTIATE(Real)                                                                               \
  template bool go_abreast<Real>(const SoftState<Real>&, const SoftState<Real>&, const Rings&);                \
  template bool fits_abreast<Real>(const SoftState<Real>&, const LaneTables<Real>&, const SubstepContext&);    \
  template StepPlan<Real> make_step_plan<Real>(std::span<const SoftState<Real>>, bool, Abreast,                \
                                               const StepPlan<Real>&);                                         \
  template std::vector<StepTask> cut_into_tasks<Real>(const StepPlan<Real>&, std::span<const SoftState<Real>>, \
                                                      const SubstepContext&);
PNEUMA_INSTANTIATE(float)
PNEUMA_INSTANTIATE(double)
#undef PNEUMA_INSTANTIATE

}  // namespace pneuma::physics
