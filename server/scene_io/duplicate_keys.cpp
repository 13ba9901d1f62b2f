#include "scene_io/duplicate_keys.h"

#include <cstddef>
#include <cstdint>
#include <limits>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <boost/json/basic_parser_impl.hpp>
#include <boost/json/error.hpp>

#include "base/limits.h"
#include "scene_io/quoted.h"

namespace pneuma::scene_io {
namespace {

namespace json = boost::json;

/// What the parser calls, part by part; the names and limits are its own.
class KeyHandler {
 public:
  static constexpr std::size_t max_object_size = std::numeric_limits<std::size_t>::max();
  static constexpr std::size_t max_array_size = std::numeric_limits<std::size_t>::max();
  static constexpr std::size_t max_key_size = std::numeric_limits<std::size_t>::max();
  static constexpr std::size_t max_string_size = std::numeric_limits<std::size_t>::max();

  [[nodiscard]] const std::string& duplicate() const { return duplicate_; }
  /// What there is more of than may be; empty where all is within its limit.
  [[nodiscard]] std::string excess() const {
    if (objects_ > base::json_objects_max) return std::to_string(base::json_objects_max) + " objects";
    if (values_ > base::json_values_max) return std::to_string(base::json_values_max) + " values";
    if (has_many_keys_) return std::to_string(base::json_keys_max) + " keys in an object";
    return {};
  }

  static bool on_document_begin(json::error_code& /*error*/) { return true; }
  static bool on_document_end(json::error_code& /*error*/) { return true; }
  bool on_object_begin(json::error_code& error) {
    ++objects_;
    return enter(false, error) && goes_on(objects_ <= base::json_objects_max, error);
  }
  bool on_object_end(std::size_t /*size*/, json::error_code& /*error*/) { return leave(); }
  bool on_array_begin(json::error_code& error) { return enter(true, error); }
  bool on_array_end(std::size_t /*size*/, json::error_code& /*error*/) { return leave(); }

  bool on_key_part(json::string_view part, std::size_t /*size*/, json::error_code& /*error*/) {
    key_.append(part);
    return true;
  }
  bool on_key(json::string_view part, std::size_t /*size*/, json::error_code& error) {
    key_.append(part);
    Level& object = levels_.back();
    object.key = std::exchange(key_, {});
    const bool is_new = object.keys.insert(object.key).second;
    if (!is_new) duplicate_ = path();
    has_many_keys_ = object.keys.size() > base::json_keys_max;
    return goes_on(is_new && !has_many_keys_, error);
  }

  static bool on_string_part(json::string_view /*part*/, std::size_t /*size*/, json::error_code& /*error*/) {
    return true;
  }
  bool on_string(json::string_view /*part*/, std::size_t /*size*/, json::error_code& error) { return item(error); }
  static bool on_number_part(json::string_view /*part*/, json::error_code& /*error*/) { return true; }
  bool on_int64(std::int64_t /*value*/, json::string_view /*part*/, json::error_code& error) { return item(error); }
  bool on_uint64(std::uint64_t /*value*/, json::string_view /*part*/, json::error_code& error) { return item(error); }
  bool on_double(double /*value*/, json::string_view /*part*/, json::error_code& error) { return item(error); }
  bool on_bool(bool /*value*/, json::error_code& error) { return item(error); }
  bool on_null(json::error_code& error) { return item(error); }
  static bool on_comment_part(json::string_view /*part*/, json::error_code& /*error*/) { return true; }
  static bool on_comment(json::string_view /*part*/, json::error_code& /*error*/) { return true; }

 private:
  struct Level {
    bool is_list = false;
    std::size_t items = 0;  // of a list, begun so far
    std::string key;        // of an object, the last one
    std::set<std::string> keys;
  };

  static bool goes_on(bool is_good, json::error_code& error) {
    if (!is_good) error = json::error::syntax;  // ends the parse
    return is_good;
  }
  bool item(json::error_code& error) {
    if (!levels_.empty()) ++levels_.back().items;
    ++values_;
    return goes_on(values_ <= base::json_values_max, error);
  }
  bool enter(bool is_list, json::error_code& error) {
    if (!item(error)) return false;
    levels_.emplace_back().is_list = is_list;
    return true;
  }
  bool leave() {
    levels_.pop_back();
    return true;
  }
  [[nodiscard]] std::string path() const {
    std::string path;
    for (const Level& level : levels_) {
      if (level.is_list) {
        path.append("[").append(std::to_string(level.items - 1)).append("]");
      } else {
        path.append(path.empty() ? "" : ".").append(escaped(level.key));
      }
    }
    return path;
  }

  std::vector<Level> levels_;
  std::string key_;  // as far as it was read
  std::string duplicate_;
  std::size_t objects_ = 0;  // begun so far
  std::size_t values_ = 0;   // likewise, objects and lists among them
  bool has_many_keys_ = false;
};

}  // namespace

base::Status check_keys(std::string_view json) {
  json::basic_parser<KeyHandler> parser{json::parse_options()};
  json::error_code error;
  parser.write_some(false, json.data(), json.size(), error);
  if (const std::string excess = parser.handler().excess(); !excess.empty()) {
    return {base::StatusCode::limit_exceeded, "holds more than " + excess};
  }
  const std::string& duplicate = parser.handler().duplicate();
  return duplicate.empty() ? base::Status() : base::invalid("is given twice", duplicate);
}

}  // namespace pneuma::scene_io
