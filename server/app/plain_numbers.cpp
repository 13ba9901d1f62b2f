#include "app/plain_numbers.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <numbers>

namespace pneuma::app {

namespace {

static_assert(std::endian::native == std::endian::little);

template <class Number>
void append(std::span<const double> numbers, std::string& out) {
  const std::size_t begin = out.size();
  out.resize(begin + numbers.size() * sizeof(Number));
  char* to = out.data() + begin;
  for (const double number : numbers) {
    const auto told = static_cast<Number>(number);
    std::memcpy(to, &told, sizeof told);
    to += sizeof told;
  }
}

template <class Number>
std::vector<double> read(const std::string& bytes) {
  std::vector<double> numbers(bytes.size() / sizeof(Number));
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    Number number{};
    std::memcpy(&number, bytes.data() + i * sizeof number, sizeof number);
    numbers[i] = static_cast<double>(number);
  }
  return numbers;
}

constexpr double int16_max = 32'767.0;

// A number is off by half a step at most, a vector by sqrt(3) of that. A little less, for what rounding takes.
double step_of(double max_error) {
  return (1.0 - 1e-9) * 2.0 * max_error / std::numbers::sqrt3;
}

}  // namespace

void append_numbers(std::span<const double> numbers, bool double_precision, std::string& out) {
  double_precision ? append<double>(numbers, out) : append<float>(numbers, out);
}

base::Result<std::vector<double>> read_numbers(const std::string& bytes, bool double_precision,
                                               const std::string& field) {
  const std::size_t each = double_precision ? sizeof(double) : sizeof(float);
  if (bytes.size() % each != 0) {
    return base::invalid("has " + std::to_string(bytes.size()) + " bytes, which are no whole numbers of " +
                             std::to_string(each) + " bytes each",
                         field);
  }
  return double_precision ? read<double>(bytes) : read<float>(bytes);
}

std::optional<v1::Int16Grid> int16_grid(std::span<const double> positions_m, double max_error_m) {
  if (!(max_error_m > 0.0) || positions_m.empty()) return std::nullopt;
  std::array<double, 3> low{positions_m[0], positions_m[1], positions_m[2]};
  std::array<double, 3> high = low;
  for (std::size_t i = 0; i < positions_m.size(); ++i) {
    low[i % 3] = std::min(low[i % 3], positions_m[i]);
    high[i % 3] = std::max(high[i % 3], positions_m[i]);
  }
  v1::Int16Grid grid;
  grid.set_step_m(step_of(max_error_m));
  grid.mutable_origin()->set_x(0.5 * (low[0] + high[0]));
  grid.mutable_origin()->set_y(0.5 * (low[1] + high[1]));
  grid.mutable_origin()->set_z(0.5 * (low[2] + high[2]));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (0.5 * (high[axis] - low[axis]) > (int16_max - 1.0) * grid.step_m()) return std::nullopt;
  }
  return grid;
}

double int16_velocity_step_m_s(std::span<const double> velocities_m_s, double max_error_m_s) {
  const double step_m_s = step_of(max_error_m_s);
  const auto fits = [&](double number) { return std::abs(number) <= (int16_max - 1.0) * step_m_s; };
  return std::ranges::all_of(velocities_m_s, fits) ? step_m_s : 0.0;
}

void append_int16(std::span<const double> numbers, const v1::Vec3& origin, double step, std::string& out) {
  const std::array<double, 3> from{origin.x(), origin.y(), origin.z()};
  const std::size_t begin = out.size();
  out.resize(begin + numbers.size() * sizeof(std::int16_t));
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const auto counted = static_cast<std::int16_t>(std::lround((numbers[i] - from[i % 3]) / step));
    std::memcpy(out.data() + begin + i * sizeof counted, &counted, sizeof counted);
  }
}

void PlainFrame::take_positions(std::span<const double> positions_m, double max_error_m) {
  positions_.clear();
  velocities_.clear();
  int16_ = int16_grid(positions_m, max_error_m);
  if (int16_) {
    append_int16(positions_m, int16_->origin(), int16_->step_m(), positions_);
  } else {
    append_numbers(positions_m, false, positions_);
  }
}

void PlainFrame::take_velocities(std::span<const double> velocities_m_s, double max_error_m_s) {
  const double step_m_s = int16_ ? int16_velocity_step_m_s(velocities_m_s, max_error_m_s) : 0.0;
  if (step_m_s > 0.0) {
    int16_->set_velocity_step_m_s(step_m_s);
    append_int16(velocities_m_s, v1::Vec3(), step_m_s, velocities_);
  } else {
    append_numbers(velocities_m_s, false, velocities_);
  }
}

void PlainFrame::write(v1::Frame& frame) const {
  frame.set_payload(positions_);
  frame.set_velocities(velocities_);
  if (int16_) *frame.mutable_int16() = *int16_;
}

}  // namespace pneuma::app
