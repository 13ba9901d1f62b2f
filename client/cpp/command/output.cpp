#include "command/output.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <cstring>

#include <unistd.h>

#include "base/hidden_text.h"

namespace pneuma::client {

namespace {

bool is_number(const std::string& cell) {
  double value = 0.0;
  const auto parsed = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  return parsed.ec == std::errc() && parsed.ptr == cell.data() + cell.size();
}

/// Of one character in UTF-8.
std::uint32_t code_point(std::string_view bytes) {
  const auto first = static_cast<unsigned char>(bytes.front());
  std::uint32_t code = bytes.size() == 1 ? first : first & (0x7fU >> bytes.size());
  for (const char next : bytes.substr(1)) code = code << 6U | (static_cast<unsigned char>(next) & 0x3fU);
  return code;
}

void append_escape(std::string& out, std::uint32_t code) {
  const auto append = [&out](std::uint32_t unit) {
    std::array<char, 16> text{};
    std::snprintf(text.data(), text.size(), "\\u%04x", static_cast<unsigned>(unit));
    out += text.data();
  };
  if (code < 0x10000U) return append(code);
  append(0xd800U + ((code - 0x10000U) >> 10U));
  append(0xdc00U + ((code - 0x10000U) & 0x3ffU));
}

}  // namespace

std::string shown(std::string_view text, LineEnds ends) {
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    const bool is_kept = ends == LineEnds::kept && (text[i] == '\n' || text[i] == '\t');
    const std::size_t bytes = is_kept ? 0 : base::hidden_bytes(text, i);
    if (bytes == 0) {
      out += text[i++];
      continue;
    }
    append_escape(out, code_point(text.substr(i, bytes)));
    i += bytes;
  }
  return out;
}

base::Status Output::line(std::string_view text, LineEnds ends) {
  return drawn(shown(text, ends));
}

base::Status Output::drawn(std::string_view text) {
  if (!failure_.ok()) return failure_;
  const std::string bytes = std::string(text) + '\n';
  if (std::fwrite(bytes.data(), 1, bytes.size(), stdout) != bytes.size() || std::fflush(stdout) != 0) {
    closed_ = errno == EPIPE;
    failure_ = {base::StatusCode::unavailable, std::strerror(errno), "standard output"};
  }
  return failure_;
}

void Table::add(std::vector<std::string> row, Style style) {
  assert(row.size() == rows_.front().size());
  for (std::string& cell : row) cell = shown(cell);
  rows_.push_back(std::move(row));
  styles_.push_back(style);
}

std::vector<std::string> Table::lines(bool with_colour, std::size_t columns_max) const {
  const std::size_t columns = rows_.front().size();
  std::vector<std::size_t> widths(columns, 0);
  std::vector<bool> numeric(columns, true);
  for (const auto& row : rows_) {
    for (std::size_t i = 0; i < columns; ++i) {
      widths[i] = std::max(widths[i], row[i].size());
      if (&row != &rows_.front() && !is_number(row[i])) numeric[i] = false;
    }
  }
  std::vector<std::string> lines;
  for (const auto& row : rows_) {
    std::string text;
    for (std::size_t i = 0; i < columns; ++i) {
      const std::string space(widths[i] - row[i].size(), ' ');
      if (i > 0) text += "  ";
      text += numeric[i] ? space + row[i] : row[i] + space;
    }
    text.erase(text.find_last_not_of(' ') + 1);
    if (columns_max > 0 && text.size() > columns_max) text.resize(columns_max);
    lines.push_back(with_colour ? styled(text, styles_[lines.size()]) : text);
  }
  return lines;
}

base::Status Table::print(Output& output) const {
  for (const std::string& line : lines(takes_colour(STDOUT_FILENO))) {
    const base::Status written = output.drawn(line);
    if (!written.ok()) return written;
  }
  return {};
}

std::string number_text(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.6g", value);
  return text.data();
}

}  // namespace pneuma::client
