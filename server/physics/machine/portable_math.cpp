#include "physics/machine/portable_math.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>

namespace pneuma::physics {

namespace {

// ln 2 and pi / 2 in two parts each: products of the first with integers of up to 20 bits are exact.
constexpr double ln2_high = 0x1.62e42fefp-1;
constexpr double ln2_low = 0x1.473de6af278edp-34;
constexpr double half_pi_high = 0x1.921fb544p0;
constexpr double half_pi_low = 0x1.0b4611a626331p-34;

double nearest_integer(double x) {
  return std::floor(x + 0.5);
}

double polynomial(std::span<const double> coefficients, double x) {
  double sum = 0.0;
  for (std::size_t i = coefficients.size(); i > 0; --i) sum = sum * x + coefficients[i - 1];
  return sum;
}

// 1, sign/3, 1/5, sign/7...
template <std::size_t Count>
constexpr std::array<double, Count> odd_reciprocals(double sign) {
  std::array<double, Count> result{};
  double factor = 1.0;
  for (std::size_t i = 0; i < Count; ++i, factor *= sign) result[i] = factor / static_cast<double>(2 * i + 1);
  return result;
}

// 1/first!, sign/(first + step)!, 1/(first + 2 step)!...
template <std::size_t Count>
constexpr std::array<double, Count> reciprocal_factorials(std::size_t first, std::size_t step, double sign) {
  std::array<double, Count> result{};
  double factor = 1.0;
  double factorial = 1.0;
  std::size_t n = 0;
  for (std::size_t i = 0; i < Count; ++i, factor *= sign) {
    while (n < first + i * step) factorial *= static_cast<double>(++n);
    result[i] = factor / factorial;
  }
  return result;
}

// The mantissa within sqrt(1/2) and sqrt(2), so that 2 atanh((m - 1) / (m + 1)) takes few terms.
double natural_logarithm(double x) {
  constexpr auto series = odd_reciprocals<12>(1.0);
  int exponent = 0;
  double mantissa = std::frexp(x, &exponent);
  if (mantissa < std::numbers::sqrt2 / 2.0) {
    mantissa *= 2.0;
    --exponent;
  }
  const double f = (mantissa - 1.0) / (mantissa + 1.0);
  return exponent * ln2_high + (2.0 * f * polynomial(series, f * f) + exponent * ln2_low);
}

double exponential(double x) {
  constexpr auto series = reciprocal_factorials<15>(0, 1, 1.0);
  constexpr double past_any_double = 800.0;
  if (!(std::abs(x) < past_any_double)) return x > 0.0 ? HUGE_VAL : x < 0.0 ? 0.0 : x;
  const double twos = nearest_integer(x / std::numbers::ln2);
  const double rest = (x - twos * ln2_high) - twos * ln2_low;
  return std::ldexp(polynomial(series, rest), static_cast<int>(twos));
}

// atan t = 2 atan(t / (1 + sqrt(1 + t^2))), twice, for t from 0 to 1.
double arctangent(double t) {
  constexpr auto series = odd_reciprocals<12>(-1.0);
  for (int halved = 0; halved < 2; ++halved) t = t / (1.0 + std::sqrt(1.0 + t * t));
  return 4.0 * t * polynomial(series, t * t);
}

}  // namespace

double portable_pow(double base, double exponent) {
  return exponential(exponent * natural_logarithm(base));
}

double portable_atan2(double y, double x) {
  const double across = std::abs(y);
  const double along = std::abs(x);
  if (across == 0.0 && along == 0.0) return 0.0;
  double angle_rad = across <= along ? arctangent(across / along) : std::numbers::pi / 2.0 - arctangent(along / across);
  if (x < 0.0) angle_rad = std::numbers::pi - angle_rad;
  return std::copysign(angle_rad, y);
}

SineCosine portable_sincos(double angle_rad) {
  constexpr auto sine_series = reciprocal_factorials<9>(1, 2, -1.0);
  constexpr auto cosine_series = reciprocal_factorials<9>(0, 2, -1.0);
  const double quarters = nearest_integer(angle_rad / (std::numbers::pi / 2.0));
  const double rest = (angle_rad - quarters * half_pi_high) - quarters * half_pi_low;
  const double sine = rest * polynomial(sine_series, rest * rest);
  const double cosine = polynomial(cosine_series, rest * rest);
  const double quarter = quarters - 4.0 * std::floor(quarters / 4.0);
  if (quarter == 0.0) return {sine, cosine};
  if (quarter == 1.0) return {cosine, -sine};
  if (quarter == 2.0) return {-sine, -cosine};
  return {-cosine, sine};
}

}  // namespace pneuma::physics
