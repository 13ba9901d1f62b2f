#include "command/arguments.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>

#include <utf8.h>

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

std::string shown_name(const std::string& path) {
  return path == "-" ? "standard input" : path;
}

base::Result<std::string> read_text(const std::string& path, std::size_t bytes_max) {
  struct Close {
    void operator()(std::FILE* file) const {
      if (file != stdin) std::fclose(file);
    }
  };
  const bool is_standard_input = path == "-";
  const std::string name = shown_name(path);
  const std::unique_ptr<std::FILE, Close> file(is_standard_input ? stdin : std::fopen(path.c_str(), "rb"));
  if (!file) return base::not_found(std::strerror(errno), name);
  std::string text;
  std::array<char, 65536> buffer{};
  std::size_t count = 0;
  while ((count = std::fread(buffer.data(), 1, buffer.size(), file.get())) > 0) {
    text.append(buffer.data(), count);
    if (text.size() > bytes_max) {
      return base::Status(base::StatusCode::limit_exceeded,
                          "more than the " + std::to_string(bytes_max) + " bytes that are taken", name);
    }
  }
  if (std::ferror(file.get()) != 0) {
    return base::Status(base::StatusCode::unavailable, std::strerror(errno), name);
  }
  constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";
  if (text.starts_with(byte_order_mark)) text.erase(0, byte_order_mark.size());
  if (text.empty()) return base::invalid("is empty", name);
  const auto wrong = utf8::find_invalid(text.begin(), text.end());
  if (wrong == text.end()) return text;
  const auto line = 1 + std::count(text.begin(), wrong, '\n');
  const std::string_view before(text.begin(), wrong);
  const std::size_t column = before.size() - (before.rfind('\n') + 1) + 1;  // npos + 1 is 0: the first line
  return base::invalid("is not UTF-8", name + ":" + std::to_string(line) + ":" + std::to_string(column));
}

base::Result<std::string> read_token(const std::string& file) {
  constexpr std::size_t bytes_max = 4096;  // as much as a hello may hold
  auto text = read_text(file, bytes_max);
  if (!text.ok()) return text.status();
  std::string token = text->substr(0, text->find('\n'));
  if (token.ends_with('\r')) token.pop_back();
  if (token.empty()) return base::invalid("its first line holds no token", file);
  return token;
}

}  // namespace pneuma::client
