// The impulses of rows that are solved together: those of contacts press and rub within Coulomb's cone, those of joints
// hold.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/contact/body_rows.h"
#include "physics/contact/dense_rows.h"
#include "physics/contact/step_mix.h"

namespace pneuma::physics {

/// f within the rows' cones and v = W f + q, m/s, so that a contact neither closes nor pulls, and slips only against
/// all of its friction; a joint's v is 0. `Rows` holds W: DenseRows or BodyRows.
///
/// Source: the alternating direction method of multipliers, as in Boyd et al., "Distributed Optimization and
/// Statistical Learning via the Alternating Direction Method of Multipliers", 2011. Its convex program has friction
/// where De Saxcé and Feng, "The bipotential method", 1998, have it: a contact that slips by u is asked to open by
/// friction times |u|. That u follows the method's steps. Those are mixed (step_mix.h).
template <class Rows>
class FrictionProgram {
 public:
  /// `rows` is complete, and outlives the program.
  explicit FrictionProgram(Rows& rows);

  /// Of a contact along its normal and across it: how it answers to itself, 1/kg.
  struct Own {
    double along_1_kg = 0.0;
    double across_1_kg = 0.0;  // the most of any direction
    double mean_1_kg = 0.0;    // of three directions
  };
  /// `free_m_s` is q; of a contact less what it may have along its normal. A row that nothing moves keeps no impulse.
  void set_contact(std::size_t row, const Vec3d& normal, double friction, const Own& own, const Vec3d& free_m_s,
                   const Vec3d& start_n_s);
  /// Its impulse may be any; where it has a guide, any across that.
  void set_tie(std::size_t row, const Own& own, const Vec3d& free_m_s, const Vec3d& start_n_s);
  void set_guide(std::size_t row, const Vec3d& guide, const Own& own, const Vec3d& free_m_s, const Vec3d& start_n_s);

  /// Whether no row is off by more than that in the end. Impulses are within their cones in any case, and the nearest
  /// that were found.
  bool solve(double enough_m_s);
  /// By how much of velocity the row that is off most is off: what an answer to it alone would change.
  [[nodiscard]] double off_m_s() const { return off_m_s_; }
  [[nodiscard]] std::uint32_t factorisations() const { return factorisations_; }
  [[nodiscard]] Vec3d impulse(std::size_t row) const { return at_row(best_n_s_, row); }

 private:
  enum class Kind : std::uint8_t { contact, tie, guide, still };
  struct Row {
    Kind kind = Kind::still;
    Vec3d normal = Vec3d::Zero();
    double friction = 0.0;
    Own own;
  };
  using Vector = std::vector<double>;  // as in row_matrix.h

  void set(std::size_t row, const Row& as, const Vec3d& free_m_s, const Vec3d& start_n_s);
  [[nodiscard]] static Vec3d within(const Row& row, const Vec3d& impulse_n_s);
  [[nodiscard]] static double off_m_s(const Row& row, const Vec3d& impulse_n_s, const Vec3d& velocity_m_s);
  [[nodiscard]] static Vec3d opening_m_s(const Row& row, const Vec3d& multiplier_m_s);
  void begin();
  [[nodiscard]] bool set_penalties(double holds, double slips, double opens);
  void split();
  void step();
  void look();

  Rows& w_;
  std::vector<Row> rows_;
  std::vector<double> penalties_1_kg_;  // one a row
  Vector free_m_s_;
  // The method's point is one vector, of impulses and of multipliers over penalties. Each row splits it for itself.
  Vector sums_n_s_;
  Vector impulses_n_s_, multipliers_m_s_;
  Vector best_n_s_;
  StepMix mix_;
  Vector roots_;                                   // of the penalties, by which changes are weighed
  Vector moved_, change_, next_, velocities_m_s_;  // scratch
  double off_m_s_ = 0.0;
  std::uint32_t factorisations_ = 0;
};

}  // namespace pneuma::physics
