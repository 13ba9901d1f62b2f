// What our step is timed against: the same ball in Bullet, in plain C++ as the paper says it, and by our own kernels
// with nothing around them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "physics/lanes/lane_step.h"
#include "physics/mesh/hinge.h"
#include "physics/world.h"

namespace pneuma::bench {

/// The ball that every peer steps: springs with damping, gas with the exact volume, gravity. The hand-written one may
/// be without damping or gas, at 0, and may bend.
struct BallCase {
  double mass_kg = 1.0;
  double stiffness_n_m = 100.0;
  double damping_n_s_m = 0.1;
  double nrt_j = 40.0;
  double bend_stiffness_n_m = 0.0;
  double gravity_m_s2 = -9.81;
  double dt_s = 1.0 / 3840.0;
};

/// It as a body of ours, the index-th of a row of them.
[[nodiscard]] physics::SoftBody soft_ball(std::shared_ptr<const physics::Mesh> mesh, const BallCase& ball,
                                          std::size_t index);
/// A row of such balls that touch nothing, in single precision by symplectic Euler, so many steps a tick. They do not
/// look for rest, which no peer does.
[[nodiscard]] physics::Scene ball_scene(const std::shared_ptr<const physics::Mesh>& mesh, const BallCase& ball,
                                        std::size_t count, std::uint32_t substeps);

/// Springs edge by edge, volume and pressure face by face, symplectic Euler; one thread, one body after the other.
class PlainBall {
 public:
  PlainBall(const physics::Mesh& mesh, const BallCase& ball);
  void step();
  [[nodiscard]] double volume_m3() const { return volume_m3_; }

 private:
  struct Point {
    float x, y, z;
  };
  BallCase ball_;
  std::vector<physics::Edge> edges_;
  std::vector<physics::Face> faces_;
  std::vector<float> rest_lengths_m_;
  std::vector<Point> x_;
  std::vector<Point> v_;
  std::vector<Point> force_;
  double volume_m3_ = 0.0;
};

/// How hard Bullet works, and how it damps.
struct BulletSettings {
  int iterations = 5;           // passes of the position solver, a step
  double link_stiffness = 0.5;  // share of a spring's strain that a pass takes away; there is no stiffness in N/m
  double damping = 0.01;        // of 1, of all motion
};

/// Bullet's btSoftBody with pressure; no world, so that nothing but the body is stepped.
class BulletBall {
 public:
  BulletBall(const physics::Mesh& mesh, const BallCase& ball, const BulletSettings& settings = {});
  ~BulletBall();
  BulletBall(BulletBall&&) noexcept;
  /// Of each vertex; one of 0 is fixed.
  void set_masses(std::span<const double> masses_kg);
  /// Of each vertex, in the place of the settings' one; a link has the mean of its ends.
  void set_link_stiffness(std::span<const double> of_vertices);
  /// Puts the vertices there; the links keep the mesh's lengths.
  void place(std::span<const Eigen::Vector3d> positions_m, std::span<const Eigen::Vector3d> velocities_m_s);
  void step();
  [[nodiscard]] std::vector<Eigen::Vector3d> positions_m() const;
  [[nodiscard]] std::vector<Eigen::Vector3d> velocities_m_s() const;
  [[nodiscard]] double volume_m3() const;

 private:
  struct Body;
  std::unique_ptr<Body> body_;
};

/// Bullet's world of soft and rigid bodies, which collide with each other.
class BulletWorld {
 public:
  explicit BulletWorld(double gravity_m_s2);
  ~BulletWorld();
  /// The case's gravity and step count for nothing.
  void add_ball(const physics::Mesh& mesh, const BallCase& ball, const BulletSettings& settings,
                const Eigen::Vector3d& position_m, const Eigen::Vector3d& velocity_m_s);
  /// Fixed where `mass_kg` is 0.
  void add_box(const Eigen::Vector3d& half_extents_m, double mass_kg, const Eigen::Vector3d& position_m);
  void step(double dt_s);
  [[nodiscard]] std::vector<Eigen::Vector3d> ball_m(std::size_t index) const;
  [[nodiscard]] Eigen::Vector3d box_m(std::size_t index) const;

 private:
  struct Bodies;
  std::unique_ptr<Bodies> bodies_;
};

/// The scene of one ball as one would write it who needs nothing else: the kernels of just its features, called in a
/// row.
class HandWrittenBall {
 public:
  HandWrittenBall(const physics::Mesh& mesh, const BallCase& ball);
  void step(std::uint32_t substeps);
  /// Whether every vertex has the same bits as the world's first body.
  [[nodiscard]] bool is_where(const physics::World& world) const;

 private:
  void add_bending();

  bool gas_;
  bool damped_;
  double nrt_j_;
  double bend_stiffness_n_m_;
  std::vector<physics::Hinge> hinges_;
  std::vector<Eigen::Vector3f> bent_m_, bending_n_;  // in the order of the mesh
  physics::LaneMesh<float> mesh_;
  const physics::LaneKernels<float>& kernels_;
  physics::LaneArray<float> x_, v_, force_, gradient_;
  physics::PerLane<float> volumes_18_m3_;
  physics::RingPass<float> ring_;
  physics::UpdatePass<float> update_;
};

}  // namespace pneuma::bench
