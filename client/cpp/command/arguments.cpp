#include "command/arguments.h"

#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>

namespace pneuma::client {

template <std::size_t N>
std::optional<std::array<double, N>> parse_numbers(std::string_view text) {
  std::array<double, N> numbers{};
  const char* next = text.data();
  const char* const end = text.data() + text.size();
  for (std::size_t i = 0; i < N; ++i) {
    if (i > 0 && (next == end || *next++ != ',')) return std::nullopt;
    const auto parsed = std::from_chars(next, end, numbers[i]);
    if (parsed.ec != std::errc() || !std::isfinite(numbers[i])) return std::nullopt;
    next = parsed.ptr;
  }
  if (next != end) return std::nullopt;
  return numbers;
}

template std::optional<std::array<double, 1>> parse_numbers<1>(std::string_view text);
template std::optional<std::array<double, 3>> parse_numbers<3>(std::string_view text);
template std::optional<std::array<double, 6>> parse_numbers<6>(std::string_view text);

v1::Vec3 to_vec3(double x, double y, double z) {
  v1::Vec3 vector;
  vector.set_x(x);
  vector.set_y(y);
  vector.set_z(z);
  return vector;
}

base::Result<std::string> read_text(const std::string& path, std::size_t bytes_max) {
  struct Close {
    void operator()(std::FILE* file) const {
      if (file != stdin) std::fclose(file);
    }
  };
  const std::unique_ptr<std::FILE, Close> file(path == "-" ? stdin : std::fopen(path.c_str(), "rb"));
  if (!file) return base::not_found(std::strerror(errno), path);
  std::string text;
  std::array<char, 65536> buffer{};
  std::size_t count = 0;
  while ((count = std::fread(buffer.data(), 1, buffer.size(), file.get())) > 0) {
    text.append(buffer.data(), count);
    if (text.size() > bytes_max) {
      return base::Status(base::StatusCode::limit_exceeded,
                          "more than the " + std::to_string(bytes_max) + " bytes that the server takes", path);
    }
  }
  if (std::ferror(file.get()) != 0) {
    return base::Status(base::StatusCode::unavailable, std::strerror(errno), path);
  }
  return text;
}

}  // namespace pneuma::client
