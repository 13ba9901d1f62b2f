#include "app/envelope.h"

#include <cstddef>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>

#include "base/limits.h"

namespace pneuma::app {

namespace {

using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedInputStream;

struct Field {
  enum class Kind { number, bytes, fixed };
  int number = 0;
  Kind kind = Kind::fixed;
  std::uint64_t value = 0;  // of a number
  std::string_view bytes;
};

/// Goes through a message's own fields.
class Fields {
 public:
  explicit Fields(std::string_view bytes)
      : bytes_(bytes), in_(reinterpret_cast<const std::uint8_t*>(bytes.data()), static_cast<int>(bytes.size())) {}

  /// The next field; nothing at the end, which is good() if there was nothing wrong.
  std::optional<Field> next() {
    const std::uint32_t tag = in_.ReadTag();
    if (tag == 0) {
      good_ = in_.ConsumedEntireMessage();
      return std::nullopt;
    }
    Field field;
    field.number = WireFormatLite::GetTagFieldNumber(tag);
    if (++count_ > base::envelope_fields_max || field.number == 0 || !read(tag, field)) return std::nullopt;
    return field;
  }
  [[nodiscard]] bool good() const { return good_; }

 private:
  bool read(std::uint32_t tag, Field& field) {
    switch (WireFormatLite::GetTagWireType(tag)) {
      case WireFormatLite::WIRETYPE_VARINT:
        field.kind = Field::Kind::number;
        return in_.ReadVarint64(&field.value);
      case WireFormatLite::WIRETYPE_LENGTH_DELIMITED: {
        std::uint32_t length = 0;
        if (!in_.ReadVarint32(&length)) return false;
        field.kind = Field::Kind::bytes;
        field.bytes = bytes_.substr(static_cast<std::size_t>(in_.CurrentPosition()), length);
        return field.bytes.size() == length && in_.Skip(static_cast<int>(length));
      }
      case WireFormatLite::WIRETYPE_FIXED32:
      case WireFormatLite::WIRETYPE_FIXED64:
        return WireFormatLite::SkipField(&in_, tag);
      default:  // groups, which nothing says how far they go
        return false;
    }
  }

  std::string_view bytes_;
  CodedInputStream in_;
  std::size_t count_ = 0;
  bool good_ = false;
};

bool is_request(int number) {
  const auto* field = v1::ClientMessage::descriptor()->FindFieldByNumber(number);
  return field != nullptr && field->containing_oneof() != nullptr;
}

}  // namespace

std::optional<Envelope> read_envelope(std::string_view bytes) {
  Envelope envelope;
  Fields fields(bytes);
  while (const auto field = fields.next()) {
    if (field->number == v1::ClientMessage::kRequestIdFieldNumber && field->kind == Field::Kind::number) {
      envelope.request_id = field->value;
    }
    if (field->kind != Field::Kind::bytes || !is_request(field->number)) continue;
    if (envelope.request != v1::ClientMessage::REQUEST_NOT_SET) return std::nullopt;
    envelope.request = static_cast<v1::ClientMessage::RequestCase>(field->number);
    envelope.body = field->bytes;
  }
  if (!fields.good()) return std::nullopt;
  return envelope;
}

std::optional<PartView> read_part(std::string_view body) {
  PartView part;
  Fields fields(body);
  while (const auto field = fields.next()) {
    if (field->number == v1::Part::kDataFieldNumber && field->kind == Field::Kind::bytes) part.data = field->bytes;
    if (field->number == v1::Part::kLastFieldNumber && field->kind == Field::Kind::number)
      part.last = field->value != 0;
  }
  if (!fields.good()) return std::nullopt;
  return part;
}

}  // namespace pneuma::app
