#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>

#include "bench/peers.h"

namespace pneuma::bench {

struct BulletBall::Body {
  btSoftBodyWorldInfo world;
  std::unique_ptr<btSoftBody> body;
  btScalar dt_s = 0;
};

BulletBall::BulletBall(const physics::Mesh& mesh, const BallCase& ball, const BulletSettings& settings)
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
  body_->body->m_materials[0]->m_kLST = static_cast<btScalar>(settings.link_stiffness);
  body_->body->m_cfg.kPR = static_cast<btScalar>(ball.nrt_j);
  body_->body->m_cfg.kDP = static_cast<btScalar>(settings.damping);
  body_->body->m_cfg.piterations = settings.iterations;
  body_->dt_s = static_cast<btScalar>(ball.dt_s);
}

BulletBall::~BulletBall() = default;
BulletBall::BulletBall(BulletBall&&) noexcept = default;

void BulletBall::set_masses(std::span<const double> masses_kg) {
  for (int i = 0; i < body_->body->m_nodes.size(); ++i) {
    body_->body->setMass(i, static_cast<btScalar>(masses_kg[static_cast<std::size_t>(i)]));
  }
}

void BulletBall::set_link_stiffness(std::span<const double> of_vertices) {
  btSoftBody& body = *body_->body;
  const auto of = [&](const btSoftBody::Node* node) {
    return of_vertices[static_cast<std::size_t>(node - &body.m_nodes[0])];
  };
  for (int i = 0; i < body.m_links.size(); ++i) {
    btSoftBody::Link& link = body.m_links[i];
    link.m_material = body.appendMaterial();
    link.m_material->m_kLST = static_cast<btScalar>(0.5 * (of(link.m_n[0]) + of(link.m_n[1])));
  }
  body.updateLinkConstants();
}

void BulletBall::place(std::span<const Eigen::Vector3d> positions_m, std::span<const Eigen::Vector3d> velocities_m_s) {
  if (body_->body->m_bUpdateRtCst) {  // else the first step takes the links' lengths from where the vertices are then
    body_->body->updateConstants();
    body_->body->m_bUpdateRtCst = false;
  }
  const auto to_bullet = [](const Eigen::Vector3d& of) {
    return btVector3(static_cast<btScalar>(of.x()), static_cast<btScalar>(of.y()), static_cast<btScalar>(of.z()));
  };
  for (int i = 0; i < body_->body->m_nodes.size(); ++i) {
    btSoftBody::Node& node = body_->body->m_nodes[i];
    node.m_x = node.m_q = to_bullet(positions_m[static_cast<std::size_t>(i)]);
    node.m_v = to_bullet(velocities_m_s[static_cast<std::size_t>(i)]);
  }
  body_->body->updateNormals();  // the first step's pressure goes along them
}

std::vector<Eigen::Vector3d> BulletBall::positions_m() const {
  std::vector<Eigen::Vector3d> positions;
  for (int i = 0; i < body_->body->m_nodes.size(); ++i) {
    const btVector3& x = body_->body->m_nodes[i].m_x;
    positions.emplace_back(x.x(), x.y(), x.z());
  }
  return positions;
}

std::vector<Eigen::Vector3d> BulletBall::velocities_m_s() const {
  std::vector<Eigen::Vector3d> velocities;
  for (int i = 0; i < body_->body->m_nodes.size(); ++i) {
    const btVector3& v = body_->body->m_nodes[i].m_v;
    velocities.emplace_back(v.x(), v.y(), v.z());
  }
  return velocities;
}

void BulletBall::step() {
  body_->body->predictMotion(body_->dt_s);
  body_->body->solveConstraints();
  body_->body->integrateMotion();
}

double BulletBall::volume_m3() const {
  return static_cast<double>(body_->body->getVolume());
}

}  // namespace pneuma::bench
