// The laws that solved rows keep, for tests of who solves them.
#pragma once

#include <cmath>
#include <span>
#include <variant>

#include <gtest/gtest.h>

#include "physics/contact/response.h"
#include "physics/contact/row.h"

namespace pneuma::physics {

inline Vec3d velocity_m_s(const ContactRow& row, std::span<const Response> responses) {
  const auto change = [&](const Support& at) {
    return std::visit([&](const auto& body) { return body.change_m_s(at); }, responses[at.body]);
  };
  return row.free_m_s + change(row.first) - change(row.second);
}

/// How many rows of each kind there were: a test of none shows nothing.
struct Presses {
  int pressed = 0;
  int stuck = 0;
  int slid = 0;

  Presses operator+(const Presses& other) const {
    return {pressed + other.pressed, stuck + other.stuck, slid + other.slid};
  }
};

/// Expects the laws to hold, to tolerances of velocity and of impulse.
inline Presses expect_laws(std::span<const ContactRow> rows, std::span<const Response> responses, double off_m_s,
                           double off_n_s) {
  Presses presses;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const ContactRow& row = rows[i];
    SCOPED_TRACE(testing::Message() << "row " << i);
    const Vec3d velocity = velocity_m_s(row, responses);
    const double parting_m_s = velocity.dot(row.normal) - row.least_m_s;
    const double pressed_n_s = row.impulse_n_s.dot(row.normal);
    EXPECT_GE(parting_m_s, -off_m_s);
    EXPECT_GE(pressed_n_s, -off_n_s);
    if (pressed_n_s > off_n_s) {
      EXPECT_LT(std::abs(parting_m_s), off_m_s);
      ++presses.pressed;
    }
    const Vec3d slip_m_s = velocity - velocity.dot(row.normal) * row.normal;
    const Vec3d rubbed_n_s = row.impulse_n_s - pressed_n_s * row.normal;
    EXPECT_LE(rubbed_n_s.norm(), row.friction * pressed_n_s + off_n_s);
    if (rubbed_n_s.norm() < row.friction * pressed_n_s - off_n_s) {
      EXPECT_LT(slip_m_s.norm(), off_m_s);
      ++presses.stuck;
    } else if (slip_m_s.norm() > off_m_s && rubbed_n_s.norm() > off_n_s) {
      EXPECT_LT((slip_m_s.normalized() + rubbed_n_s.normalized()).norm(), 1e-3 + off_n_s / rubbed_n_s.norm());
      ++presses.slid;
    }
  }
  return presses;
}

}  // namespace pneuma::physics
