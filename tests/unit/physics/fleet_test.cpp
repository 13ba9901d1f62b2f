// Shows that each world of a fleet has the bits of one that is stepped and changed by itself, whatever happens in its
// neighbours and however many threads there are; and that what is shown is what the world tells.
#include "physics/fleet.h"

#include <limits>

#include <gtest/gtest.h>

#include "unit/physics/lively_world.h"

namespace pneuma::physics {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t worlds = 5;
constexpr std::size_t bodies = 3;

Fleet make_fleet(std::size_t threads) {
  auto fleet = Fleet::create(lively_scene(), worlds, threads);
  EXPECT_TRUE(fleet.ok()) << fleet.status().message();
  return std::move(*fleet);
}

std::vector<std::uint64_t> hashes(const Fleet& fleet) {
  std::vector<std::uint64_t> all;
  for (std::size_t i = 0; i < fleet.count(); ++i) all.push_back(fleet.world(i).state_hash());
  return all;
}

/// World 1 is pushed, world 2 pumped, world 3's room turns another way.
struct Script {
  std::vector<double> impulses = std::vector<double>(worlds * bodies * 3, 0.0);
  std::vector<double> moles = std::vector<double>(worlds * 2, nan);
  std::vector<double> spins = std::vector<double>(worlds * 3, nan);

  Script() {
    impulses[bodies * 3 + 3] = 2.0;  // body b along x
    impulses[bodies * 3 + 7] = 5.0;  // the stone upwards
    moles[2 * 2] = 0.02;             // body a
    for (std::size_t axis = 0; axis < 3; ++axis) spins[3 * 3 + axis] = axis == 0 ? -1.0 : 0.0;
  }
  [[nodiscard]] FleetActions actions() const {
    return {.impulses_n_s = impulses,
            .moles = moles,
            .collider_velocities_m_s = {},
            .collider_angular_velocities_rad_s = spins};
  }
};

std::vector<std::uint64_t> hashes_of_worlds_alone() {
  std::vector<std::uint64_t> all;
  for (std::size_t i = 0; i < worlds; ++i) {
    World world = make(lively_scene());
    run(world, 40);
    if (i == 1) {
      EXPECT_TRUE(world.apply_impulse("b", WholeBody{}, {2.0, 0.0, 0.0}).ok());
      EXPECT_TRUE(world.apply_impulse("stone", WholeBody{}, {0.0, 5.0, 0.0}).ok());
    }
    Scene edited = world.scene();
    if (i == 2) edited.soft_bodies[0].gas->moles = 0.02;
    if (i == 3) edited.colliders[0].angular_velocity = {-1.0, 0.0, 0.0};
    if (i == 2 || i == 3) {
      EXPECT_TRUE(world.apply(edited).ok());
    }
    run(world, 40);
    all.push_back(world.state_hash());
  }
  return all;
}

TEST(Fleet, EachWorldHasTheBitsOfOneAlone) {
  const Script script;
  for (const std::size_t threads : {1U, 3U}) {
    Fleet fleet = make_fleet(threads);
    ASSERT_TRUE(fleet.step(40, {}, {}).ok());
    ASSERT_TRUE(fleet.step(40, script.actions(), {}).ok());
    EXPECT_EQ(hashes(fleet), hashes_of_worlds_alone()) << threads << " threads";
  }
}

// Where nothing can touch anything, worlds share lanes.
TEST(Fleet, EachWorldInFlightHasTheBitsOfOneAlone) {
  constexpr std::size_t count = 40;
  Scene scene;
  scene.stepping = {.substeps = 8, .integrator = Integrator::symplectic_euler};
  scene.gravity = {0.0, -9.81, 0.0};
  scene.soft_bodies = {ball("ball")};
  std::vector<double> impulses(count * 3, 0.0);
  std::vector<double> moles(count, nan);
  for (std::size_t i = 0; i < count; ++i) impulses[3 * i] = 0.1 * static_cast<double>(i);
  moles[3] = 0.02;
  impulses[3 * 30] = nan;  // refused
  for (const std::size_t threads : {1U, 3U}) {
    Fleet fleet = std::move(*Fleet::create(scene, count, threads));
    ASSERT_TRUE(fleet.step(5, {}, {}).ok());
    EXPECT_EQ(fleet.step(5, {impulses, moles, {}, {}}, {}).where(), "worlds[30].impulses[0]");
    std::vector<std::uint8_t> which(count, 0);
    which[20] = 1;
    fleet.reset(which, {});
    ASSERT_TRUE(fleet.step(5, {}, {}).ok());
    for (std::size_t i = 0; i < count; ++i) {
      World world = make(scene);
      if (i != 20) run(world, 5);
      if (i != 20 && i != 30) {
        Scene edited = world.scene();
        if (i == 3) edited.soft_bodies[0].gas->moles = moles[3];
        ASSERT_TRUE(world.apply(edited).ok());
        if (i > 0) {
          ASSERT_TRUE(world.apply_impulse("ball", WholeBody{}, {impulses[3 * i], 0.0, 0.0}).ok());
        }
        run(world, 5);
      }
      run(world, 5);
      EXPECT_EQ(fleet.world(i).state_hash(), world.state_hash()) << "world " << i << ", " << threads << " threads";
    }
  }
}

TEST(Fleet, AResetWorldBeginsAnewAndTheOthersGoOn) {
  const Script script;
  Fleet fleet = make_fleet(2);
  Fleet undisturbed = make_fleet(1);
  const std::uint64_t start = fleet.world(0).state_hash();
  ASSERT_TRUE(fleet.step(10, script.actions(), {}).ok());
  ASSERT_TRUE(undisturbed.step(10, script.actions(), {}).ok());
  std::vector<std::uint64_t> ticks(worlds);
  FleetView view;
  view.ticks = ticks;
  fleet.reset(std::vector<std::uint8_t>{0, 1, 1, 1, 0}, view);
  EXPECT_EQ(ticks, (std::vector<std::uint64_t>{10, 0, 0, 0, 10}));
  for (const std::size_t i : {1U, 2U, 3U}) EXPECT_EQ(fleet.world(i).state_hash(), start);
  ASSERT_TRUE(fleet.step(10, {}, {}).ok());
  ASSERT_TRUE(undisturbed.step(10, {}, {}).ok());
  for (const std::size_t i : {0U, 4U}) EXPECT_EQ(fleet.world(i).state_hash(), undisturbed.world(i).state_hash());
  // What was changed in them went too.
  World alone = make(lively_scene());
  run(alone, 10);
  for (const std::size_t i : {1U, 2U, 3U}) EXPECT_EQ(fleet.world(i).state_hash(), alone.state_hash());
}

TEST(Fleet, ShowsWhatTheWorldsTell) {
  const Script script;
  Fleet fleet = make_fleet(2);
  const std::size_t vertices = fleet.vertex_count();
  std::vector<float> places(worlds * vertices * 3);
  std::vector<float> speeds(places.size());
  std::vector<double> centres(worlds * bodies * 3);
  std::vector<double> means(centres.size());
  std::vector<double> pressures(worlds * 2);
  std::vector<double> volumes(worlds * 2);
  ASSERT_TRUE(fleet
                  .step(7, script.actions(),
                        {.positions_m = places,
                         .velocities_m_s = speeds,
                         .centres_of_mass_m = centres,
                         .mean_velocities_m_s = means,
                         .pressures_pa = pressures,
                         .volumes_m3 = volumes,
                         .frozen = {},
                         .ticks = {}})
                  .ok());
  for (std::size_t i = 0; i < worlds; ++i) {
    const World& world = fleet.world(i);
    const std::vector<double> x = positions(world, 1);
    const std::size_t begin = (i * vertices + positions(world, 0).size() / 3) * 3;
    for (std::size_t n = 0; n < x.size(); ++n) EXPECT_EQ(places[begin + n], static_cast<float>(x[n]));
    const BodyMeasures measures = world.measure(1);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto at = static_cast<Eigen::Index>(axis);
      EXPECT_EQ(centres[(i * bodies + 1) * 3 + axis], measures.centre_of_mass[at]);
      EXPECT_EQ(means[(i * bodies + 1) * 3 + axis], measures.momentum[at] / 2.0);  // kg
      EXPECT_EQ(centres[(i * bodies + 2) * 3 + axis], world.rigid_bodies()[0].position[at]);
      EXPECT_EQ(means[(i * bodies + 2) * 3 + axis], world.rigid_bodies()[0].velocity[at]);
    }
    EXPECT_EQ(pressures[i * 2 + 1], measures.pressure_pa);
    EXPECT_EQ(volumes[i * 2 + 1], measures.volume_m3);
  }
}

TEST(Fleet, AWorldThatIsRefusedIsNamed) {
  Script script;
  script.impulses[3 * bodies * 3] = nan;
  Fleet fleet = make_fleet(2);
  EXPECT_EQ(fleet.step(1, script.actions(), {}).where(), "worlds[3].impulses[0]");
  Script negative;
  negative.moles[4 * 2 + 1] = -1.0;
  EXPECT_EQ(fleet.step(1, negative.actions(), {}).where(), "worlds[4].soft_bodies[1].gas.moles");
}

Fleet fleet_of(Scene scene) {
  auto fleet = Fleet::create(std::move(scene), 2, 1);
  EXPECT_TRUE(fleet.ok()) << fleet.status().message();
  return std::move(*fleet);
}

base::Status pump(Fleet& fleet, const std::vector<double>& moles) {
  FleetActions actions;
  actions.moles = moles;
  return fleet.step(1, actions, {});
}

// Moles are what a gas holds from now on: the same number again fills up what has leaked since.
TEST(Fleet, TheSameMolesAgainFillUpWhatLeaked) {
  Scene scene = lively_scene();
  scene.soft_bodies[0].gas->leak_mol_s_pa = 1e-5;
  Fleet fleet = fleet_of(scene);
  const std::vector<double> moles{0.02, nan, nan, nan};
  ASSERT_TRUE(pump(fleet, moles).ok());
  ASSERT_TRUE(fleet.step(60, {}, {}).ok());
  const double leaked_mol = 0.02 - fleet.world(0).scene().soft_bodies[0].gas->moles;
  ASSERT_GT(leaked_mol, 1e-4);
  ASSERT_TRUE(pump(fleet, moles).ok());
  EXPECT_NEAR(fleet.world(0).scene().soft_bodies[0].gas->moles, 0.02, leaked_mol / 10.0);
}

TEST(Fleet, MolesOfABodyWithoutGasAreRefused) {
  Scene scene = lively_scene();
  scene.soft_bodies[1].gas.reset();
  Fleet fleet = fleet_of(scene);
  const base::Status refused = pump(fleet, {0.02, nan, 0.02, 0.03});
  EXPECT_EQ(refused.code(), base::StatusCode::failed_precondition);
  EXPECT_EQ(refused.where(), "worlds[1].moles[1]");
  EXPECT_EQ(fleet.world(1).tick(), 0U);
}

// As a frozen body takes no impulse: who learns cannot know in the same step that it burst.
TEST(Fleet, ABodyWhoseGasBurstIsLeftAlone) {
  Scene scene = lively_scene();
  scene.soft_bodies[0].gas->burst_pressure_pa = 1.0;
  Fleet fleet = fleet_of(scene);
  ASSERT_TRUE(fleet.step(1, {}, {}).ok());
  ASSERT_FALSE(fleet.world(0).scene().soft_bodies[0].gas);
  EXPECT_TRUE(pump(fleet, {0.02, nan, nan, nan}).ok());
  EXPECT_FALSE(fleet.world(0).scene().soft_bodies[0].gas);
}

TEST(Fleet, AVelocityThatIsNaNInPartIsRefused) {
  Fleet fleet = fleet_of(lively_scene());
  const std::vector<double> part{nan, nan, nan, 0.0, nan, 1.0};
  FleetActions moved;
  moved.collider_velocities_m_s = part;
  EXPECT_EQ(fleet.step(1, moved, {}).where(), "worlds[1].collider_velocities[0]");
  FleetActions turned;
  turned.collider_angular_velocities_rad_s = part;
  EXPECT_EQ(fleet.step(1, turned, {}).where(), "worlds[1].collider_angular_velocities[0]");
}

}  // namespace
}  // namespace pneuma::physics
