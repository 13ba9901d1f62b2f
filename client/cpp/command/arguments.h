// Arguments of the `pneuma` command that are more than a word or a number.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "base/status.h"
#include "pneuma/v1/scene.pb.h"

namespace pneuma::client {

/// Reads `N` finite numbers with commas between them, "-1,2,0"; nothing where the text is anything else.
template <std::size_t N>
[[nodiscard]] std::optional<std::array<double, N>> parse_numbers(std::string_view text);
extern template std::optional<std::array<double, 1>> parse_numbers<1>(std::string_view text);
extern template std::optional<std::array<double, 3>> parse_numbers<3>(std::string_view text);
extern template std::optional<std::array<double, 6>> parse_numbers<6>(std::string_view text);

[[nodiscard]] v1::Vec3 to_vec3(double x, double y, double z);

/// As errors name it: a file by its path, "-" as standard input.
[[nodiscard]] std::string shown_name(const std::string& path);

/// The text of a file, or of standard input for "-", without a byte order mark. Errors name the file; an empty one, one
/// past `bytes_max`, or one that is not UTF-8 is refused.
[[nodiscard]] base::Result<std::string> read_text(const std::string& path, std::size_t bytes_max);

/// The first line of `file` without its end.
[[nodiscard]] base::Result<std::string> read_token(const std::string& file);

}  // namespace pneuma::client
