// Shows that a body has the same bits however it is stepped: on every instruction set of this machine, alone or in a
// fleet of any size, with any number of threads, by whole ticks or substep by substep because others might touch it,
// and across a snapshot. The golden hashes hold every compiler and machine to the same bits.
#include "numerics/worlds.h"
#include "physics/choice/step_plan.h"
#include "physics/forces/soft_setup.h"
#include "physics/lanes/isa.h"

#define PNEUMA_LANES lanes_one_abreast
#include "physics/lanes/lane_kernel_source.h"
#include "physics/mesh/mesh_builders.h"

namespace pneuma::physics {
namespace {

constexpr std::uint64_t ticks = 12;

/// One of many balls that differ in everything but mesh, damping or none, and pins.
SoftBody ball(const std::shared_ptr<const Mesh>& mesh, std::size_t index) {
  const auto number = static_cast<double>(index);
  SoftBody body;
  body.name = std::string("ball-").append(std::to_string(index));
  body.mesh = mesh;
  body.position = {3.0 * number, 0.1 * number, 0.0};
  body.orientation = Quatd(1.0, 0.05 * number, 0.1 * number, 0.2).normalized();
  body.velocity = {0.0, 0.2 * number, 1.0};
  body.angular_velocity = {0.5, 0.1 * number, 0.0};
  body.mass_kg = 1.0 + 0.05 * number;
  body.springs = {200.0 + 10.0 * number, 0.3, 0.8 + 0.01 * number};
  body.gas = Gas{.moles = 0.01 + 0.001 * number};
  body.gas->law = index % 3 == 1 ? GasLaw::adiabatic : GasLaw::isothermal;
  body.gas->leak_mol_s_pa = index % 4 == 1 ? 1e-6 : 0.0;
  body.collision.soft = SoftCollision::none;
  return body;
}

Scene empty_scene(Integrator integrator, Precision precision) {
  Scene scene;
  scene.gravity = {0.3, -9.81, 0.0};
  scene.atmosphere.pressure_pa = 10.0;
  scene.stepping = {.rate_hz = 60,
                    .substeps = 8,
                    .integrator = integrator,
                    .precision = precision,
                    .on_unstable = OnUnstable::allow};  // only the bits matter here
  return scene;
}

Scene fleet(std::size_t count, Integrator integrator, Precision precision) {
  Scene scene = empty_scene(integrator, precision);
  const auto mesh = *make_icosphere(2, 0.5);
  for (std::size_t i = 0; i < count; ++i) scene.soft_bodies.push_back(ball(mesh, i));
  return scene;
}

/// Each body's vertices have masses of their own.
Scene weighed(Scene scene) {
  for (std::size_t i = 0; i < scene.soft_bodies.size(); ++i) {
    SoftBody& body = scene.soft_bodies[i];
    for (std::size_t k = 0; k < body.mesh->positions_m.size(); ++k) {
      body.vertex_mass_scale.push_back(1.0 + static_cast<double>((3 * k + i) % 7));
    }
  }
  return scene;
}

/// Large enough to be shared among threads.
Scene large_ball(Integrator integrator, Precision precision) {
  Scene scene = empty_scene(integrator, precision);
  scene.soft_bodies = {ball(*make_icosphere(5, 0.5), 3)};
  scene.soft_bodies[0].mass_kg = 3000.0;  // that its steps keep whole
  scene.stepping.substeps = 2;
  return scene;
}

/// A scene with what the kernels do not know, and what they leave out: wind, pins, a sheet, a mesh of mixed degrees.
Scene mixture(Integrator integrator, Precision precision) {
  Scene scene = fleet(3, integrator, precision);
  scene.atmosphere.density_kg_m3 = 1.2;
  scene.atmosphere.wind = {2.0, 0.5, -1.0};
  SoftBody cloth = ball(*make_grid(12, 7, 1.0, 1.0), 20);
  cloth.gas.reset();
  cloth.pin_boundary = true;
  cloth.drag = {1.0, 0.1};
  SoftBody box = ball(*make_box({0.5, 0.4, 0.3}, 5), 21);
  box.springs.damping_n_s_m = 0.0;
  box.pins = {0, 17};
  SoftBody spread = ball(scene.soft_bodies[0].mesh, 22);
  spread.pressure_spread = PressureSpread::vertex_normals;
  scene.soft_bodies.insert(scene.soft_bodies.end(), {cloth, box, spread});
  return scene;
}

/// Balls, one of them that resists folding, and a stone that meet in a room that turns.
Scene touching(Precision precision) {
  Scene scene = fleet(3, Integrator::midpoint, precision);
  for (SoftBody& body : scene.soft_bodies) {
    body.position.x() *= 0.3;
    body.collision.soft = SoftCollision::bounds;
  }
  scene.soft_bodies[2].springs.bend_stiffness_n_m = 0.01;
  RigidBody stone;
  stone.name = "stone";
  stone.shape = SphereShape{0.2};
  stone.position = {0.4, 0.7, 0.0};
  stone.angular_velocity = {1.0, 2.0, 3.0};
  scene.rigid_bodies = {stone};
  Collider room;
  room.name = "room";
  room.shape = RoomShape{Vec3d(2.5, 0.7, 1.5)};
  room.angular_velocity = {0.0, 0.0, 0.5};
  room.surface = {.restitution = 0.4, .friction = 0.5};
  scene.colliders = {room};
  return scene;
}

/// One factor for each vertex of a mesh, from a tenth to ten.
std::vector<double> some_factors(const Mesh& mesh) {
  std::vector<double> factors;
  for (const Vec3d& x : mesh.positions_m) factors.push_back(std::pow(10.0, std::sin(40.0 * x.x() + 70.0 * x.y())));
  return factors;
}

/// The same factors for bodies of one mesh.
Scene with_unlike_springs(Scene scene) {
  for (SoftBody& body : scene.soft_bodies) body.springs.vertex_stiffness_scale = some_factors(*body.mesh);
  return scene;
}

/// An implicit substep takes as long as many explicit ones, and shows as much.
Scene of_few_solves(Scene scene) {
  if (!is_explicit(scene.stepping.integrator)) scene.stepping.substeps = 2;
  return scene;
}

std::uint64_t hash_after(Scene scene, std::size_t threads) {
  World world = make_world(std::move(scene));
  run_ticks(world, ticks, threads);
  return world.state_hash();
}

std::vector<Vec3d> end_of(Scene scene, std::size_t body) {
  World world = make_world(std::move(scene));
  run_ticks(world, ticks);
  return positions_of(world, body);
}

/// Runs each case on each instruction set that this machine has.
class Lanes : public testing::TestWithParam<Precision> {
 protected:
  void TearDown() override { ASSERT_TRUE(use_isa(isa_names[static_cast<std::size_t>(best_)]).ok()); }
  template <class Case>
  static void on_each_isa(const Case& run) {
    for (std::size_t i = 0; i < isa_names.size(); ++i) {
      if (!has_isa(static_cast<Isa>(i))) continue;
      SCOPED_TRACE(isa_names[i]);
      ASSERT_TRUE(use_isa(isa_names[i]).ok());
      run();
    }
  }
  const Isa best_ = isa_in_use();
};

constexpr std::array lane_integrators{Integrator::explicit_euler, Integrator::symplectic_euler,
                                      Integrator::midpoint,       Integrator::rk4,
                                      Integrator::implicit_euler, Integrator::tr_bdf2};

TEST_P(Lanes, GiveTheSameHashOnEveryInstructionSet) {
  for (const Integrator integrator : lane_integrators) {
    std::vector<std::uint64_t> hashes;
    on_each_isa([&] { hashes.push_back(hash_after(fleet(19, integrator, GetParam()), 1)); });
    for (const std::uint64_t hash : hashes) EXPECT_EQ(hash, hashes.front());
  }
}

TEST_P(Lanes, GiveABodyTheSameBitsAloneAndInAFleetOfAnySize) {
  for (const Integrator integrator :
       {Integrator::symplectic_euler, Integrator::rk4, Integrator::implicit_euler, Integrator::tr_bdf2}) {
    on_each_isa([&] {
      Scene alone = of_few_solves(empty_scene(integrator, GetParam()));
      alone.soft_bodies = {ball(*make_icosphere(2, 0.5), 0)};
      const std::vector<Vec3d> expected = end_of(alone, 0);
      for (const std::size_t count : {2U, 3U, 4U, 5U, 8U, 9U, 15U, 16U, 17U, 24U, 33U, 40U}) {
        EXPECT_TRUE(end_of(of_few_solves(fleet(count, integrator, GetParam())), 0) == expected) << count << " abreast";
      }
      alone.soft_bodies = {ball(*make_icosphere(2, 0.5), 11)};
      EXPECT_TRUE(end_of(of_few_solves(fleet(16, integrator, GetParam())), 11) == end_of(alone, 0));
    });
  }
}

/// A fleet that falls to a floor; the second body bursts on the way.
Scene falling(std::size_t count, Integrator integrator, Precision precision) {
  Scene scene = fleet(count, integrator, precision);
  for (SoftBody& body : scene.soft_bodies) {
    body.position.y() = 0.0;
    body.velocity.y() = 0.0;
  }
  if (count > 1) scene.soft_bodies[1].gas->burst_pressure_pa = 1.0;
  Collider floor;
  floor.name = "floor";
  floor.shape = PlaneShape{};
  floor.position.y() = -0.55;
  floor.surface.friction = 0.5;
  scene.colliders = {floor};
  return scene;
}

TEST_P(Lanes, GiveABodyThatTouchesTheSameBitsAloneAndInAFleetOfAnySize) {
  for (const Integrator integrator : {Integrator::symplectic_euler, Integrator::midpoint, Integrator::rk4}) {
    on_each_isa([&] {
      const std::vector<Vec3d> expected = end_of(falling(1, integrator, GetParam()), 0);
      const auto lowest = [](const Vec3d& a, const Vec3d& b) { return a.y() < b.y(); };
      EXPECT_LT(std::ranges::min_element(expected, lowest)->y(), -0.54) << "it is on the floor";
      for (const std::size_t count : {2U, 9U, 17U}) {
        EXPECT_TRUE(end_of(falling(count, integrator, GetParam()), 0) == expected) << count << " abreast";
      }
      Scene pinned = falling(16, integrator, GetParam());
      for (SoftBody& body : pinned.soft_bodies) body.pins = {0, 17};
      Scene unlike = with_unlike_springs(falling(16, integrator, GetParam()));
      unlike.stepping.substeps = 32;  // for the stiffest: a body that runs away is stopped
      for (const Scene& many :
           {falling(16, integrator, GetParam()), weighed(falling(16, integrator, GetParam())), unlike, pinned}) {
        World world = make_world(many);
        run_ticks(world, ticks);
        for (const std::size_t i : {1U, 11U}) {
          Scene alone = many;
          alone.soft_bodies = {many.soft_bodies[i]};
          EXPECT_TRUE(positions_of(world, i) == end_of(alone, 0)) << i;
        }
        EXPECT_EQ(hash_after(many, 2), world.state_hash());
      }
    });
  }
}

TEST_P(Lanes, GiveVerticesOfDifferentMassTheSameBitsOnEveryPath) {
  std::vector<std::uint64_t> hashes;
  on_each_isa([&] {
    for (const Integrator integrator : {Integrator::symplectic_euler, Integrator::midpoint, Integrator::rk4}) {
      const Scene many = weighed(fleet(17, integrator, GetParam()));
      const std::uint64_t hash = hash_after(many, 1);
      hashes.push_back(hash);
      for (const std::size_t threads : {2U, 16U}) EXPECT_EQ(hash_after(many, threads), hash) << threads;
      Scene alone = many;
      alone.soft_bodies = {many.soft_bodies[11]};
      EXPECT_TRUE(end_of(many, 11) == end_of(alone, 0));
    }
    for (const Scene& scene :
         {weighed(large_ball(Integrator::midpoint, GetParam())), weighed(mixture(Integrator::midpoint, GetParam())),
          weighed(mixture(Integrator::tr_bdf2, GetParam())), weighed(touching(GetParam()))}) {
      const std::uint64_t hash = hash_after(scene, 1);
      hashes.push_back(hash);
      for (const std::size_t threads : {2U, 16U}) EXPECT_EQ(hash_after(scene, threads), hash) << threads;
    }
    World world = make_world(weighed(mixture(Integrator::midpoint, GetParam())));
    run_ticks(world, ticks);
    World other = make_world(world.scene());
    ASSERT_TRUE(other.restore(world.snapshot()).ok());
    run_ticks(world, ticks);
    run_ticks(other, ticks);
    EXPECT_EQ(other.state_hash(), world.state_hash());
  });
  for (std::size_t i = 7; i < hashes.size(); ++i) EXPECT_EQ(hashes[i], hashes[i - 7]) << i;
}

TEST_P(Lanes, GiveTheSameHashOnAnyNumberOfThreads) {
  on_each_isa([&] {
    const Scene many = fleet(40, Integrator::midpoint, GetParam());
    const Scene large = large_ball(Integrator::midpoint, GetParam());
    for (const Scene& scene :
         {many, large, mixture(Integrator::midpoint, GetParam()), fleet(7, Integrator::implicit_euler, GetParam()),
          mixture(Integrator::tr_bdf2, GetParam())}) {
      const std::uint64_t hash = hash_after(scene, 1);
      for (const std::size_t threads : {2U, 3U, 4U, 5U}) EXPECT_EQ(hash_after(scene, threads), hash) << threads;
    }
  });
}

// Each thread moves copies of what its own vertices see of others': they must see all that acts on those.
TEST_P(Lanes, GiveALargeBodyTheSameHashOnAnyNumberOfThreadsWhateverActsOnIt) {
  std::vector<Scene> scenes;
  for (const Integrator integrator :
       {Integrator::explicit_euler, Integrator::symplectic_euler, Integrator::midpoint, Integrator::rk4}) {
    scenes.push_back(large_ball(integrator, GetParam()));
    SoftBody& body = scenes.back().soft_bodies[0];
    for (std::uint32_t vertex = 0; vertex < 10'242; vertex += 97) body.pins.push_back(vertex);
  }
  Scene bending = large_ball(Integrator::midpoint, GetParam());
  bending.soft_bodies[0].springs.bend_stiffness_n_m = 0.01;
  bending.soft_bodies[0].springs.damping_n_s_m = 0.0;
  Scene windy = large_ball(Integrator::symplectic_euler, GetParam());
  windy.atmosphere.density_kg_m3 = 1.2;
  windy.atmosphere.wind = {2.0, 0.5, -1.0};
  windy.soft_bodies[0].drag = {1.0, 0.1};
  Scene other_volume = large_ball(Integrator::symplectic_euler, GetParam());
  other_volume.soft_bodies[0].pressure_spread = PressureSpread::vertex_normals;
  Scene empty = large_ball(Integrator::symplectic_euler, GetParam());
  empty.soft_bodies[0].gas.reset();
  Scene loose = empty;
  loose.soft_bodies[0].springs = {.stiffness_n_m = 0.0, .damping_n_s_m = 0.0};
  Scene leaking = large_ball(Integrator::symplectic_euler, GetParam());
  leaking.soft_bodies[0].gas->leak_mol_s_pa = 1e-6;
  scenes.push_back(weighed(large_ball(Integrator::midpoint, GetParam())));
  Scene runaway = large_ball(Integrator::symplectic_euler, GetParam());
  runaway.soft_bodies[0].springs.stiffness_n_m = 1e9;
  runaway.soft_bodies[0].mass_kg = 1.0;
  Scene watched = large_ball(Integrator::midpoint, GetParam());
  watched.colliders.emplace_back();
  watched.colliders[0].name = "far";
  watched.colliders[0].shape = SphereShape{0.1};
  watched.colliders[0].position = {0.0, -1e4, 0.0};
  scenes.insert(scenes.end(), {bending, windy, other_volume, empty, loose, leaking, watched});
  scenes.push_back(runaway);
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    const std::uint64_t hash = hash_after(scenes[i], 1);
    for (const std::size_t threads : {2U, 3U, 16U}) {
      EXPECT_EQ(hash_after(scenes[i], threads), hash) << "scene " << i << ", " << threads << " threads";
    }
  }
}

TEST_P(Lanes, GiveALargeBodyTheSameHashWhateverIsDoneToItBetweenTicks) {
  const auto hash_on = [&](std::size_t threads) {
    World world = make_world(large_ball(Integrator::symplectic_euler, GetParam()));
    run_ticks(world, 2, threads);
    EXPECT_TRUE(world.apply_impulse("ball-3", std::uint32_t{7}, Vec3d(0.1, 0.0, 0.2)).ok());
    EXPECT_TRUE(world.add_grab(1, "ball-3", std::uint32_t{4'000}, {Vec3d(9.0, 1.0, 0.0), 20.0, 0.1}).ok());
    run_ticks(world, 2, threads);
    EXPECT_TRUE(world.release_grab(1).ok());
    Scene edited = world.scene();
    edited.soft_bodies[0].springs.stiffness_n_m *= 1.5;
    edited.soft_bodies[0].pins = {5'000};
    EXPECT_TRUE(world.apply(edited).ok());
    run_ticks(world, 2, threads);
    World other = make_world(world.scene());
    EXPECT_TRUE(other.restore(world.snapshot()).ok());
    run_ticks(world, 2, threads);
    run_ticks(other, 2, 1);
    EXPECT_EQ(other.state_hash(), world.state_hash()) << threads;
    EXPECT_FALSE(world.is_frozen(0));
    return world.state_hash();
  };
  const std::uint64_t hash = hash_on(1);
  for (const std::size_t threads : {2U, 3U, 16U}) EXPECT_EQ(hash_on(threads), hash) << threads;
}

TEST_P(Lanes, GiveABodyTheSameBitsByTicksAndBySubsteps) {
  on_each_isa([&] {
    Scene scene = mixture(Integrator::midpoint, GetParam());
    World free = make_world(scene);
    Collider far;  // something that might touch, so that every substep looks for contact
    far.name = "far";
    far.shape = SphereShape{0.1};
    far.position = {0.0, -1e4, 0.0};
    scene.colliders.push_back(far);
    World watched = make_world(scene);
    run_ticks(free, ticks);
    run_ticks(watched, ticks);
    for (std::size_t i = 0; i < scene.soft_bodies.size(); ++i) {
      EXPECT_TRUE(positions_of(free, i) == positions_of(watched, i)) << scene.soft_bodies[i].name;
      EXPECT_EQ(free.measure(i).moles, watched.measure(i).moles);
    }
  });
}

TEST_P(Lanes, GiveUnlikeSpringsTheSameBitsOnEveryPath) {
  std::vector<std::uint64_t> hashes;
  on_each_isa([&] {
    for (const Integrator integrator : {Integrator::symplectic_euler, Integrator::rk4, Integrator::tr_bdf2}) {
      const Scene many = of_few_solves(with_unlike_springs(fleet(19, integrator, GetParam())));
      World world = make_world(many);
      run_ticks(world, ticks);
      hashes.push_back(world.state_hash());
      for (const std::size_t threads : {2U, 16U}) EXPECT_EQ(hash_after(many, threads), hashes.back()) << threads;

      Scene alone = many;
      alone.soft_bodies = {many.soft_bodies[11]};
      EXPECT_TRUE(end_of(alone, 0) == positions_of(world, 11));

      World other = make_world(world.scene());
      ASSERT_TRUE(other.restore(world.snapshot()).ok());
      run_ticks(world, ticks);
      run_ticks(other, ticks, 3);
      EXPECT_EQ(other.state_hash(), world.state_hash());
    }
    // Each with its own factors: no two abreast.
    Scene mixed = fleet(9, Integrator::midpoint, GetParam());
    mixed.soft_bodies[4].springs.vertex_stiffness_scale = some_factors(*mixed.soft_bodies[4].mesh);
    Scene alone = mixed;
    alone.soft_bodies = {mixed.soft_bodies[4]};
    EXPECT_TRUE(end_of(mixed, 4) == end_of(alone, 0));
    EXPECT_TRUE(end_of(mixed, 5) == end_of(fleet(9, Integrator::midpoint, GetParam()), 5));
    const Scene large = with_unlike_springs(large_ball(Integrator::midpoint, GetParam()));
    EXPECT_EQ(hash_after(large, 16), hash_after(large, 1));
  });
  for (std::size_t i = 3; i < hashes.size(); ++i) EXPECT_EQ(hashes[i], hashes[i - 3]);
}

TEST_P(Lanes, GiveFactorsOfOneTheBitsOfNone) {
  on_each_isa([&] {
    for (const Integrator integrator : {Integrator::explicit_euler, Integrator::midpoint, Integrator::rk4,
                                        Integrator::implicit_euler, Integrator::tr_bdf2, Integrator::xpbd}) {
      Scene scene = fleet(9, integrator, GetParam());
      const std::uint64_t hash = hash_after(scene, 1);
      for (SoftBody& body : scene.soft_bodies) {
        body.springs.vertex_stiffness_scale.assign(body.mesh->positions_m.size(), 1.0);
      }
      EXPECT_EQ(hash_after(scene, 1), hash) << name_of(integrator);
    }
  });
}

// One thread's room goes from a large body under great forces to a light one whose last slots no vertex uses. What is
// left there must not make the light body look like a runaway, which would be stepped twice.
TEST_P(Lanes, StepABodyOnceWhateverHadItsRoomBefore) {
  on_each_isa([&] {
    Scene scene = empty_scene(Integrator::symplectic_euler, GetParam());
    SoftBody heavy = ball(*make_icosphere(2, 0.5), 0);
    heavy.mass_kg = 1e6;
    heavy.springs = {.stiffness_n_m = 1e6, .damping_n_s_m = 0.3, .rest_scale = 0.2};
    SoftBody light = ball(*make_box({0.5, 0.5, 0.5}, 1), 1);
    light.mass_kg = 0.1;
    light.springs.stiffness_n_m = 10.0;
    scene.soft_bodies = {heavy, light};
    World world = make_world(scene);
    world.set_profiling(true);
    run_ticks(world, ticks);
    const Profile profile = world.profile();
    EXPECT_EQ(profile[static_cast<std::size_t>(Stage::springs)].calls,
              ticks * world.substeps() * scene.soft_bodies.size());
  });
}

TEST_P(Lanes, GiveTheSameHashAfterASnapshotInTheMiddle) {
  for (const Integrator integrator : {Integrator::midpoint, Integrator::implicit_euler, Integrator::tr_bdf2}) {
    on_each_isa([&] {
      World world = make_world(mixture(integrator, GetParam()));
      run_ticks(world, ticks);
      World other = make_world(world.scene());
      ASSERT_TRUE(other.restore(world.snapshot()).ok());
      run_ticks(world, ticks);
      run_ticks(other, ticks, 3);
      EXPECT_EQ(other.state_hash(), world.state_hash());
    });
  }
}

TEST_P(Lanes, StopARunawayAmongFleetMatesWhereItStopsAlone) {
  Scene scene = fleet(16, Integrator::midpoint, GetParam());
  SoftBody& runaway = scene.soft_bodies[7];
  runaway.springs.stiffness_n_m = 1e9;
  Scene alone = scene;
  alone.soft_bodies = {runaway};
  World fleet_world = make_world(scene);
  World alone_world = make_world(alone);
  run_ticks(fleet_world, ticks);
  run_ticks(alone_world, ticks);
  EXPECT_TRUE(fleet_world.is_frozen(7));
  EXPECT_EQ(fleet_world.take_frozen().size(), 1U);
  EXPECT_TRUE(positions_of(fleet_world, 7) == positions_of(alone_world, 0));
  scene.soft_bodies.erase(scene.soft_bodies.begin() + 7);
  EXPECT_TRUE(positions_of(fleet_world, 8) == end_of(scene, 7));
}

TEST_P(Lanes, GiveTheGoldenHashes) {
  const bool single = GetParam() == Precision::single_precision;
  // A change of these changes every world's future: say so in CHANGELOG.md.
  const std::array<std::uint64_t, 8> golden =
      single ? std::array<std::uint64_t, 8>{0x4256f9a977fa03daU, 0x926736e7a741e646U, 0xe34d3a05cef915c8U,
                                            0x81b3443d3843a15aU, 0x79783d030834fddfU, 0x95c530eb437465b8U,
                                            0x43307d0b749e7ee9U, 0x5bce27e8caf69a45U}
             : std::array<std::uint64_t, 8>{0x0d58ed4603b729bfU, 0xc2d351185965f8a8U, 0x2ef9cdbbbdc94e2aU,
                                            0xd0fe041988acb08fU, 0x6810eeada3c05344U, 0x4dc0192540fea37dU,
                                            0x8b7291eba0af6f64U, 0xc349bc0a137692abU};
  for (std::size_t i = 0; i < lane_integrators.size(); ++i) {
    EXPECT_EQ(hash_after(fleet(5, lane_integrators[i], GetParam()), 1), golden[i]) << "integrator " << i;
  }
  EXPECT_EQ(hash_after(mixture(Integrator::midpoint, GetParam()), 1), golden[6]) << "mixture";
  EXPECT_EQ(hash_after(touching(GetParam()), 1), golden[7]) << "touching";
}

/// The same source with one number abreast: every operation one by one, in the order written.
template <class Real>
void expect_the_bits_of_one_abreast() {
  const auto mesh = *make_icosphere(2, 0.5);
  const auto step = [&](const LaneKernels<Real>& kernels) {
    SoftState<Real> state = make_soft_state<Real>(ball(mesh, 5));
    LaneMesh<Real> lanes;
    lanes.rings = make_rings(*mesh);
    lanes.lengths_m = ring_lengths_m<Real>(*mesh, lanes.rings, kernels.slot_of_place);
    const SubstepContext context{.dt_s = 1e-3};
    LaneScratch<Real> scratch;
    const std::array<SoftState<Real>*, 1> bodies{&state};
    std::array<std::uint8_t, 1> done{};
    step_freely<Real>(bodies, {&lanes, &kernels}, context, 20, scratch, done);
    EXPECT_EQ(done[0], 1);
    return state;
  };
  constexpr LaneKernels<Real> one_abreast = list_kernels<Pack<Real, 1>>();
  const SoftState<Real> expected = step(one_abreast);
  for (const Isa isa : {Isa::baseline, Isa::v3, Isa::v4}) {
    if (!has_isa(isa)) continue;
    const SoftState<Real> state = step(lane_kernels<Real>(isa));
    EXPECT_TRUE(state.x == expected.x);
    EXPECT_TRUE(state.v == expected.v);
    EXPECT_EQ(state.pressure_pa, expected.pressure_pa);
  }
}

TEST(LaneKernels, HaveTheBitsOfOneAbreast) {
  expect_the_bits_of_one_abreast<float>();
  expect_the_bits_of_one_abreast<double>();
}

INSTANTIATE_TEST_SUITE_P(Precisions, Lanes, testing::Values(Precision::single_precision, Precision::double_precision),
                         [](const auto& param) {
                           return param.param == Precision::single_precision ? "Single" : "Double";
                         });

}  // namespace
}  // namespace pneuma::physics
