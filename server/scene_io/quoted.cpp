#include "scene_io/quoted.h"

#include <algorithm>

namespace pneuma::scene_io {
namespace {

constexpr std::size_t list_bytes_max = 400;

/// How many bytes, from here on, are of a character that does not show as itself: a control, or one that is not seen or
/// turns the text around it. 0: it shows.
std::size_t hidden_bytes(std::string_view text, std::size_t i) {
  const auto byte = [&](std::size_t at) -> unsigned {
    return i + at < text.size() ? static_cast<unsigned char>(text[i + at]) : 0U;
  };
  const auto between = [](unsigned value, unsigned first, unsigned last) { return value >= first && value <= last; };
  if (byte(0) < 0x20 || byte(0) == 0x7f) return 1;
  // U+0080 to U+009F are controls to a terminal too. U+061C is an Arabic letter mark.
  if (byte(0) == 0xc2 && between(byte(1), 0x80, 0x9f)) return 2;
  if (byte(0) == 0xd8 && byte(1) == 0x9c) return 2;
  // U+200B to U+200F, U+2028 to U+202E, U+2060 to U+206F: spaces of no width, line ends, and what turns text.
  if (byte(0) == 0xe2 && byte(1) == 0x80 && (between(byte(2), 0x8b, 0x8f) || between(byte(2), 0xa8, 0xae))) return 3;
  if (byte(0) == 0xe2 && byte(1) == 0x81 && between(byte(2), 0xa0, 0xaf)) return 3;
  // U+FEFF, a byte order mark; U+FFF9 to U+FFFB, annotations.
  if (byte(0) == 0xef && byte(1) == 0xbb && byte(2) == 0xbf) return 3;
  if (byte(0) == 0xef && byte(1) == 0xbf && between(byte(2), 0xb9, 0xbb)) return 3;
  // U+E0000 to U+E0FFF: tags and variations.
  return byte(0) == 0xf3 && byte(1) == 0xa0 ? 4 : 0;
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
  for (std::size_t i = 0; i < end;) {
    const std::size_t hidden = hidden_bytes(text, i);
    if (hidden == 0) out += text[i++];
    for (const std::size_t after = std::min(i + hidden, end); i < after; ++i) {
      const auto byte = static_cast<unsigned char>(text[i]);
      out += "\\x";
      out += digits[byte >> 4U];
      out += digits[byte & 0xfU];
    }
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
