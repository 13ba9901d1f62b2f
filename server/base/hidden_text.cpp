#include "base/hidden_text.h"

namespace pneuma::base {

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

bool has_hidden(std::string_view text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (hidden_bytes(text, i) > 0) return true;
  }
  return false;
}

}  // namespace pneuma::base
