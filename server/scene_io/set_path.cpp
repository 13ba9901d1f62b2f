#include "scene_io/set_path.h"

#include <algorithm>
#include <charconv>
#include <string_view>

#include <google/protobuf/descriptor.h>

#include "scene_io/duplicate_keys.h"
#include "scene_io/message_reader.h"
#include "scene_io/quoted.h"

namespace pneuma::scene_io {
namespace {

using base::Result;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

/// The path's next word, up to a dot or bracket.
std::string_view take_name(std::string_view& path) {
  const std::size_t end = std::min(path.find_first_of(".["), path.size());
  const std::string_view word = path.substr(0, end);
  path.remove_prefix(end);
  return word;
}

/// "[3]" or ".name" at the path's front, as an index into the list. Errors say what; set_field knows where.
Result<int> take_index(std::string_view& path, const Message& message, const FieldDescriptor& list) {
  const auto& reflection = *message.GetReflection();
  const int count = reflection.FieldSize(message, &list);
  if (path.starts_with("[")) {
    int index = -1;
    const auto read = std::from_chars(path.data() + 1, path.data() + path.size(), index);
    if (read.ec != std::errc() || read.ptr == path.data() + path.size() || *read.ptr != ']') {
      return base::invalid("an index in brackets is wanted");
    }
    if (index < 0 || index >= count) {
      return base::not_found("there is no item " + std::to_string(index) + "; the list has " + std::to_string(count));
    }
    path.remove_prefix(static_cast<std::size_t>(read.ptr + 1 - path.data()));
    return index;
  }
  path.remove_prefix(1);
  const FieldDescriptor* name_field = list.message_type()->FindFieldByName("name");
  const std::string_view name = take_name(path);
  std::string names;
  for (int i = 0; name_field != nullptr && i < count; ++i) {
    const Message& item = reflection.GetRepeatedMessage(message, &list, i);
    const std::string its_name = item.GetReflection()->GetString(item, name_field);
    if (its_name == name) return i;
    append_name(names, its_name);
  }
  return base::not_found("nothing is named " + in_quotes(name) + (names.empty() ? "" : "; there are: " + names));
}

/// `where` is as much of the path as was read, and what the value has wrong in it.
base::Status set_field(Message& root, const std::string_view whole_path, const boost::json::value& value) {
  Message* message = &root;
  std::string_view path = whole_path;
  const auto here = [&](const base::Status& status) {
    const std::string_view read = whole_path.substr(0, whole_path.size() - path.size());
    return base::Status(status.code(), status.what(), escaped(read, shown_path_bytes_max));
  };
  while (true) {
    const auto found = find_field(*message->GetDescriptor(), take_name(path));
    if (!found.ok()) return here(found.status());
    const FieldDescriptor& field = **found;
    if (path.empty()) {
      base::Status status = read_field(value, *message, field);
      return status.ok() ? status : status.inside(escaped(whole_path, shown_path_bytes_max));
    }
    if (field.cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) {
      return here(base::invalid(field.is_repeated() ? "can only be set as a whole list" : "has no fields in it"));
    }
    const auto* reflection = message->GetReflection();
    if (field.is_repeated()) {
      const auto index = take_index(path, *message, field);
      if (!index.ok()) return here(index.status());
      message = reflection->MutableRepeatedMessage(message, &field, *index);
    } else {
      message = reflection->MutableMessage(message, &field);
    }
    if (!path.starts_with(".")) return here(base::invalid("a dot and a field's name are missing"));
    path.remove_prefix(1);
  }
}

}  // namespace

base::Status set_path(v1::Scene& scene, const std::string& assignment) {
  const std::size_t equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0) return base::invalid("PATH=VALUE is wanted", escaped(assignment));
  const std::string path = assignment.substr(0, equals);
  const std::string text = assignment.substr(equals + 1);
  const auto parsed = parse_json(text);
  if (auto status = parsed.ok() ? check_keys(text) : base::Status(); !status.ok()) {
    return status.inside(escaped(path, shown_path_bytes_max));
  }
  v1::Scene changed = scene;
  base::Status status = set_field(changed, path, parsed.ok() ? *parsed : boost::json::value(text));
  if (!status.ok()) return status;
  scene = std::move(changed);
  return {};
}

}  // namespace pneuma::scene_io
