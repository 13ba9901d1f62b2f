#include "command/output.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>

#include <google/protobuf/util/json_util.h>

namespace pneuma::client {

namespace {

bool is_number(const std::string& cell) {
  double value = 0.0;
  const auto parsed = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  return parsed.ec == std::errc() && parsed.ptr == cell.data() + cell.size();
}

/// The shortest text that reads back as the same double; null where JSON has no number for it.
std::string json_number(double value) {
  if (!std::isfinite(value)) return "null";
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

std::string json_string(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      quoted += '\\';
      quoted += c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      std::array<char, 8> escape{};
      std::snprintf(escape.data(), escape.size(), "\\u%04x", static_cast<unsigned>(c));
      quoted += escape.data();
    } else {
      quoted += c;
    }
  }
  return quoted + '"';
}

}  // namespace

base::Status Output::line(std::string_view text) {
  if (!failure_.ok()) return failure_;
  const std::string bytes = std::string(text) + '\n';
  if (std::fwrite(bytes.data(), 1, bytes.size(), stdout) != bytes.size() || std::fflush(stdout) != 0) {
    closed_ = errno == EPIPE;
    failure_ = {base::StatusCode::unavailable, std::strerror(errno), "standard output"};
  }
  return failure_;
}

void Table::add(std::vector<std::string> row) {
  assert(row.size() == rows_.front().size());
  rows_.push_back(std::move(row));
}

base::Status Table::print(Output& output) const {
  const std::size_t columns = rows_.front().size();
  std::vector<std::size_t> widths(columns, 0);
  std::vector<bool> numeric(columns, true);
  for (const auto& row : rows_) {
    for (std::size_t i = 0; i < columns; ++i) {
      widths[i] = std::max(widths[i], row[i].size());
      if (&row != &rows_.front() && !is_number(row[i])) numeric[i] = false;
    }
  }
  for (const auto& row : rows_) {
    std::string text;
    for (std::size_t i = 0; i < columns; ++i) {
      const std::string space(widths[i] - row[i].size(), ' ');
      if (i > 0) text += "  ";
      text += numeric[i] ? space + row[i] : row[i] + space;
    }
    text.erase(text.find_last_not_of(' ') + 1);
    const base::Status written = output.line(text);
    if (!written.ok()) return written;
  }
  return {};
}

std::string number_text(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.6g", value);
  return text.data();
}

JsonObject& JsonObject::add_raw(std::string_view key, std::string_view json) {
  if (!members_.empty()) members_ += ',';
  members_ += json_string(key) + ':';
  members_ += json;
  return *this;
}

JsonObject& JsonObject::add(std::string_view key, std::string_view text) {
  return add_raw(key, json_string(text));
}
JsonObject& JsonObject::add(std::string_view key, bool value) {
  return add_raw(key, value ? "true" : "false");
}
JsonObject& JsonObject::add(std::string_view key, double value) {
  return add_raw(key, json_number(value));
}
JsonObject& JsonObject::add(std::string_view key, std::uint64_t value) {
  return add_raw(key, std::to_string(value));
}

JsonObject& JsonObject::add(std::string_view key, std::span<const double> values) {
  std::string json;
  for (const double value : values) {
    if (!json.empty()) json += ',';
    json += json_number(value);
  }
  return add_raw(key, "[" + json + "]");
}

JsonObject& JsonObject::add(std::string_view key, std::span<const JsonObject> values) {
  std::string json;
  for (const JsonObject& value : values) {
    if (!json.empty()) json += ',';
    json += value.text();
  }
  return add_raw(key, "[" + json + "]");
}

std::string json_text(const google::protobuf::Message& message, JsonForm form) {
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  options.add_whitespace = form == JsonForm::for_people;
  options.always_print_primitive_fields = form == JsonForm::one_line;
  std::string text;
  [[maybe_unused]] const auto done = google::protobuf::util::MessageToJsonString(message, &text, options);
  assert(done.ok());
  while (text.ends_with('\n')) text.pop_back();
  return text;
}

}  // namespace pneuma::client
