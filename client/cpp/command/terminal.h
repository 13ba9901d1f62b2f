// What the terminal takes: its size, and colour.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace pneuma::client {

/// A terminal that shows colour, whose user has not set NO_COLOR (https://no-color.org).
[[nodiscard]] bool takes_colour(int descriptor);

struct TerminalSize {
  std::size_t columns = 80;
  std::size_t rows = 24;
};
/// What most terminals have had since 1978 where nobody knows.
[[nodiscard]] TerminalSize terminal_size(int descriptor);

enum class Style { plain, bold, red, yellow };
[[nodiscard]] std::string styled(std::string_view text, Style style);

}  // namespace pneuma::client
