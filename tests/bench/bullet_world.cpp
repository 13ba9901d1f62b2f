#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>

#include "bench/peers.h"

namespace pneuma::bench {
namespace {

// Of a body's skin, in which it collides. Bullet's own 0.25 m would be half the radius of the scenes' balls.
constexpr btScalar margin_m = btScalar(0.01);

btVector3 to_bullet(const Eigen::Vector3d& of) {
  return {static_cast<btScalar>(of.x()), static_cast<btScalar>(of.y()), static_cast<btScalar>(of.z())};
}

Eigen::Vector3d from_bullet(const btVector3& of) {
  return {of.x(), of.y(), of.z()};
}

}  // namespace

struct BulletWorld::Bodies {
  struct Box {
    std::unique_ptr<btBoxShape> shape;
    std::unique_ptr<btRigidBody> body;
  };

  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btSoftRigidDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration};
  std::vector<std::unique_ptr<btSoftBody>> balls;
  std::vector<Box> boxes;
};

BulletWorld::BulletWorld(double gravity_m_s2) : bodies_(std::make_unique<Bodies>()) {
  const btVector3 gravity(0, static_cast<btScalar>(gravity_m_s2), 0);
  bodies_->world.setGravity(gravity);
  btSoftBodyWorldInfo& info = bodies_->world.getWorldInfo();
  info.m_gravity = gravity;
  info.m_broadphase = &bodies_->broadphase;
  info.m_dispatcher = &bodies_->dispatcher;
  info.m_sparsesdf.Initialize();
}

BulletWorld::~BulletWorld() {
  for (const auto& ball : bodies_->balls) bodies_->world.removeSoftBody(ball.get());
  for (const Bodies::Box& box : bodies_->boxes) bodies_->world.removeRigidBody(box.body.get());
}

void BulletWorld::add_ball(const physics::Mesh& mesh, const BallCase& ball, const BulletSettings& settings,
                           const Eigen::Vector3d& position_m, const Eigen::Vector3d& velocity_m_s) {
  std::vector<btScalar> coordinates;
  for (const Eigen::Vector3d& x : mesh.positions_m) {
    for (int axis = 0; axis < 3; ++axis) coordinates.push_back(static_cast<btScalar>(x[axis]));
  }
  std::vector<int> triangles;
  for (const physics::Face& face : mesh.faces) {
    for (const std::uint32_t vertex : face) triangles.push_back(static_cast<int>(vertex));
  }
  std::unique_ptr<btSoftBody> body(btSoftBodyHelpers::CreateFromTriMesh(
      bodies_->world.getWorldInfo(), coordinates.data(), triangles.data(), static_cast<int>(mesh.faces.size()), false));
  body->setTotalMass(static_cast<btScalar>(ball.mass_kg));
  body->m_materials[0]->m_kLST = static_cast<btScalar>(settings.link_stiffness);
  body->m_cfg.kPR = static_cast<btScalar>(ball.nrt_j);
  body->m_cfg.kDP = static_cast<btScalar>(settings.damping);
  body->m_cfg.piterations = settings.iterations;
  body->getCollisionShape()->setMargin(margin_m);
  body->m_cfg.collisions = btSoftBody::fCollision::SDF_RS | btSoftBody::fCollision::VF_SS;
  body->translate(to_bullet(position_m));
  body->setVelocity(to_bullet(velocity_m_s));
  bodies_->world.addSoftBody(body.get());
  bodies_->balls.push_back(std::move(body));
}

void BulletWorld::add_box(const Eigen::Vector3d& half_extents_m, double mass_kg, const Eigen::Vector3d& position_m) {
  Bodies::Box box;
  box.shape = std::make_unique<btBoxShape>(to_bullet(half_extents_m));
  btVector3 inertia(0, 0, 0);
  const auto mass = static_cast<btScalar>(mass_kg);
  if (mass_kg > 0.0) box.shape->calculateLocalInertia(mass, inertia);
  btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, box.shape.get(), inertia);
  info.m_startWorldTransform = btTransform(btQuaternion::getIdentity(), to_bullet(position_m));
  box.body = std::make_unique<btRigidBody>(info);
  bodies_->world.addRigidBody(box.body.get());
  bodies_->boxes.push_back(std::move(box));
}

void BulletWorld::step(double dt_s) {
  bodies_->world.stepSimulation(static_cast<btScalar>(dt_s), 0);
}

std::vector<Eigen::Vector3d> BulletWorld::ball_m(std::size_t index) const {
  std::vector<Eigen::Vector3d> positions;
  const btSoftBody& ball = *bodies_->balls[index];
  for (int i = 0; i < ball.m_nodes.size(); ++i) positions.push_back(from_bullet(ball.m_nodes[i].m_x));
  return positions;
}

Eigen::Vector3d BulletWorld::box_m(std::size_t index) const {
  return from_bullet(bodies_->boxes[index].body->getWorldTransform().getOrigin());
}

}  // namespace pneuma::bench
