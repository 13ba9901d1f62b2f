#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>

#include "bench/peers.h"

namespace pneuma::bench {

struct BulletBall::Body {
  btSoftBodyWorldInfo world;
  std::unique_ptr<btSoftBody> body;
  btScalar dt_s = 0;
};

BulletBall::BulletBall(const physics::Mesh& mesh, const BallCase& ball, const BulletSolver& solver)
    : body_(std::make_unique<Body>()) {
  std::vector<btScalar> coordinates;
  for (const auto& position : mesh.positions_m) {
    for (int axis = 0; axis < 3; ++axis) coordinates.push_back(static_cast<btScalar>(position[axis]));
  }
  std::vector<int> triangles;
  for (const auto& face : mesh.faces) {
    for (const std::uint32_t vertex : face) triangles.push_back(static_cast<int>(vertex));
  }
  body_->world.m_gravity = {0, static_cast<btScalar>(ball.gravity_m_s2), 0};
  body_->world.m_sparsesdf.Initialize();
  body_->body.reset(btSoftBodyHelpers::CreateFromTriMesh(body_->world, coordinates.data(), triangles.data(),
                                                         static_cast<int>(mesh.faces.size()), false));
  body_->body->setTotalMass(static_cast<btScalar>(ball.mass_kg));
  body_->body->m_materials[0]->m_kLST = static_cast<btScalar>(solver.link_stiffness);
  body_->body->m_cfg.kPR = static_cast<btScalar>(ball.nrt_j);
  body_->body->m_cfg.kDP = 0.01F;
  body_->body->m_cfg.piterations = solver.iterations;
  body_->dt_s = static_cast<btScalar>(ball.dt_s);
}

BulletBall::~BulletBall() = default;
BulletBall::BulletBall(BulletBall&&) noexcept = default;

void BulletBall::step() {
  body_->body->predictMotion(body_->dt_s);
  body_->body->solveConstraints();
  body_->body->integrateMotion();
}

double BulletBall::volume_m3() const {
  return static_cast<double>(body_->body->getVolume());
}

}  // namespace pneuma::bench
