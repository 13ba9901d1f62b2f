// Shows what a joint does: it holds what it ties, no more and no less, by closed forms: periods, stretches, loads,
// freedoms left and momentum kept.
#include "physics/contact/joint.h"

#include <cmath>
#include <functional>
#include <numbers>

#include <gtest/gtest.h>

#include "unit/physics/lively_world.h"

namespace pneuma::physics {
namespace {

constexpr double gravity_m_s2 = 9.81;

RigidBody bob(const std::string& name, const Vec3d& position, double mass_kg = 2.0) {
  RigidBody body;
  body.name = name;
  body.shape = SphereShape{0.1};
  body.mass_kg = mass_kg;
  body.position = position;
  return body;
}

Anchor rigid_anchor(const std::string& body, const Vec3d& point_m = Vec3d::Zero()) {
  Anchor anchor;
  anchor.of = Anchor::Of::rigid;
  anchor.body = body;
  anchor.point_m = point_m;
  return anchor;
}

Anchor vertex_anchor(const std::string& body, std::uint32_t vertex) {
  Anchor anchor;
  anchor.of = Anchor::Of::soft;
  anchor.body = body;
  anchor.vertex = vertex;
  return anchor;
}

Anchor world_anchor(const Vec3d& point_m) {
  Anchor anchor;
  anchor.point_m = point_m;
  return anchor;
}

Joint joint(const std::string& name, const Anchor& first, const Anchor& second = {}, const JointKind& kind = {}) {
  Joint made;
  made.name = name;
  made.first = first;
  made.second = second;
  made.kind = kind;
  return made;
}

Scene scene_of(std::vector<RigidBody> bodies, std::vector<Joint> joints) {
  Scene scene;
  scene.gravity = Vec3d(0.0, -gravity_m_s2, 0.0);
  scene.rigid_bodies = std::move(bodies);
  scene.joints = std::move(joints);
  return scene;
}

void step_for(World& world, double seconds) {
  run(world, static_cast<int>(std::lround(seconds / world.tick_period_s())));
}

std::uint32_t vertex_towards(const SoftBody& body, const Vec3d& direction) {
  std::uint32_t best = 0;
  for (std::uint32_t i = 0; i < body.mesh->positions_m.size(); ++i) {
    if (body.mesh->positions_m[i].dot(direction) > body.mesh->positions_m[best].dot(direction)) best = i;
  }
  return best;
}

Vec3d vertex_of(const World& world, std::size_t body, std::uint32_t vertex) {
  const std::vector<double> x = positions(world, body);
  return {x[3 * vertex], x[3 * vertex + 1], x[3 * vertex + 2]};
}

// A compound pendulum swings with T = 2 pi sqrt((I + m L^2) / (m g L)) (1 + angle^2 / 16).
TEST(Joint, PendulumKeepsItsLengthAndPeriod) {
  constexpr double length_m = 1.0;
  constexpr double angle = 0.2;
  const Vec3d start(length_m * std::sin(angle), -length_m * std::cos(angle), 0.0);
  Scene scene = scene_of({bob("bob", start)}, {joint("rod", rigid_anchor("bob", -start), world_anchor(Vec3d::Zero()))});
  for (const std::uint32_t substeps : {1U, 8U}) {
    scene.stepping.substeps = substeps;
    World world = make(scene);
    const double inertia = length_m * length_m + 0.4 * 0.01;
    const double period_s =
        2.0 * std::numbers::pi * std::sqrt(inertia / (gravity_m_s2 * length_m)) * (1.0 + angle * angle / 16.0);
    Workers workers(1);
    double last_x = start.x();
    double first_crossing_s = 0.0;
    double crossing_s = 0.0;
    int crossings = 0;
    double highest = 0.0;
    while (crossings < 41) {
      world.step_tick(workers);
      const Vec3d& at = world.rigid_bodies()[0].position;
      ASSERT_NEAR(at.norm(), length_m, 0.001 * length_m);
      highest = std::max(highest, std::abs(at.x()));
      if (at.x() < 0.0 && last_x >= 0.0) {
        crossing_s = world.time_s() - world.tick_period_s() * (-at.x()) / (last_x - at.x());
        if (crossings++ == 0) first_crossing_s = crossing_s;
      }
      last_x = at.x();
    }
    EXPECT_NEAR((crossing_s - first_crossing_s) / 40.0, period_s, 0.01 * period_s) << substeps;
    EXPECT_LT(highest, 1.01 * start.x());
    double swing = 0.0;  // after 80 s it swings as far as at first
    for (int i = 0; i < 130; ++i) {
      world.step_tick(workers);
      swing = std::max(swing, std::abs(world.rigid_bodies()[0].position.x()));
    }
    EXPECT_NEAR(swing, start.x(), 0.02 * start.x()) << substeps;
  }
}

TEST(Joint, CompliantJointStretchesByItsLoad) {
  Joint spring = joint("spring", rigid_anchor("load"), world_anchor(Vec3d::Zero()));
  spring.compliance_m_n = 1e-3;
  World world = make(scene_of({bob("load", Vec3d::Zero(), 5.0)}, {spring}));
  step_for(world, 20.0);
  EXPECT_NEAR(-world.rigid_bodies()[0].position.y(), 5.0 * gravity_m_s2 * 1e-3, 0.01 * 5.0 * gravity_m_s2 * 1e-3);
}

TEST(Joint, BreaksJustPastItsForceWithOneEvent) {
  for (const JointKind& kind : {JointKind(PointJoint{}), JointKind(DistanceLimit{1.0})}) {
    for (const double share : {1.001, 0.999}) {
      const bool hangs = std::holds_alternative<DistanceLimit>(kind);
      Joint held = joint("thread", rigid_anchor("load"), world_anchor(Vec3d(0.0, hangs ? 1.0 : 0.0, 0.0)), kind);
      held.break_force_n = share * 5.0 * gravity_m_s2;
      World world = make(scene_of({bob("load", Vec3d::Zero(), 5.0)}, {held}));
      step_for(world, 3.0);
      const auto broken = world.take_broken_joints();
      if (share > 1.0) {
        EXPECT_TRUE(broken.empty());
        EXPECT_NEAR(world.rigid_bodies()[0].position.y(), 0.0, 1e-4);
        EXPECT_EQ(world.joints().size(), 1U);
        continue;
      }
      ASSERT_EQ(broken.size(), 1U);
      EXPECT_EQ(broken[0].name, "thread");
      EXPECT_LT(world.rigid_bodies()[0].position.y(), -10.0);
      EXPECT_TRUE(world.joints().empty());
      EXPECT_TRUE(world.scene().joints.empty());
      step_for(world, 0.1);
      EXPECT_TRUE(world.take_broken_joints().empty());
    }
  }
}

Scene chain(double tip_kg) {
  constexpr int links = 50;
  constexpr double apart_m = 0.1;
  std::vector<RigidBody> bodies;
  std::vector<Joint> joints;
  for (int i = 0; i <= links; ++i) {
    const bool is_tip = i == links;
    RigidBody body = bob("link-" + std::to_string(i), {(i + 0.5) * apart_m, 0.0, 0.0}, is_tip ? tip_kg : 1e-3);
    body.shape = SphereShape{0.02};
    const Anchor before =
        i == 0 ? world_anchor(Vec3d::Zero()) : rigid_anchor("link-" + std::to_string(i - 1), {0.5 * apart_m, 0.0, 0.0});
    joints.push_back(joint("joint-" + std::to_string(i), rigid_anchor(body.name, {-0.5 * apart_m, 0.0, 0.0}), before));
    bodies.push_back(body);
  }
  return scene_of(std::move(bodies), std::move(joints));
}

// Augmented VBD's scene: 50 links of 1 g, and 50 kg at the tip, let go from the horizontal.
TEST(Joint, ChainHolds50000TimesALinkAtItsTip) {
  World world = make(chain(50.0));
  EXPECT_EQ(world.substeps(), 4U);
  Workers workers(1);
  double stretch = 0.0;
  for (int tick = 0; tick < 600; ++tick) {
    world.step_tick(workers);
    double length_m = 0.0;
    Vec3d last = Vec3d::Zero();
    for (const RigidState& link : world.rigid_bodies()) {
      const Vec3d start = link.position + link.orientation * Vec3d(-0.05, 0.0, 0.0);
      stretch = std::max(stretch, (start - last).norm() / 0.1);
      last = link.position + link.orientation * Vec3d(0.05, 0.0, 0.0);
      length_m = last.norm();
    }
    ASSERT_TRUE(std::isfinite(length_m));
    ASSERT_LT(length_m, 5.1 * 1.001) << tick;
  }
  RecordProperty("stretch_percent", std::to_string(100.0 * stretch));
  EXPECT_LT(stretch, 0.01);
  EXPECT_EQ(world.row_counts().unconverged, 0U);
}

// The same of ropes from ball to ball.
TEST(Joint, RopesHold50000TimesABallAtTheirTip) {
  constexpr double apart_m = 0.1;
  Scene scene = scene_of({}, {});
  for (int i = 0; i <= 50; ++i) {
    RigidBody body = bob("ball-" + std::to_string(i), {(i + 1) * apart_m, 0.0, 0.0}, i == 50 ? 50.0 : 1e-3);
    body.shape = SphereShape{0.02};
    const Anchor before =
        i == 0 ? world_anchor(Vec3d::Zero()) : rigid_anchor("ball-" + std::to_string(i - 1), Vec3d::Zero());
    scene.joints.push_back(joint("rope-" + std::to_string(i), rigid_anchor(body.name), before, DistanceLimit{apart_m}));
    scene.rigid_bodies.push_back(body);
  }
  World world = make(scene);
  Workers workers(1);
  for (int tick = 0; tick < 600; ++tick) {
    world.step_tick(workers);
    Vec3d last = Vec3d::Zero();
    for (const RigidState& ball : world.rigid_bodies()) {
      ASSERT_LT((ball.position - last).norm(), 1.001 * apart_m) << tick;
      last = ball.position;
    }
  }
  EXPECT_EQ(world.row_counts().unconverged, 0U);
}

TEST(Joint, FreePairKeepsItsMomenta) {
  for (const JointKind& kind : {JointKind(PointJoint{}), JointKind(HingeJoint{Vec3d(0.6, 0.8, 0.0)}),
                                JointKind(SliderJoint{Vec3d::UnitX()}), JointKind(DistanceLimit{0.9})}) {
    RigidBody a = bob("a", {0.0, 0.0, 0.0}, 1.0);
    RigidBody b = bob("b", {1.0, 0.0, 0.0}, 3.0);
    b.shape = BoxShape{Vec3d(0.1, 0.2, 0.3)};
    a.velocity = {0.3, 2.0, -0.4};
    b.angular_velocity = {0.5, -1.0, 2.0};
    Scene scene =
        scene_of({a, b}, {joint("tie", rigid_anchor("a", {0.5, 0.0, 0.0}), rigid_anchor("b", {-0.5, 0.0, 0.0}), kind)});
    scene.gravity.setZero();
    scene.stepping.substeps = 4;
    World world = make(scene);
    const auto momenta = [&] {
      Eigen::Matrix<double, 6, 1> sum = Eigen::Matrix<double, 6, 1>::Zero();
      for (const RigidState& body : world.rigid_bodies()) {
        const Vec3d p = body.body.mass_kg * body.velocity;
        const Vec3d spin = body.orientation * body.inverse_inertia_1_kg_m2.cwiseInverse().cwiseProduct(
                                                  body.orientation.conjugate() * body.angular_velocity);
        sum.head<3>() += p;
        sum.tail<3>() += body.position.cross(p) + spin;
      }
      return sum;
    };
    const auto before = momenta();
    step_for(world, 10.0);
    const auto after = momenta();
    EXPECT_LT((after - before).head<3>().norm(), 1e-12) << kind.index();
    EXPECT_LT((after - before).tail<3>().norm(), 1e-10) << kind.index();
    const Vec3d apart = world.rigid_bodies()[1].position - world.rigid_bodies()[0].position;
    EXPECT_LT(apart.norm(), std::holds_alternative<SliderJoint>(kind) ? 100.0 : 1.6);
  }
}

TEST(Joint, RopeIsSlackUntilItIsTaut) {
  Scene scene = scene_of({bob("bob", {0.3, 0.0, 0.0})},
                         {joint("rope", rigid_anchor("bob"), world_anchor(Vec3d::Zero()), DistanceLimit{1.0})});
  World world = make(scene);
  Workers workers(1);
  bool was_taut = false;
  for (int tick = 0; tick < 600; ++tick) {
    world.step_tick(workers);
    const double length_m = world.rigid_bodies()[0].position.norm();
    ASSERT_LT(length_m, 1.01) << tick;
    if (length_m < 0.9 && !was_taut) {
      const double t = world.time_s();
      ASSERT_NEAR(world.rigid_bodies()[0].position.y(), -0.5 * gravity_m_s2 * t * t, 0.05);
    }
    was_taut |= length_m > 0.99;
  }
  EXPECT_TRUE(was_taut);
  Scene lifted = world.scene();  // thrown up, it goes slack again
  lifted.rigid_bodies[0].position = {0.0, -0.5, 0.0};
  lifted.rigid_bodies[0].velocity = {0.0, 1.0, 0.0};
  ASSERT_TRUE(world.apply(lifted, {"bob"}).ok());
  step_for(world, 0.1);
  EXPECT_NEAR(world.rigid_bodies()[0].velocity.y(), 1.0 - 0.1 * gravity_m_s2, 0.01);
}

TEST(Joint, HingeLeavesOneFreedomAndSliderOne) {
  const Vec3d axis = Vec3d(1.0, 2.0, -1.0).normalized();
  for (const JointKind& kind : {JointKind(HingeJoint{axis}), JointKind(SliderJoint{axis})}) {
    const bool is_hinge = std::holds_alternative<HingeJoint>(kind);
    RigidBody body = bob("door", {0.0, 0.0, 0.0});
    body.shape = BoxShape{Vec3d(0.5, 0.1, 0.3)};
    body.velocity = {1.0, -2.0, 0.5};
    body.angular_velocity = {2.0, 1.0, -1.5};
    Scene scene = scene_of({body}, {joint("held", rigid_anchor("door", {0.2, 0.0, 0.1}), {}, kind)});
    scene.gravity.setZero();
    scene.stepping.substeps = 4;
    World world = make(scene);
    step_for(world, 3.0);
    const RigidState& state = world.rigid_bodies()[0];
    const Vec3d point = state.position + state.orientation * Vec3d(0.2, 0.0, 0.1);
    if (is_hinge) {
      EXPECT_LT((point - Vec3d(0.2, 0.0, 0.1)).norm(), 1e-3);
      EXPECT_LT((state.orientation * axis - axis).norm(), 1e-3);
      EXPECT_LT(state.angular_velocity.cross(axis).norm(), 1e-2 * state.angular_velocity.norm());
      EXPECT_GT(std::abs(state.angular_velocity.dot(axis)), 0.1);
    } else {
      const Vec3d way = point - Vec3d(0.2, 0.0, 0.1);
      EXPECT_LT(way.cross(axis).norm(), 1e-6);
      EXPECT_GT(way.norm(), 1.0);
      EXPECT_LT(state.orientation.angularDistance(Quatd::Identity()), 1e-6);
    }
  }
}

constexpr Integrator every_kind[] = {Integrator::midpoint, Integrator::implicit_euler, Integrator::tr_bdf2,
                                     Integrator::xpbd};

TEST(Joint, BallHungByAVertexIsAsIfThatWerePinned) {
  for (const Integrator integrator : every_kind) {
    Scene scene;
    scene.gravity = Vec3d(0.0, -gravity_m_s2, 0.0);
    scene.stepping.substeps = 40;
    scene.stepping.integrator = integrator;
    scene.soft_bodies = {ball("ball")};
    const std::uint32_t top = vertex_towards(scene.soft_bodies[0], Vec3d::UnitY());
    Scene pinned = scene;
    pinned.soft_bodies[0].pins = {top};
    scene.joints = {joint("nail", vertex_anchor("ball", top))};
    World hung = make(scene);
    World held = make(pinned);
    const Vec3d start = vertex_of(hung, 0, top);
    step_for(hung, 1.0);
    step_for(held, 1.0);
    EXPECT_LT((vertex_of(hung, 0, top) - start).norm(), 1e-3) << static_cast<int>(integrator);
    const Vec3d difference = hung.measure(0).centre_of_mass - held.measure(0).centre_of_mass;
    EXPECT_LT(difference.norm(), 0.02) << static_cast<int>(integrator);
    EXPECT_LT(hung.measure(0).centre_of_mass.y(), -0.01);
  }
}

TEST(Joint, BallHangsOnAFaceOfAnother) {
  for (const Integrator integrator : every_kind) {
    Scene scene;
    scene.gravity = Vec3d(0.0, -gravity_m_s2, 0.0);
    scene.stepping.substeps = 20;
    scene.stepping.integrator = integrator;
    scene.soft_bodies = {ball("upper"), ball("lower", {0.0, -1.2, 0.0})};
    for (SoftBody& body : scene.soft_bodies) body.springs.damping_n_s_m = 5.0;
    const SoftBody& upper = scene.soft_bodies[0];
    const std::uint32_t top = vertex_towards(upper, Vec3d::UnitY());
    std::uint32_t face = 0;
    const auto middle_of = [&](std::uint32_t index) {
      const Face& corners = upper.mesh->faces[index];
      Vec3d sum = Vec3d::Zero();
      for (const std::uint32_t corner : corners) sum += upper.mesh->positions_m[corner] / 3.0;
      return sum;
    };
    for (std::uint32_t i = 0; i < upper.mesh->faces.size(); ++i) {
      if (middle_of(i).y() < middle_of(face).y()) face = i;
    }
    Anchor on_face;
    on_face.of = Anchor::Of::soft;
    on_face.body = "upper";
    on_face.face = face;
    on_face.face_weights = Vec3d::Constant(1.0 / 3.0);
    scene.joints = {joint("nail", vertex_anchor("upper", top)), joint("tie", vertex_anchor("lower", top), on_face)};
    World world = make(scene);
    step_for(world, 6.0);
    Vec3d place = Vec3d::Zero();
    for (const std::uint32_t corner : upper.mesh->faces[face]) place += vertex_of(world, 0, corner) / 3.0;
    EXPECT_FALSE(world.is_frozen(0) || world.is_frozen(1)) << static_cast<int>(integrator);
    EXPECT_LT((vertex_of(world, 1, top) - place).norm(), 0.03) << static_cast<int>(integrator);
    EXPECT_LT(world.measure(1).kinetic_j, 0.05) << static_cast<int>(integrator);
    EXPECT_LT(world.measure(1).centre_of_mass.y(), place.y() - 0.3) << static_cast<int>(integrator);
  }
}

// A load of many times a ball's weight, tied to a vertex of it: carried at one step a tick.
TEST(Joint, LoadHangsOnAnImplicitBall) {
  Scene scene;
  scene.gravity = Vec3d(0.0, -gravity_m_s2, 0.0);
  scene.stepping.substeps = 1;
  scene.stepping.integrator = Integrator::implicit_euler;
  scene.soft_bodies = {ball("ball")};
  scene.soft_bodies[0].springs = {.stiffness_n_m = 1e5, .damping_n_s_m = 1.0};
  const std::uint32_t top = vertex_towards(scene.soft_bodies[0], Vec3d::UnitY());
  const std::uint32_t bottom = vertex_towards(scene.soft_bodies[0], -Vec3d::UnitY());
  scene.rigid_bodies = {bob("load", {0.0, -1.0, 0.0}, 100.0)};
  scene.joints = {joint("nail", vertex_anchor("ball", top)),
                  joint("hook", rigid_anchor("load", {0.0, 0.3, 0.0}), vertex_anchor("ball", bottom))};
  World world = make(scene);
  step_for(world, 20.0);
  const RigidState& load = world.rigid_bodies()[0];
  EXPECT_LT(load.velocity.norm(), 0.02);
  EXPECT_LT((load.position + load.orientation * Vec3d(0.0, 0.3, 0.0) - vertex_of(world, 0, bottom)).norm(), 0.06);
  EXPECT_GT(load.position.y(), -2.5);
}

Scene mixed_scene(Precision precision) {
  Scene scene = lively_scene();
  scene.stepping.precision = precision;
  scene.rigid_bodies.push_back(bob("bob", {-1.0, 1.2, 0.0}, 0.5));
  scene.joints = {joint("string", vertex_anchor("a", 3), rigid_anchor("stone"), DistanceLimit{1.2}),
                  joint("hinge", rigid_anchor("bob", {0.0, 0.4, 0.0}), rigid_anchor("stone", {0.0, -0.4, 0.0}),
                        HingeJoint{Vec3d::UnitZ()}),
                  joint("thread", vertex_anchor("b", 5))};
  scene.joints[2].break_force_n = 30.0;
  return scene;
}

TEST(Joint, SnapshotInMidMotionGoesOnWithTheSameBits) {
  for (const Precision precision : {Precision::single_precision, Precision::double_precision}) {
    for (const Integrator integrator : {Integrator::midpoint, Integrator::implicit_euler}) {
      Scene scene = mixed_scene(precision);
      scene.stepping.integrator = integrator;
      scene.stepping.substeps = integrator == Integrator::midpoint ? 16 : 2;
      World world = make(scene);
      run(world, 3);
      World early = make(scene);
      ASSERT_TRUE(early.restore(world.snapshot()).ok());
      run(world, 60);
      run(early, 60);
      EXPECT_EQ(early.state_hash(), world.state_hash());
      EXPECT_EQ(early.joints().size(), world.joints().size());
      World late = make(world.scene());
      ASSERT_TRUE(late.restore(world.snapshot()).ok());
      World from_the_start = make(scene);  // where the thread may not be broken yet
      ASSERT_TRUE(from_the_start.restore(world.snapshot()).ok());
      run(world, 60);
      run(late, 60);
      run(from_the_start, 60);
      EXPECT_EQ(late.state_hash(), world.state_hash());
      EXPECT_EQ(from_the_start.state_hash(), world.state_hash());
    }
  }
}

TEST(Joint, IsAddedAndRemovedWhileTheWorldRuns) {
  World world = make(scene_of({bob("bob", Vec3d::Zero())}, {}));
  step_for(world, 0.5);
  Scene scene = world.scene();
  scene.joints = {joint("hook", rigid_anchor("bob"))};  // where it is now
  const Vec3d caught = world.rigid_bodies()[0].position;
  ASSERT_TRUE(world.apply(scene).ok());
  step_for(world, 2.0);
  EXPECT_LT((world.rigid_bodies()[0].position - caught).norm(), 1e-3);
  scene = world.scene();
  scene.gravity.x() = 1.0;
  ASSERT_TRUE(world.apply(scene).ok());  // the joint goes on from where it was made
  step_for(world, 0.5);
  EXPECT_LT((world.rigid_bodies()[0].position - caught).norm(), 1e-3);
  scene = world.scene();
  scene.joints.clear();
  ASSERT_TRUE(world.apply(scene).ok());
  step_for(world, 1.0);
  EXPECT_LT(world.rigid_bodies()[0].position.y(), caught.y() - 4.0);
}

TEST(Joint, BodiesThatItTiesSleepAndWakeTogether) {
  Scene scene = scene_of({bob("upper", {0.0, -0.5, 0.0}), bob("lower", {0.0, -1.5, 0.0})},
                         {joint("a", rigid_anchor("upper", {0.0, 0.5, 0.0})),
                          joint("b", rigid_anchor("lower", {0.0, 0.5, 0.0}), rigid_anchor("upper", {0.0, -0.5, 0.0}))});
  World world = make(scene);
  step_for(world, 2.0);
  EXPECT_TRUE(world.rigid_bodies()[0].rest.asleep);
  EXPECT_TRUE(world.rigid_bodies()[1].rest.asleep);
  ASSERT_TRUE(world.apply_impulse("lower", WholeBody{}, Vec3d(0.1, 0.0, 0.0)).ok());
  EXPECT_TRUE(world.rigid_bodies()[0].is_awake());
  step_for(world, 0.1);
  scene = world.scene();
  scene.joints.clear();
  ASSERT_TRUE(world.apply(scene).ok());
  step_for(world, 0.1);
  EXPECT_TRUE(world.rigid_bodies()[0].is_awake());
}

TEST(Joint, MovingColliderTakesABodyAlong) {
  Scene scene = scene_of({bob("bob", {0.0, 1.0, 0.0})}, {});
  Collider arm;
  arm.name = "arm";
  arm.shape = SphereShape{0.1};
  arm.angular_velocity = {0.0, 0.0, 1.0};
  scene.colliders = {arm};
  Anchor end;
  end.of = Anchor::Of::collider;
  end.body = "arm";
  scene.joints = {joint("grip", rigid_anchor("bob"), end)};
  World world = make(scene);
  step_for(world, 2.0);
  EXPECT_LT((world.rigid_bodies()[0].position - Vec3d(-std::sin(2.0), std::cos(2.0), 0.0)).norm(), 0.01);
}

TEST(Joint, BadOnesAreRefusedWithWhatAndWhere) {
  Scene good = lively_scene();
  good.joints = {joint("j", vertex_anchor("a", 3), rigid_anchor("stone"))};
  ASSERT_TRUE(World::create(good).ok());
  const auto refused = [&](const std::function<void(Joint&)>& spoil, const std::string& where) {
    Scene scene = good;
    spoil(scene.joints[0]);
    const auto world = World::create(scene);
    ASSERT_FALSE(world.ok()) << where;
    EXPECT_EQ(world.status().where(), "joints[0]" + where) << world.status().message();
  };
  refused([](Joint& j) { j.name.clear(); }, ".name");
  refused([](Joint& j) { j.first.body = "nobody"; }, ".first.soft_body");
  refused([](Joint& j) { j.second.body = "a"; }, ".second.rigid_body");
  refused([](Joint& j) { j.first.vertex = 100'000; }, ".first.vertex");
  refused([](Joint& j) { j.first.vertex.reset(); }, ".first.at");
  const auto on_face = [](Joint& j, std::uint32_t face, const Vec3d& weights) {
    j.first.vertex.reset();
    j.first.face = face;
    j.first.face_weights = weights;
  };
  refused([&](Joint& j) { on_face(j, 100'000, Vec3d(1.0, 0.0, 0.0)); }, ".first.face_point.face");
  refused([&](Joint& j) { on_face(j, 0, Vec3d(0.5, 0.4, 0.0)); }, ".first.face_point.weights");
  refused([&](Joint& j) { on_face(j, 0, Vec3d(1.5, -0.5, 0.0)); }, ".first.face_point.weights.x");
  refused([&](Joint& j) { on_face(j, 0, Vec3d(0.8, 0.4, -0.2)); }, ".first.face_point.weights");
  refused([](Joint& j) { j.second.point_m = Vec3d(0.0, std::nan(""), 0.0); }, ".second.point.y");
  refused([](Joint& j) { j.kind = HingeJoint{}; }, ".hinge");
  refused([](Joint& j) { j.kind = SliderJoint{}; }, ".slider");
  refused([](Joint& j) { j.kind = DistanceLimit{0.0}; }, ".distance_limit.longest_m");
  refused([](Joint& j) { j.kind = DistanceLimit{std::nan("")}; }, ".distance_limit.longest_m");
  refused([](Joint& j) { j.compliance_m_n = -1.0; }, ".compliance_m_n");
  refused([](Joint& j) { j.break_force_n = 0.0; }, ".break_force_n");
  refused([](Joint& j) { j.break_force_n = std::nan(""); }, ".break_force_n");
  refused([](Joint& j) { j.second = j.first; }, ".second");
  refused(
      [](Joint& j) {
        j.first = Anchor{};
        j.second = Anchor{};
      },
      ".first");
  Scene twice = good;
  twice.joints.push_back(twice.joints[0]);
  EXPECT_EQ(World::create(twice).status().where(), "joints[1].name");
}

}  // namespace
}  // namespace pneuma::physics
