#include "scene_io/quoted.h"

namespace pneuma::scene_io {
namespace {

constexpr std::size_t list_bytes_max = 400;

// U+0080 to U+009F are controls to a terminal too; in UTF-8 they are C2 and a byte below A0.
bool is_control(std::string_view text, std::size_t i) {
  const auto byte = [&text](std::size_t at) { return static_cast<unsigned char>(text[at]); };
  return byte(i) < 0x20 || byte(i) == 0x7f || (byte(i) == 0xc2 && i + 1 < text.size() && byte(i + 1) < 0xa0);
}

}  // namespace

std::string escaped(std::string_view text, std::size_t bytes_max) {
  std::size_t end = text.size();
  if (end > bytes_max) {
    end = bytes_max;
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xc0U) == 0x80U) --end;
  }
  constexpr std::string_view digits = "0123456789abcdef";
  std::string out;
  for (std::size_t i = 0; i < end; ++i) {
    if (!is_control(text, i)) {
      out += text[i];
      continue;
    }
    if (static_cast<unsigned char>(text[i]) == 0xc2) ++i;
    const auto byte = static_cast<unsigned char>(text[i]);
    out += "\\x";
    out += digits[byte >> 4U];
    out += digits[byte & 0xfU];
  }
  if (end < text.size()) out += "...";
  return out;
}

std::string in_quotes(std::string_view text) {
  return '"' + escaped(text) + '"';
}

void append_name(std::string& list, std::string_view name) {
  if (list.ends_with(", ...")) return;
  if (!list.empty()) list += ", ";
  list += list.size() < list_bytes_max ? escaped(name) : "...";
}

}  // namespace pneuma::scene_io
