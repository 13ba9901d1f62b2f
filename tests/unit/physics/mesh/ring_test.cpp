// Shows that a walk of the rings gives what the paper's sums over edges and faces give, to round-off, on closed meshes
// drawn out of shape at random and on sheets, with springs that are alike and that differ; that a closed body does not
// push or turn itself; and how the vertices are laid out for it.
#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "physics/choice/step_plan.h"
#include "physics/forces/soft_setup.h"
#include "physics/lanes/isa.h"
#include "physics/mesh/mesh_builders.h"

namespace pneuma::physics {
namespace {

std::shared_ptr<const Mesh> sphere(std::uint32_t subdivisions) {
  return *make_icosphere(subdivisions, 0.5);
}

/// Two tetrahedra that share vertex 0: closed, and not a surface there.
std::shared_ptr<const Mesh> hourglass() {
  return *make_mesh({{0, 0, 0}, {1, 0, 1}, {0, 1, 1}, {-1, -1, 1}, {1, 0, -1}, {0, 1, -1}, {-1, -1, -1}},
                    {{0, 2, 1}, {0, 3, 2}, {0, 1, 3}, {1, 2, 3}, {0, 4, 5}, {0, 5, 6}, {0, 6, 4}, {4, 6, 5}});
}

template <class Real>
SoftState<Real> shaken(std::shared_ptr<const Mesh> mesh, unsigned seed) {
  SoftBody body;
  body.name = "body";
  body.mesh = std::move(mesh);
  body.mass_kg = 0.7;
  body.springs = {300.0, 0.4, 0.9};
  if (body.mesh->closed) body.gas = Gas{.moles = 0.03};
  SoftState<Real> state = make_soft_state<Real>(body);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> shake(-0.04, 0.04);
  for (std::size_t i = 0; i < state.x.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      state.x[i][axis] += static_cast<Real>(shake(random));
      state.v[i][axis] += static_cast<Real>(10.0 * shake(random));
    }
  }
  return state;
}

/// Springs between a hundredth and a hundred times as stiff as the body's.
template <class Real>
void vary_stiffness(SoftState<Real>& state, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> exponent(-2.0, 2.0);
  for (std::size_t i = 0; i < state.x.size(); ++i) {
    state.body.springs.vertex_stiffness_scale.push_back(std::pow(10.0, exponent(random)));
  }
}

/// The change of momentum in one step of explicit Euler.
template <class Real>
std::vector<Vec3d> forces_by_rings(SoftState<Real>& state) {
  const StepPlan<Real> plan = make_step_plan<Real>({&state, 1}, false, Abreast::none, {});
  const std::vector<Vec3<Real>> v_before = state.v;
  const SubstepContext context{.integrator = Integrator::explicit_euler, .dt_s = 1.0};
  LaneScratch<Real> scratch;
  step_to_contact<Real>(std::array{&state}, {&plan.mesh_of(0), plan.kernels}, context, scratch);
  std::vector<Vec3d> forces;
  for (std::size_t i = 0; i < v_before.size(); ++i) {
    forces.push_back(static_cast<double>(state.vertex_mass_kg) * (state.v[i] - v_before[i]).template cast<double>());
  }
  state.v = v_before;
  return forces;
}

/// Spring by spring, then the pressure face by face.
template <class Real>
std::vector<Vec3<Real>> forces_by_edges(SoftState<Real>& state) {
  const Springs& springs = state.body.springs;
  std::vector<Vec3<Real>> force(state.x.size(), Vec3<Real>::Zero());
  for (std::size_t i = 0; i < state.body.mesh->edges.size(); ++i) {
    const auto [a, b] = state.body.mesh->edges[i];
    const Vec3<Real> along = state.x[b] - state.x[a];
    const Real length = along.norm();
    const double stiffness_n_m = springs.stiffness_n_m * springs.stiffness_scale({a, b});
    const Real tension = static_cast<Real>(stiffness_n_m) * (length - state.rest_length_m(i)) +
                         static_cast<Real>(springs.damping_n_s_m) * (state.v[b] - state.v[a]).dot(along) / length;
    force[a] += tension / length * along;
    force[b] -= tension / length * along;
  }
  add_other_forces<Real>(state, {.x = state.x, .v = state.v}, nullptr, force);
  return force;
}

template <class Real>
void expect_the_papers_sums(const std::shared_ptr<const Mesh>& mesh, unsigned seed, bool alike, double tolerance) {
  SoftState<Real> by_rings = shaken<Real>(mesh, seed);
  if (!alike) vary_stiffness(by_rings, seed);
  SoftState<Real> by_edges = by_rings;
  const std::vector<Vec3d> ring_forces = forces_by_rings(by_rings);
  const std::vector<Vec3<Real>> edge_forces = forces_by_edges(by_edges);

  double largest = 0.0;
  for (const Vec3d& force : ring_forces) largest = std::max(largest, force.norm());
  for (std::size_t i = 0; i < ring_forces.size(); ++i) {
    EXPECT_LT((ring_forces[i] - edge_forces[i].template cast<double>()).norm(), tolerance * largest) << "vertex " << i;
  }
  EXPECT_NEAR(by_rings.volume_m3, by_edges.volume_m3, tolerance * std::abs(by_edges.volume_m3));
  EXPECT_NEAR(by_rings.pressure_pa, by_edges.pressure_pa, tolerance * std::abs(by_edges.pressure_pa));
}

TEST(Rings, GiveThePapersForcesAndVolume) {
  const std::vector<std::shared_ptr<const Mesh>> meshes{
      sphere(0), sphere(2), sphere(4), *make_box({0.5, 0.4, 0.3}, 7), *make_grid(9, 6, 1.0, 1.0), hourglass()};
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    SCOPED_TRACE(i);
    for (const bool alike : {true, false}) {
      expect_the_papers_sums<double>(meshes[i], static_cast<unsigned>(i), alike, 1e-12);
      expect_the_papers_sums<float>(meshes[i], static_cast<unsigned>(i), alike, 1e-4);
    }
  }
}

TEST(Rings, LeaveAClosedBodysMomentaAlone) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SoftState<double> state = shaken<double>(sphere(2), seed);
    if (seed % 2 == 1) vary_stiffness(state, seed);
    const std::vector<Vec3d> forces = forces_by_rings(state);
    Vec3d force = Vec3d::Zero();
    Vec3d torque = Vec3d::Zero();
    double sizes = 0.0;
    for (std::size_t i = 0; i < forces.size(); ++i) {
      force += forces[i];
      torque += state.x[i].cross(forces[i]);
      sizes += forces[i].norm();
    }
    EXPECT_LT(force.norm(), 1e-13 * sizes);
    EXPECT_LT(torque.norm(), 1e-13 * sizes);
  }
}

TEST(Rings, OfAClosedSurfaceTurnOnceAroundEachVertex) {
  const auto mesh = sphere(3);
  const Rings rings = make_rings(*mesh);
  EXPECT_TRUE(rings.encloses);
  for (std::size_t p = 0; p < rings.packs.size(); ++p) {
    const RingPack& pack = rings.packs[p];
    for (std::size_t i = 0; i < pack.count; ++i) {
      const std::uint32_t vertex = rings.vertices[p * pack_slots + i];
      EXPECT_EQ(rings.slots[vertex], p * pack_slots + i);
      EXPECT_EQ(pack.degree, mesh->face_counts[vertex]);
      for (std::size_t place = 0; place < pack.degree; ++place) {
        const auto at = [&](std::size_t s) {
          return rings.vertices[rings.neighbours[pack.first + s % pack.degree * pack_slots + i] / 4];
        };
        Face face{vertex, at(place), at(place + 1)};
        std::ranges::rotate(face, std::ranges::min_element(face));
        EXPECT_TRUE(std::ranges::any_of(mesh->faces,
                                        [&](Face other) {
                                          std::ranges::rotate(other, std::ranges::min_element(other));
                                          return other == face;
                                        }))
            << "vertex " << vertex << " at place " << place;
      }
    }
  }
}

TEST(Rings, OfTwoFansOrABorderEncloseNothing) {
  EXPECT_FALSE(make_rings(*hourglass()).encloses);
  EXPECT_FALSE(make_rings(**make_grid(3, 3, 1.0, 1.0)).encloses);
  EXPECT_TRUE(make_rings(**make_box({1, 1, 1}, 3)).encloses);
}

TEST(Rings, KeepNeighboursCloseOnALargeMesh) {
  const auto mesh = sphere(5);
  const Rings rings = make_rings(*mesh);
  EXPECT_LT(rings.slot_count(), mesh->positions_m.size() * 102 / 100);
  std::size_t near = 0;
  for (std::size_t p = 0; p < rings.packs.size(); ++p) {
    for (std::size_t entry = 0; entry < rings.packs[p].degree * pack_slots; ++entry) {
      const std::size_t slot = p * pack_slots + entry % pack_slots;
      const std::size_t neighbour = rings.neighbours[rings.packs[p].first + entry] / 4;
      near += std::max(slot, neighbour) - std::min(slot, neighbour) < 1'024 ? 1U : 0U;
    }
  }
  EXPECT_GT(near, rings.neighbours.size() * 3 / 4);
}

}  // namespace
}  // namespace pneuma::physics
