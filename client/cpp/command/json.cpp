#include "command/json.h"

#include <array>
#include <cassert>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>

#include <google/protobuf/util/json_util.h>

namespace pneuma::client {

namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

/// The shortest text that reads back as the same double; null where JSON has no number for it.
std::string json_number(double value) {
  if (!std::isfinite(value)) return "null";
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

std::string_view code_name(base::StatusCode code) {
  using enum base::StatusCode;
  switch (code) {
    case ok:
      return "OK";
    case invalid_argument:
      return "INVALID_ARGUMENT";
    case not_found:
      return "NOT_FOUND";
    case already_exists:
      return "ALREADY_EXISTS";
    case limit_exceeded:
      return "LIMIT_EXCEEDED";
    case unauthenticated:
      return "UNAUTHENTICATED";
    case failed_precondition:
      return "FAILED_PRECONDITION";
    case unsupported:
      return "UNSUPPORTED";
    case malformed:
      return "MALFORMED";
    case unavailable:
      return "UNAVAILABLE";
    case internal:
      return "INTERNAL";
  }
  return "INTERNAL";
}

/// `json_of(i)` for each i below `count`.
template <class JsonOf>
std::string json_array(std::size_t count, const JsonOf& json_of) {
  std::string json = "[";
  for (std::size_t i = 0; i < count; ++i) {
    if (i > 0) json += ',';
    json += json_of(i);
  }
  return json + "]";
}

// Reflection has two accessors for every type: of a single field, and of an element of a repeated one.
template <class Value>
Value get(const Message& message, const FieldDescriptor* field, int index,
          Value (google::protobuf::Reflection::*single)(const Message&, const FieldDescriptor*) const,
          Value (google::protobuf::Reflection::*element)(const Message&, const FieldDescriptor*, int) const) {
  const auto* reflection = message.GetReflection();
  return field->is_repeated() ? (reflection->*element)(message, field, index) : (reflection->*single)(message, field);
}

/// `index` counts for a repeated field only.
std::string value_json(const Message& message, const FieldDescriptor* field, int index) {
  using Reflection = google::protobuf::Reflection;
  switch (field->cpp_type()) {
    case FieldDescriptor::CPPTYPE_BOOL:
      return get(message, field, index, &Reflection::GetBool, &Reflection::GetRepeatedBool) ? "true" : "false";
    case FieldDescriptor::CPPTYPE_INT32:
      return std::to_string(get(message, field, index, &Reflection::GetInt32, &Reflection::GetRepeatedInt32));
    case FieldDescriptor::CPPTYPE_INT64:
      return std::to_string(get(message, field, index, &Reflection::GetInt64, &Reflection::GetRepeatedInt64));
    case FieldDescriptor::CPPTYPE_UINT32:
      return std::to_string(get(message, field, index, &Reflection::GetUInt32, &Reflection::GetRepeatedUInt32));
    case FieldDescriptor::CPPTYPE_UINT64: {
      const auto value = get(message, field, index, &Reflection::GetUInt64, &Reflection::GetRepeatedUInt64);
      const bool is_hash = field->type() == FieldDescriptor::TYPE_FIXED64;
      return is_hash ? json_string(hash_text(value)) : std::to_string(value);
    }
    case FieldDescriptor::CPPTYPE_FLOAT:
      return json_number(get(message, field, index, &Reflection::GetFloat, &Reflection::GetRepeatedFloat));
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return json_number(get(message, field, index, &Reflection::GetDouble, &Reflection::GetRepeatedDouble));
    case FieldDescriptor::CPPTYPE_ENUM:
      return json_string(get(message, field, index, &Reflection::GetEnum, &Reflection::GetRepeatedEnum)->name());
    case FieldDescriptor::CPPTYPE_STRING:
      return json_string(get(message, field, index, &Reflection::GetString, &Reflection::GetRepeatedString));
    case FieldDescriptor::CPPTYPE_MESSAGE: {
      const auto* reflection = message.GetReflection();
      const Message& value = field->is_repeated() ? reflection->GetRepeatedMessage(message, field, index)
                                                  : reflection->GetMessage(message, field);
      return reply_json(value).text();
    }
  }
  return "null";
}

}  // namespace

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
  return add_raw(key, json_array(values.size(), [&](std::size_t i) { return json_number(values[i]); }));
}
JsonObject& JsonObject::add(std::string_view key, std::span<const std::string> texts) {
  return add_raw(key, json_array(texts.size(), [&](std::size_t i) { return json_string(texts[i]); }));
}
JsonObject& JsonObject::add(std::string_view key, std::span<const JsonObject> values) {
  return add_raw(key, json_array(values.size(), [&](std::size_t i) { return values[i].text(); }));
}

JsonObject reply_json(const Message& message) {
  const auto* type = message.GetDescriptor();
  const auto* reflection = message.GetReflection();
  JsonObject object;
  for (int i = 0; i < type->field_count(); ++i) {
    const FieldDescriptor* field = type->field(i);
    if (field->is_repeated()) {
      const auto count = static_cast<std::size_t>(reflection->FieldSize(message, field));
      object.add_raw(field->name(), json_array(count, [&](std::size_t element) {
                       return value_json(message, field, static_cast<int>(element));
                     }));
    } else if (!field->has_presence() || reflection->HasField(message, field)) {
      object.add_raw(field->name(), value_json(message, field, 0));
    }
  }
  return object;
}

std::string scene_json(const v1::Scene& scene, SceneForm form) {
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  options.add_whitespace = form == SceneForm::for_people;
  std::string text;
  [[maybe_unused]] const auto done = google::protobuf::util::MessageToJsonString(scene, &text, options);
  assert(done.ok());
  while (text.ends_with('\n')) text.pop_back();
  return text;
}

std::string error_json(const base::Status& status) {
  JsonObject error;
  error.add("code", code_name(status.code())).add("where", status.where()).add("what", status.what());
  return JsonObject().add("error", error).text();
}

std::string hash_text(std::uint64_t hash) {
  std::array<char, 20> text{};
  std::snprintf(text.data(), text.size(), "0x%016llx", static_cast<unsigned long long>(hash));
  return text.data();
}

}  // namespace pneuma::client
