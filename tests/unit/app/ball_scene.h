// A small scene for the tests of this folder: a ball of 42 vertices with gas in it, over a floor.
#pragma once

#include <string>

#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

inline v1::Scene ball_scene() {
  v1::Scene scene;
  scene.set_name("ball");
  scene.mutable_gravity()->set_y(-9.81);
  scene.mutable_stepping()->set_substeps(4);
  v1::Mesh& mesh = *scene.add_meshes();
  mesh.set_name("sphere");
  mesh.mutable_icosphere()->set_subdivisions(1);
  v1::SoftBody& ball = *scene.add_soft_bodies();
  ball.set_name("ball");
  ball.set_mesh("sphere");
  ball.mutable_position()->set_y(3.0);
  ball.mutable_springs()->set_stiffness_n_m(200.0);
  ball.mutable_springs()->set_damping_n_s_m(0.5);
  ball.mutable_gas()->set_moles(0.01);
  v1::Collider& floor = *scene.add_colliders();
  floor.set_name("floor");
  floor.mutable_shape()->mutable_plane();
  return scene;
}

inline v1::ClientMessage impulse_up(const std::string& body, double n_s) {
  v1::ClientMessage message;
  message.set_request_id(1);
  message.mutable_impulse()->set_world("w");
  message.mutable_impulse()->set_body(body);
  message.mutable_impulse()->mutable_impulse()->set_y(n_s);
  return message;
}

inline v1::ClientMessage add_second_ball() {
  v1::ClientMessage message;
  message.set_request_id(1);
  message.mutable_edit()->set_world("w");
  v1::SoftBody ball = ball_scene().soft_bodies(0);
  ball.set_name("second");
  ball.mutable_position()->set_x(5.0);
  *message.mutable_edit()->mutable_edit()->add_changes()->mutable_add_soft_body() = ball;
  return message;
}

inline v1::ClientMessage grab_vertex(std::uint32_t vertex) {
  v1::ClientMessage message;
  message.set_request_id(1);
  message.mutable_grab()->set_world("w");
  message.mutable_grab()->set_body("ball");
  message.mutable_grab()->set_vertex(vertex);
  message.mutable_grab()->mutable_target()->set_y(4.0);
  return message;
}

}  // namespace pneuma::app
