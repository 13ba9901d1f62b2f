// Standard output of the `pneuma` command: lines, tables for people, JSON for scripts.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <google/protobuf/message.h>

#include "base/status.h"

namespace pneuma::client {

/// Lines to standard output, each of them passed on at once.
class Output {
 public:
  /// Once a write has failed, every line gives that error.
  base::Status line(std::string_view text);
  /// The reader went away (`pneuma watch W | head`): a reason to end, not a failure.
  [[nodiscard]] bool is_closed() const { return closed_; }

 private:
  base::Status failure_;
  bool closed_ = false;
};

/// Columns as wide as their widest cell: text to the left, numbers to the right.
class Table {
 public:
  explicit Table(std::vector<std::string> header) : rows_{std::move(header)} {}
  /// As many cells as the header has.
  void add(std::vector<std::string> row);
  [[nodiscard]] base::Status print(Output& output) const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

/// Short, for people: six significant digits.
[[nodiscard]] std::string number_text(double value);

/// The members of a JSON object, in order.
class JsonObject {
 public:
  JsonObject& add(std::string_view key, std::string_view text);
  JsonObject& add(std::string_view key, const char* text) { return add(key, std::string_view(text)); }
  JsonObject& add(std::string_view key, bool value);
  JsonObject& add(std::string_view key, double value);
  JsonObject& add(std::string_view key, std::uint64_t value);
  JsonObject& add(std::string_view key, std::span<const double> values);
  JsonObject& add(std::string_view key, std::span<const JsonObject> values);
  [[nodiscard]] std::string text() const { return "{" + members_ + "}"; }

 private:
  JsonObject& add_raw(std::string_view key, std::string_view json);
  std::string members_;
};

/// A message in protobuf's JSON form with the field names of the .proto files: one line with every plain field shown,
/// or several lines with only those that are set.
enum class JsonForm { one_line, for_people };
[[nodiscard]] std::string json_text(const google::protobuf::Message& message, JsonForm form);

}  // namespace pneuma::client
