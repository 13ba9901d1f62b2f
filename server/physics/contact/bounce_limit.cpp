#include "physics/contact/bounce_limit.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace pneuma::physics {
namespace {

// Of the energy that passes through the rows: a gain this small is rounding.
constexpr double gain_share_max = 1e-9;
// The largest blend leaves a squeezed body all the energy that it came with, each pass anew.
constexpr double parting_share = 0.5;

Vec3d change_at(const ContactRow& row, std::span<const Response> responses) {
  return change_m_s(responses[row.first.body], row.first) - change_m_s(responses[row.second.body], row.second);
}

// By impulses that change the rows' velocities so.
double work_j(const ContactRow& row, const Vec3d& impulse_n_s, const Vec3d& change_m_s) {
  return impulse_n_s.dot(row.free_m_s + 0.5 * change_m_s);
}

struct Answer {
  Vec3d impulse_n_s;
  Vec3d change_m_s;
};

}  // namespace

double gained_j(std::span<const ContactRow> rows, std::span<const Response> responses) {
  double sum_j = 0.0;
  for (const ContactRow& row : rows) sum_j += work_j(row, row.impulse_n_s, change_at(row, responses));
  return sum_j;
}

bool limit_bounce(std::span<ContactRow> rows, std::span<Response> responses, std::span<const double> still_m_s,
                  const GainLimit& gain, const SolveLimits& limits) {
  const double bounced_j = gained_j(rows, responses) - gain.allowed_j;
  double passed_j = 0.0;
  for (const ContactRow& row : rows) passed_j += std::abs(row.impulse_n_s.dot(row.free_m_s));
  if (bounced_j <= gain_share_max * passed_j) return true;

  std::vector<Answer> bounced;
  for (const ContactRow& row : rows) bounced.push_back({row.impulse_n_s, change_at(row, responses)});
  for (std::size_t i = 0; i < rows.size(); ++i) {
    push_both(responses, rows[i], -rows[i].impulse_n_s);
    rows[i].impulse_n_s.setZero();
    rows[i].is_given = false;  // a joint that took more than it can may take less now
    rows[i].least_m_s = still_m_s[i];
  }
  const bool converged = solve_rows(rows, responses, limits).converged;

  // The energy of a blend is a parabola in its share, open upwards.
  const double still_j = gained_j(rows, responses) - gain.allowed_j;
  double halfway_j = -gain.allowed_j;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    halfway_j += work_j(rows[i], 0.5 * (rows[i].impulse_n_s + bounced[i].impulse_n_s),
                        0.5 * (change_at(rows[i], responses) + bounced[i].change_m_s));
  }
  if (still_j >= 0.0) return converged;
  const double square = 2.0 * (still_j + bounced_j - 2.0 * halfway_j);
  const double slope = bounced_j - still_j - square;
  const double share = gain.share * -2.0 * still_j / (slope + std::sqrt(slope * slope - 4.0 * square * still_j));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Vec3d change_n_s = share * (bounced[i].impulse_n_s - rows[i].impulse_n_s);
    rows[i].impulse_n_s += change_n_s;
    push_both(responses, rows[i], change_n_s);
  }
  return converged;
}

bool limit_parting(std::span<ContactRow> rows, std::span<Response> responses, const SolveLimits& limits) {
  const auto parts = [](const ContactRow& row) { return row.least_m_s > 0.0; };
  if (std::ranges::none_of(rows, parts) || gained_j(rows, responses) <= 0.0) return true;
  std::vector<double> still_m_s;
  double allowed_j = 0.0;
  for (const ContactRow& row : rows) {
    still_m_s.push_back(std::min(0.0, row.least_m_s));
    if (!parts(row)) continue;
    const double along_1_kg = row.normal.dot(coupling_1_kg(responses, row, row) * row.normal);
    if (along_1_kg > 0.0) allowed_j += 0.5 * row.least_m_s * row.least_m_s / along_1_kg;
  }
  return limit_bounce(rows, responses, still_m_s, {allowed_j, parting_share}, limits);
}

}  // namespace pneuma::physics
