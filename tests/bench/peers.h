// What our step is timed against: the same ball in Bullet, and in plain C++ as the paper says it.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "physics/mesh.h"

namespace pneuma::bench {

/// The ball that every peer steps: springs with damping, gas with the exact volume, gravity.
struct BallCase {
  double mass_kg = 1.0;
  double stiffness_n_m = 100.0;
  double damping_n_s_m = 0.1;
  double nrt_j = 40.0;
  double gravity_m_s2 = -9.81;
  double dt_s = 1.0 / 3840.0;
};

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

/// How hard Bullet works: the passes of its position solver a step, and the share of a spring's strain that each takes
/// away (m_kLST, at most 1). Its springs have no stiffness in N/m.
struct BulletSolver {
  int iterations = 5;
  double link_stiffness = 0.5;
};

/// Bullet's btSoftBody with pressure; no world, so that nothing but the body is stepped.
class BulletBall {
 public:
  BulletBall(const physics::Mesh& mesh, const BallCase& ball, const BulletSolver& solver = {});
  ~BulletBall();
  BulletBall(BulletBall&&) noexcept;
  void step();
  [[nodiscard]] double volume_m3() const;

 private:
  struct Body;
  std::unique_ptr<Body> body_;
};

}  // namespace pneuma::bench
