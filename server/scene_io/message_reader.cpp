#include "scene_io/message_reader.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <boost/json/serialize.hpp>
#include <boost/json/stream_parser.hpp>
#include <google/protobuf/descriptor.h>

#include "base/nearest_word.h"
#include "scene_io/quoted.h"

namespace pneuma::scene_io {
namespace {

namespace json = boost::json;
using base::Result;
using base::Status;
using google::protobuf::Descriptor;
using google::protobuf::EnumDescriptor;
using google::protobuf::EnumValueDescriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

std::vector<std::string> names_of_fields(const Descriptor& descriptor) {
  std::vector<std::string> names;
  for (int i = 0; i < descriptor.field_count(); ++i) names.push_back(descriptor.field(i)->name());
  return names;
}

std::string kind_name(const json::value& value) {
  switch (value.kind()) {
    case json::kind::null:
      return "null";
    case json::kind::bool_:
      return "a truth value";
    case json::kind::string:
      return "the string " + in_quotes(std::string_view(value.get_string()));
    case json::kind::array:
      return "a list";
    case json::kind::object:
      return "an object";
    default:
      return "a number";
  }
}

Status wrong_type(const json::value& value, const std::string& wanted) {
  return base::invalid("is " + kind_name(value) + "; " + wanted + " is wanted");
}

/// The mapping lets a number stand in quotes.
Result<double> read_number(const json::value& value) {
  double number = 0.0;
  if (value.is_string()) {
    const json::string& text = value.get_string();
    const char* end = text.data() + text.size();
    const auto read = std::from_chars(text.data(), end, number);
    // "Infinity" reads as far as "inf"; either way it is a name for what is refused below.
    if (text == "NaN" || text == "Infinity" || text == "-Infinity") return base::invalid("is not finite");
    if (read.ec != std::errc() || read.ptr != end) return wrong_type(value, "a number");
  } else if (value.is_number()) {
    number = value.to_number<double>();
  } else {
    return wrong_type(value, "a number");
  }
  if (!std::isfinite(number)) return base::invalid("is not finite");
  return number;
}

Result<std::uint32_t> read_whole_number(const json::value& value) {
  const auto number = read_number(value);
  if (!number.ok()) return number.status();
  constexpr double max = std::numeric_limits<std::uint32_t>::max();
  if (*number < 0.0 || *number > max || *number != std::floor(*number)) {
    return base::invalid("is " + escaped(json::serialize(value)) + "; a whole number from 0 to 4294967295 is wanted");
  }
  return static_cast<std::uint32_t>(*number);
}

Result<const EnumValueDescriptor*> read_enum(const json::value& value, const EnumDescriptor& type) {
  const EnumValueDescriptor* known = nullptr;
  if (value.is_string()) {
    known = type.FindValueByName(std::string(value.get_string()));
  } else if (const auto number = read_whole_number(value); number.ok() && *number <= 1'000) {
    known = type.FindValueByNumber(static_cast<int>(*number));
  }
  if (known != nullptr) return known;
  std::string names;
  for (int i = 1; i < type.value_count(); ++i) names += (i == 1 ? "" : ", ") + type.value(i)->name();
  return base::invalid("is " + kind_name(value) + "; one of " + names + " is wanted");
}

/// One value: set where the field is single, added where it is a list.
Status read_value(const json::value& value, Message& message, const FieldDescriptor& field) {
  const Reflection& reflection = *message.GetReflection();
  const auto store = [&](const auto& read, auto set, auto add) {
    if (!read.ok()) return read.status();
    (reflection.*(field.is_repeated() ? add : set))(&message, &field, *read);
    return Status();
  };
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_MESSAGE:
      return read_message(value, field.is_repeated() ? *reflection.AddMessage(&message, &field)
                                                     : *reflection.MutableMessage(&message, &field));
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return store(read_number(value), &Reflection::SetDouble, &Reflection::AddDouble);
    case FieldDescriptor::CPPTYPE_UINT32:
      return store(read_whole_number(value), &Reflection::SetUInt32, &Reflection::AddUInt32);
    case FieldDescriptor::CPPTYPE_ENUM:
      return store(read_enum(value, *field.enum_type()), &Reflection::SetEnum, &Reflection::AddEnum);
    case FieldDescriptor::CPPTYPE_BOOL:
      if (!value.is_bool()) return wrong_type(value, "true or false");
      return store(Result<bool>(value.get_bool()), &Reflection::SetBool, &Reflection::AddBool);
    case FieldDescriptor::CPPTYPE_STRING:
      if (!value.is_string()) return wrong_type(value, "a string");
      return store(Result<std::string>(std::string(value.get_string())), &Reflection::SetString,
                   &Reflection::AddString);
    default:
      return {base::StatusCode::internal, "is of a type that no scene uses"};
  }
}

Status read_list(const json::value& value, Message& message, const FieldDescriptor& field) {
  if (!value.is_array()) return wrong_type(value, "a list");
  const json::array& items = value.get_array();
  for (std::size_t i = 0; i < items.size(); ++i) {
    const Status status = read_value(items[i], message, field);
    if (status.ok()) continue;
    std::string path("[");  // not "[" + ...: GCC 12 warns of an overflow that is not there (PR105329)
    return status.inside(path.append(std::to_string(i)).append("]"));
  }
  return {};
}

std::string position_text(std::string_view text, std::size_t offset) {
  const std::string_view before = text.substr(0, offset);
  const auto line = 1 + std::count(before.begin(), before.end(), '\n');
  const std::size_t column = offset - (before.rfind('\n') + 1) + 1;  // npos + 1 is 0: the first line
  return "line " + std::to_string(line) + ", column " + std::to_string(column);
}

}  // namespace

Result<json::value> parse_json(std::string_view text) {
  json::stream_parser parser;
  json::error_code error;
  const std::size_t taken = parser.write_some(text.data(), text.size(), error);
  if (!error && taken < text.size()) return base::invalid("text after the end of the JSON", position_text(text, taken));
  if (!error) parser.finish(error);
  if (error) return base::invalid("no valid JSON: " + error.message(), position_text(text, taken));
  return parser.release();
}

Result<const FieldDescriptor*> find_field(const Descriptor& descriptor, std::string_view name) {
  const std::string text(name);
  const FieldDescriptor* field = descriptor.FindFieldByName(text);
  for (int i = 0; field == nullptr && i < descriptor.field_count(); ++i) {
    if (descriptor.field(i)->json_name() == name) field = descriptor.field(i);
  }
  if (field != nullptr) return field;
  return base::invalid("unknown field" + base::nearest_or_all(name, names_of_fields(descriptor)), escaped(name));
}

Status read_field(const json::value& value, Message& message, const FieldDescriptor& field) {
  message.GetReflection()->ClearField(&message, &field);
  if (value.is_null()) return {};
  return field.is_repeated() ? read_list(value, message, field) : read_value(value, message, field);
}

Status read_message(const json::value& value, Message& message) {
  if (!value.is_object()) return wrong_type(value, "an object");
  std::vector<const FieldDescriptor*> given;
  for (const auto& [key, content] : value.get_object()) {
    const auto found = find_field(*message.GetDescriptor(), key);
    if (!found.ok()) return found.status();
    const FieldDescriptor& field = **found;
    if (std::find(given.begin(), given.end(), &field) != given.end()) {
      return base::invalid("is given twice", field.name());
    }
    given.push_back(&field);
    if (const auto* oneof = field.real_containing_oneof(); oneof != nullptr && !content.is_null()) {
      if (const auto* other = message.GetReflection()->GetOneofFieldDescriptor(message, oneof)) {
        return base::invalid("stands beside " + other->name() + "; only one of them can be meant", field.name());
      }
    }
    if (auto status = read_field(content, message, field); !status.ok()) return status.inside(field.name());
  }
  return {};
}

}  // namespace pneuma::scene_io
