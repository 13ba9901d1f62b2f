#include "scene_io/finite_numbers.h"

#include <cmath>
#include <string>
#include <vector>

namespace pneuma::scene_io {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

namespace {

base::Status check(double value) {
  return std::isfinite(value) ? base::Status() : base::invalid("is not finite");
}

base::Status check_element(const Message& message, const Reflection& fields, const FieldDescriptor& field, int index) {
  if (field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE) {
    return check(fields.GetRepeatedDouble(message, &field, index));
  }
  return check_finite(fields.GetRepeatedMessage(message, &field, index));
}

base::Status check_field(const Message& message, const Reflection& fields, const FieldDescriptor& field) {
  if (!field.is_repeated()) {
    return field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE ? check(fields.GetDouble(message, &field))
                                                               : check_finite(fields.GetMessage(message, &field));
  }
  for (int i = 0; i < fields.FieldSize(message, &field); ++i) {
    const base::Status status = check_element(message, fields, field, i);
    if (!status.ok()) return status.inside(std::string("[").append(std::to_string(i)).append("]"));
  }
  return {};
}

}  // namespace

base::Status check_finite(const Message& message) {
  const Reflection& fields = *message.GetReflection();
  std::vector<const FieldDescriptor*> set;
  fields.ListFields(message, &set);
  for (const FieldDescriptor* field : set) {
    const bool may_hold =
        field->cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE || field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE;
    if (!may_hold) continue;
    const base::Status status = check_field(message, fields, *field);
    if (!status.ok()) return status.inside(std::string(field->name()));
  }
  return {};
}

}  // namespace pneuma::scene_io
