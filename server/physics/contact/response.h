// What a body does with an impulse at one of its points.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <variant>
#include <vector>

#include "physics/contact/factored_response.h"
#include "physics/contact/row.h"

namespace pneuma::physics {

/// A surface that does not give way.
struct FixedResponse {
  [[nodiscard]] double number_1_kg(const Support&, const Support&) const { return 0.0; }
  [[nodiscard]] LowRankColumns columns(const Support&) const { return {}; }
  [[nodiscard]] Vec3d change_m_s(const Support&) const { return Vec3d::Zero(); }
  [[nodiscard]] Eigen::Matrix3d inverse_mass_1_kg(const Support&, const Support&) const {
    return Eigen::Matrix3d::Zero();
  }
  void push(const Support&, const Vec3d&) {}
};

/// A body whose vertices answer by their masses alone, as explicit steps and XPBD have it.
class LumpedResponse {
 public:
  /// `inverse_masses_1_kg`: one a vertex, 0 of pinned ones. Both lists outlive the response; `changes_m_s` begins at 0.
  LumpedResponse(std::span<const double> inverse_masses_1_kg, std::span<Vec3d> changes_m_s)
      : inverse_masses_1_kg_(inverse_masses_1_kg), changes_m_s_(changes_m_s) {}

  [[nodiscard]] Vec3d change_m_s(const Support& at) const {
    Vec3d sum = Vec3d::Zero();
    for (std::uint32_t i = 0; i < at.count; ++i) sum += at.weights[i] * changes_m_s_[at.vertices[i]];
    return sum;
  }
  [[nodiscard]] double number_1_kg(const Support& at, const Support& by) const {
    double sum = 0.0;
    for (std::uint32_t i = 0; i < at.count; ++i) {
      for (std::uint32_t j = 0; j < by.count; ++j) {
        if (at.vertices[i] != by.vertices[j]) continue;
        sum += at.weights[i] * by.weights[j] * inverse_masses_1_kg_[at.vertices[i]];
      }
    }
    return sum;
  }
  [[nodiscard]] LowRankColumns columns(const Support&) const { return {}; }
  [[nodiscard]] Eigen::Matrix3d inverse_mass_1_kg(const Support& at, const Support& by) const {
    return number_1_kg(at, by) * Eigen::Matrix3d::Identity();
  }
  void push(const Support& at, const Vec3d& impulse_n_s) {
    for (std::uint32_t i = 0; i < at.count; ++i) {
      changes_m_s_[at.vertices[i]] += at.weights[i] * inverse_masses_1_kg_[at.vertices[i]] * impulse_n_s;
    }
  }

 private:
  std::span<const double> inverse_masses_1_kg_;
  std::span<Vec3d> changes_m_s_;
};

/// L of L L^T, for a matrix that may have rows of zeros.
[[nodiscard]] inline Eigen::Matrix3d lower_root(const Eigen::Matrix3d& matrix) {
  Eigen::Matrix3d root = Eigen::Matrix3d::Zero();
  for (Eigen::Index k = 0; k < 3; ++k) {
    const double left = matrix(k, k) - root.row(k).squaredNorm();
    if (!(left > 1e-14 * matrix(k, k))) continue;
    root(k, k) = std::sqrt(left);
    for (Eigen::Index i = k + 1; i < 3; ++i) root(i, k) = (matrix(i, k) - root.row(i).dot(root.row(k))) / root(k, k);
  }
  return root;
}

/// A rigid body: its mass along the world's axes and its inertia; zeros where it is locked.
class RigidResponse {
 public:
  RigidResponse(const Vec3d& inverse_masses_1_kg, const Eigen::Matrix3d& inverse_inertia_1_kg_m2)
      : inverse_masses_1_kg_(inverse_masses_1_kg), inverse_inertia_1_kg_m2_(inverse_inertia_1_kg_m2) {}
  RigidResponse(double inverse_mass_1_kg, const Eigen::Matrix3d& inverse_inertia_1_kg_m2)
      : RigidResponse(Vec3d::Constant(inverse_mass_1_kg), inverse_inertia_1_kg_m2) {}

  [[nodiscard]] Vec3d change_m_s(const Support& at) const {
    if (at.turns) return turning_;
    return velocity_ + turning_.cross(at.arm);
  }
  [[nodiscard]] Eigen::Matrix3d inverse_mass_1_kg(const Support& at, const Support& by) const {
    if (at.turns && by.turns) return inverse_inertia_1_kg_m2_;
    if (at.turns) return inverse_inertia_1_kg_m2_ * cross_matrix(by.arm);
    if (by.turns) return -cross_matrix(at.arm) * inverse_inertia_1_kg_m2_;
    return Eigen::Matrix3d(inverse_masses_1_kg_.asDiagonal()) +
           cross_matrix(at.arm) * inverse_inertia_1_kg_m2_ * cross_matrix(by.arm).transpose();
  }
  [[nodiscard]] double number_1_kg(const Support&, const Support&) const { return 0.0; }
  [[nodiscard]] LowRankColumns columns(const Support& at) const {
    LowRankColumns low_rank;
    const Eigen::Matrix3d root = lower_root(inverse_inertia_1_kg_m2_);
    low_rank.columns.leftCols<3>() = at.turns ? root : Eigen::Matrix3d(-cross_matrix(at.arm) * root);
    if (!at.turns) low_rank.columns.middleCols<3>(3) = inverse_masses_1_kg_.cwiseSqrt().asDiagonal();
    return low_rank;
  }
  void push(const Support& at, const Vec3d& impulse_n_s) {
    if (at.turns) {
      turning_ += inverse_inertia_1_kg_m2_ * impulse_n_s;
      return;
    }
    velocity_ += inverse_masses_1_kg_.cwiseProduct(impulse_n_s);
    turning_ += inverse_inertia_1_kg_m2_ * at.arm.cross(impulse_n_s);
  }

  [[nodiscard]] const Vec3d& velocity_change_m_s() const { return velocity_; }
  [[nodiscard]] const Vec3d& turning_change_rad_s() const { return turning_; }

 private:
  Vec3d inverse_masses_1_kg_;
  Eigen::Matrix3d inverse_inertia_1_kg_m2_;
  Vec3d velocity_ = Vec3d::Zero();
  Vec3d turning_ = Vec3d::Zero();
};

using Response = std::variant<FixedResponse, LumpedResponse, RigidResponse, FactoredResponse>;

/// The two parts of every body's inverse mass between two supports. D has the columns' signs on its diagonal:
///
///     inverse_mass_1_kg(at, by) = number_1_kg(at, by) 1 + columns(at) D columns(by)^T
[[nodiscard]] inline double number_1_kg(const Response& response, const Support& at, const Support& by) {
  return std::visit([&](const auto& body) { return body.number_1_kg(at, by); }, response);
}

[[nodiscard]] inline LowRankColumns columns(const Response& response, const Support& at) {
  return std::visit([&](const auto& body) { return body.columns(at); }, response);
}

[[nodiscard]] inline Vec3d change_m_s(const Response& response, const Support& at) {
  return std::visit([&](const auto& body) { return body.change_m_s(at); }, response);
}

[[nodiscard]] inline Eigen::Matrix3d inverse_mass_1_kg(const Response& response, const Support& at, const Support& by) {
  return std::visit([&](const auto& body) { return body.inverse_mass_1_kg(at, by); }, response);
}

inline void push(Response& response, const Support& at, const Vec3d& impulse_n_s) {
  std::visit([&](auto& body) { body.push(at, impulse_n_s); }, response);
}

/// Calls add(of, from, sign) for each two supports of the rows that are of one body.
template <class Add>
void for_shared_bodies(const ContactRow& at, const ContactRow& by, const Add& add) {
  if (at.first.body == by.first.body) add(at.first, by.first, 1.0);
  if (at.first.body == by.second.body) add(at.first, by.second, -1.0);
  if (at.second.body == by.first.body) add(at.second, by.first, -1.0);
  if (at.second.body == by.second.body) add(at.second, by.second, 1.0);
}

/// How the relative velocity of one row answers to the impulse of another.
[[nodiscard]] inline Eigen::Matrix3d coupling_1_kg(std::span<const Response> responses, const ContactRow& at,
                                                   const ContactRow& by) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for_shared_bodies(at, by, [&](const Support& of, const Support& from, double sign) {
    sum += sign * inverse_mass_1_kg(responses[of.body], of, from);
  });
  return sum;
}

/// The number in it that the bodies' columns do not hold.
[[nodiscard]] inline double coupling_number_1_kg(std::span<const Response> responses, const ContactRow& at,
                                                 const ContactRow& by) {
  double sum = 0.0;
  for_shared_bodies(at, by, [&](const Support& of, const Support& from, double sign) {
    sum += sign * number_1_kg(responses[of.body], of, from);
  });
  return sum;
}

inline void push_both(std::span<Response> responses, const ContactRow& row, const Vec3d& impulse_n_s) {
  push(responses[row.first.body], row.first, impulse_n_s);
  push(responses[row.second.body], row.second, -impulse_n_s);
}

}  // namespace pneuma::physics
