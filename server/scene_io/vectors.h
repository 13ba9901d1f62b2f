// Vectors and rotations as messages have them.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "pneuma/v1/scene.pb.h"

namespace pneuma::scene_io {

inline void set(v1::Vec3& out, const Eigen::Vector3d& vector) {
  out.set_x(vector.x());
  out.set_y(vector.y());
  out.set_z(vector.z());
}

inline void set(v1::Quaternion& out, const Eigen::Quaterniond& rotation) {
  out.set_w(rotation.w());
  out.set_x(rotation.x());
  out.set_y(rotation.y());
  out.set_z(rotation.z());
}

}  // namespace pneuma::scene_io
