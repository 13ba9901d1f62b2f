#include "scene_io/quoted.h"

#include <algorithm>

#include "base/hidden_text.h"

namespace pneuma::scene_io {
namespace {

constexpr std::size_t list_bytes_max = 400;

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
    const std::size_t hidden = base::hidden_bytes(text, i);
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
