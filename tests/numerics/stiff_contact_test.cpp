// Shows that contact after steps too long for the stiffness adds no energy: of one body with floors and rooms, at rest
// and moving, of two balls, and of a ball and a box, from 1e3 to 1e7 N/m at one step a tick, where each spring would
// swing up to 600 times. And that momentum is kept meanwhile, that the ball comes to rest on the floor, and that it
// bounces as high as its restitution says.
#include "numerics/worlds.h"

namespace pneuma::physics {
namespace {

double energy_j(const World& world) {
  const BodyMeasures of_ball = world.measure(0);
  return of_ball.kinetic_j + of_ball.elastic_j + of_ball.gas_j + of_ball.gravity_j;
}

TEST(StiffContact, ABallDroppedOnAFloorUnderAutoGainsNoEnergyAndRestsAtItsVolume) {
  const BreathingBall ball{.subdivisions = 2,
                           .radius_m = 0.5,
                           .mass_kg = 1.0,
                           .stiffness_n_m = 1e6,
                           .damping_n_s_m = 1.0,
                           .nrt_j = 0.03 * gas_constant_j_mol_k * 293.15};
  Scene scene = ball.scene(1.0, Integrator::automatic, 60, 0);
  scene.gravity = {0, -9.81, 0};
  scene.soft_bodies[0].position = {0, 2, 0};
  scene.soft_bodies[0].surface = {.restitution = 0.5, .friction = 0.3};
  scene.colliders.push_back({.name = "floor", .shape = PlaneShape{}, .surface = {.restitution = 0.5, .friction = 0.3}});
  World world = make_world(std::move(scene));
  const double start_j = energy_j(world);
  const double rest_m3 = world.measure(0).volume_m3 * std::pow(ball.equilibrium_scale(), 3.0);
  for (int tick = 0; tick < 300; ++tick) {
    run_ticks(world, 1);
    ASSERT_LT(energy_j(world), 1.05 * start_j) << "tick " << tick;
  }
  EXPECT_FALSE(world.is_frozen(0));
  EXPECT_LT(world.measure(0).kinetic_j, 0.01 * start_j);
  EXPECT_NEAR(world.measure(0).volume_m3, rest_m3, 0.01 * rest_m3);
}

// Bodies that meet after steps of a whole tick have what they came with, and no more, however stiff they are for such
// steps: what contact by vertices would add, they answer as rigid bodies instead.
struct Meeting {
  Integrator integrator;
  Precision precision;
};

class StiffMeeting : public testing::TestWithParam<Meeting> {
 protected:
  static constexpr double speed_m_s = 5.0;
  static constexpr std::array stiffnesses_n_m{1e3, 1e4, 1e5, 1e6, 1e7};
  static constexpr std::array restitutions{0.0, 0.5, 1.0};

  // A ball of 1 kg and 1 m.
  [[nodiscard]] static Scene ball_scene(double stiffness_n_m, double restitution) {
    const BreathingBall ball{
        .subdivisions = 2, .mass_kg = 1.0, .stiffness_n_m = stiffness_n_m, .damping_n_s_m = 1.0, .nrt_j = 73.0};
    Scene scene = ball.scene(1.0, GetParam().integrator, 60.0, 1);
    scene.stepping.precision = GetParam().precision;
    scene.soft_bodies[0].surface = {.restitution = restitution, .friction = 0.3};
    return scene;
  }

  // Energy beyond the start's stays below 1 % of what the bodies came with, momentum (where `kept`) is that of the
  // start to round-off of the forces, and no ball is turned inside out. `extra_j`: what is not in the soft bodies.
  template <class Extra>
  static void expect_no_gain(World& world, double came_with_j, bool kept, const std::string& what,
                             const Extra& extra_j) {
    const double most_j = total_j(world) + extra_j(world) + 0.01 * came_with_j;
    const Vec3d start = momentum(world);
    for (int tick = 0; tick < 180; ++tick) {
      run_ticks(world, 1);
      ASSERT_LT(total_j(world) + extra_j(world), most_j) << what << " at " << tick;
      for (std::size_t i = 0; i < world.soft_body_count(); ++i) {
        ASSERT_FALSE(world.is_frozen(i)) << what << " at " << tick;
        ASSERT_GT(world.measure(i).volume_m3, 0.0) << what << " at " << tick;
      }
    }
    if (!kept) return;
    const double round_off = GetParam().precision == Precision::double_precision ? 1e-12 : 1e-5;
    const double impulse_n_s = world.soft_body(0).springs.stiffness_n_m / 60.0;
    EXPECT_LT((momentum(world) - start).norm(), round_off * std::max(1.0, impulse_n_s)) << what;
  }

  static double total_j(const World& world) {
    double sum_j = 0.0;
    for (std::size_t i = 0; i < world.soft_body_count(); ++i) {
      const BodyMeasures body = world.measure(i);
      sum_j += body.kinetic_j + body.elastic_j + body.gas_j + body.gravity_j;
    }
    return sum_j;
  }
  static Vec3d momentum(const World& world) {
    Vec3d sum = Vec3d::Zero();
    for (std::size_t i = 0; i < world.soft_body_count(); ++i) sum += world.measure(i).momentum;
    for (const RigidState& body : world.rigid_bodies()) sum += body.body.mass_kg * body.velocity;
    return sum;
  }
  static double kinetic_j(const RigidState& body) {
    const Vec3d spin = body.orientation.conjugate() * body.angular_velocity;
    return 0.5 * body.body.mass_kg * body.velocity.squaredNorm() +
           0.5 * spin.cwiseAbs2().dot(body.inverse_inertia_1_kg_m2.cwiseInverse());
  }
  static std::string name(double stiffness_n_m, double restitution) {
    return std::to_string(stiffness_n_m).append(" N/m, restitution ").append(std::to_string(restitution));
  }
};

TEST_P(StiffMeeting, ABallOnAFloorThatMovesHasInItsFrameWhatItFellWith) {
  for (const double stiffness_n_m : stiffnesses_n_m) {
    for (const double restitution : restitutions) {
      for (const Vec3d& of_floor : {Vec3d(0.0, 0.0, 0.0), Vec3d(2.0, 1.0, 0.0)}) {
        Scene scene = ball_scene(stiffness_n_m, restitution);
        scene.gravity = {0.0, -9.81, 0.0};
        scene.soft_bodies[0].position.y() = 2.0;
        scene.soft_bodies[0].velocity = of_floor;
        Collider floor;
        floor.name = "floor";
        floor.shape = PlaneShape{};
        floor.velocity = of_floor;
        scene.colliders.push_back(floor);
        World world = make_world(std::move(scene));
        // From the floor's frame to the world's.
        const auto extra_j = [&of_floor](const World& at) {
          const BodyMeasures ball = at.measure(0);
          const double mass_kg = at.soft_body(0).mass_kg;
          return 0.5 * mass_kg * of_floor.squaredNorm() - ball.momentum.dot(of_floor) -
                 mass_kg * 9.81 * of_floor.y() * at.time_s();
        };
        const std::string what = name(stiffness_n_m, restitution).append(of_floor.isZero() ? "" : ", moving");
        expect_no_gain(world, 9.81 * 2.0, false, what, extra_j);
      }
    }
  }
}

TEST_P(StiffMeeting, ABallInARoomHasWhatItWasThrownWith) {
  for (const double stiffness_n_m : stiffnesses_n_m) {
    for (const double restitution : restitutions) {
      Scene scene = ball_scene(stiffness_n_m, restitution);
      scene.gravity = {0.0, -9.81, 0.0};
      scene.soft_bodies[0].velocity = {7.0, 3.0, 4.0};
      Collider room;
      room.name = "room";
      room.shape = RoomShape{{1.5, 1.5, 1.5}};
      scene.colliders.push_back(room);
      World world = make_world(std::move(scene));
      expect_no_gain(world, 37.0 + 9.81, false, name(stiffness_n_m, restitution), [](const World&) { return 0.0; });
    }
  }
}

TEST_P(StiffMeeting, TwoBallsHaveWhatOneCameWithAndItsMomentum) {
  for (const double stiffness_n_m : stiffnesses_n_m) {
    for (const double restitution : restitutions) {
      for (const double mass_kg : {1.0, 0.05}) {
        Scene scene = ball_scene(stiffness_n_m, restitution);
        scene.soft_bodies.push_back(scene.soft_bodies[0]);
        scene.soft_bodies[0].velocity.x() = speed_m_s;
        SoftBody& other = scene.soft_bodies[1];
        other.name = "other";
        other.mass_kg = mass_kg;
        other.position = {1.6, 0.4, 0.0};
        World world = make_world(std::move(scene));
        const std::string what = name(stiffness_n_m, restitution).append(", other kg ").append(std::to_string(mass_kg));
        expect_no_gain(world, 0.5 * speed_m_s * speed_m_s, true, what, [](const World&) { return 0.0; });
      }
    }
  }
}

TEST_P(StiffMeeting, ABallAndARigidBoxHaveWhatItCameWithAndItsMomentum) {
  for (const double stiffness_n_m : stiffnesses_n_m) {
    for (const double restitution : restitutions) {
      for (const double mass_kg : {3.0, 0.1}) {
        Scene scene = ball_scene(stiffness_n_m, restitution);
        scene.soft_bodies[0].velocity.y() = -speed_m_s;
        RigidBody box;
        box.name = "box";
        box.shape = BoxShape{{0.5, 0.25, 0.5}};
        box.mass_kg = mass_kg;
        box.position = {0.2, -1.2, 0.0};
        scene.rigid_bodies.push_back(box);
        World world = make_world(std::move(scene));
        const std::string what = name(stiffness_n_m, restitution).append(", box kg ").append(std::to_string(mass_kg));
        expect_no_gain(world, 0.5 * speed_m_s * speed_m_s, true, what,
                       [](const World& at) { return kinetic_j(at.rigid_bodies()[0]); });
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, StiffMeeting,
                         testing::Values(Meeting{Integrator::implicit_euler, Precision::double_precision},
                                         Meeting{Integrator::implicit_euler, Precision::single_precision},
                                         Meeting{Integrator::tr_bdf2, Precision::double_precision},
                                         Meeting{Integrator::tr_bdf2, Precision::single_precision}),
                         [](const auto& param) {
                           return std::string(name_of(param.param.integrator))
                               .append(param.param.precision == Precision::double_precision ? "Double" : "Single");
                         });

TEST(StiffBallOnAFloor, ComesToRestThere) {
  for (const Integrator integrator : {Integrator::implicit_euler, Integrator::tr_bdf2}) {
    for (const double stiffness_n_m : {1e4, 1e5, 1e6, 1e7}) {
      for (const std::uint32_t substeps : {1U, 4U}) {
        const double height_m = substeps == 1 ? 2.0 : 0.501;
        const std::string what = std::string(name_of(integrator))
                                     .append(" ")
                                     .append(std::to_string(stiffness_n_m))
                                     .append(" ")
                                     .append(std::to_string(height_m));
        const BreathingBall ball{
            .subdivisions = 2, .mass_kg = 1.0, .stiffness_n_m = stiffness_n_m, .damping_n_s_m = 1.0, .nrt_j = 73.0};
        Scene scene = ball.scene(1.0, integrator, 60.0, substeps);
        scene.gravity = {0.0, -9.81, 0.0};
        scene.soft_bodies[0].position.y() = height_m;
        scene.soft_bodies[0].surface = {.restitution = 0.5, .friction = 0.3};
        Collider floor;
        floor.name = "floor";
        floor.shape = PlaneShape{};
        scene.colliders.push_back(floor);
        World world = make_world(std::move(scene));
        const double most_j = 1.01 * energy_j(world);
        for (int tick = 0; tick < 240; ++tick) {
          run_ticks(world, 1);
          ASSERT_LT(energy_j(world), most_j) << what << " at " << tick;
        }
        EXPECT_LT(world.measure(0).kinetic_j, 0.02 * most_j) << what;
        EXPECT_NEAR(world.measure(0).centre_of_mass.y(), 0.5, 0.03) << what;
      }
    }
  }
}

// At whatever moment of a tick the ball comes down. The heights are those of ticks, which miss the highest by g h^2
// / 8.
TEST(StiffContact, ABallUnderAutoBouncesToTheSquareOfItsRestitutionTimesTheHeight) {
  for (const double stiffness_n_m : {1e5, 1e6}) {
    for (const double restitution : {0.5, 0.9}) {
      for (const double drop_m : {1.9, 2.0, 2.1}) {
        const BreathingBall ball{.subdivisions = 2,
                                 .radius_m = 0.5,
                                 .mass_kg = 1.0,
                                 .stiffness_n_m = stiffness_n_m,
                                 .damping_n_s_m = 1.0,
                                 .nrt_j = 100.0};
        Scene scene = ball.scene(1.0, Integrator::automatic, 60, 0);
        scene.gravity = {0.0, -9.81, 0.0};
        scene.soft_bodies[0].position.y() = 0.5 + drop_m;
        scene.soft_bodies[0].surface.restitution = restitution;
        Collider& floor = scene.colliders.emplace_back();
        floor.name = "floor";
        floor.shape = PlaneShape{};
        floor.surface.restitution = restitution;
        World world = make_world(std::move(scene));
        const double fall_s = std::sqrt(2.0 * drop_m / 9.81);
        double highest_m = 0.0;
        while (world.time_s() < (1.0 + 1.9 * restitution) * fall_s) {
          run_ticks(world, 1);
          const double above_m = world.measure(0).centre_of_mass.y() - 0.5;
          if (world.time_s() > fall_s + 0.05) highest_m = std::max(highest_m, above_m);
        }
        const double wanted_m = restitution * restitution * drop_m;
        EXPECT_NEAR(highest_m, wanted_m, 0.02 * wanted_m) << stiffness_n_m << ", " << restitution << ", " << drop_m;
      }
    }
  }
}

}  // namespace
}  // namespace pneuma::physics
