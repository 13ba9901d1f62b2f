#include "command/terminal.h"

#include <cstdlib>

#include <sys/ioctl.h>
#include <unistd.h>

namespace pneuma::client {

bool takes_colour(int descriptor) {
  const char* refused = std::getenv("NO_COLOR");
  const char* kind = std::getenv("TERM");
  return (refused == nullptr || *refused == '\0') && ::isatty(descriptor) != 0 && kind != nullptr &&
         std::string_view(kind) != "dumb";
}

TerminalSize terminal_size(int descriptor) {
  winsize size{};
  if (::ioctl(descriptor, TIOCGWINSZ, &size) != 0 || size.ws_col == 0 || size.ws_row == 0) return {};
  return {size.ws_col, size.ws_row};
}

std::string styled(std::string_view text, Style style) {
  const char* begin = style == Style::bold ? "\033[1m" : style == Style::red ? "\033[31m" : "\033[33m";
  if (style == Style::plain) return std::string(text);
  return std::string(begin).append(text).append("\033[0m");
}

}  // namespace pneuma::client
