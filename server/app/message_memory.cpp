#include "app/message_memory.h"

#include <algorithm>
#include <cstdint>
#include <string>
#include <unordered_map>

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/message.h>
#include <google/protobuf/wire_format_lite.h>

#include "base/limits.h"

namespace pneuma::app {

namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::MessageFactory;
using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedInputStream;

// Beside the content of what stands in a list, or is kept though the message does not know it: its place there, the
// list's spare room and head, which a list of one has too, and the allocator's own.
constexpr std::size_t item_bytes = 48;
// A list of numbers grows to twice what it holds; on an arena the shorter lists that it was stay beside it.
constexpr std::size_t list_growth = 4;
// An unknown group is kept as it came, field by field; an empty one of two bytes is the worst.
constexpr std::size_t group_growth = 40;

std::size_t number_bytes(const FieldDescriptor& field) {
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_DOUBLE:
    case FieldDescriptor::CPPTYPE_INT64:
    case FieldDescriptor::CPPTYPE_UINT64:
      return 8;
    case FieldDescriptor::CPPTYPE_BOOL:
      return 1;
    default:
      return 4;
  }
}

/// How many numbers of a field are packed into its bytes: those of fixed length, or varints, each of which has one byte
/// with its highest bit unset.
std::size_t packed_count(const FieldDescriptor& field, std::string_view bytes) {
  switch (field.type()) {
    case FieldDescriptor::TYPE_DOUBLE:
    case FieldDescriptor::TYPE_FIXED64:
    case FieldDescriptor::TYPE_SFIXED64:
      return bytes.size() / 8;
    case FieldDescriptor::TYPE_FLOAT:
    case FieldDescriptor::TYPE_FIXED32:
    case FieldDescriptor::TYPE_SFIXED32:
      return bytes.size() / 4;
    default:
      return static_cast<std::size_t>(std::count_if(
          bytes.begin(), bytes.end(), [](char byte) { return (static_cast<unsigned char>(byte) & 0x80U) == 0; }));
  }
}

class Measure {
 public:
  explicit Measure(const MessageSize& most) : most_(most) {}

  void add_empty(const Descriptor& descriptor) { size_.bytes += size_of(descriptor); }
  /// Goes through a message's fields; false once a limit is passed, or the bytes are no such message.
  bool add(CodedInputStream& in, const Descriptor& descriptor, int depth) {
    while (const std::uint32_t tag = in.ReadTag()) {
      ++size_.fields;
      if (!add_field(in, descriptor.FindFieldByNumber(WireFormatLite::GetTagFieldNumber(tag)), tag, depth))
        return false;
      if (size_.bytes > most_.bytes || size_.fields > most_.fields) return false;
    }
    return in.ConsumedEntireMessage();
  }
  [[nodiscard]] base::Result<MessageSize> result() const {
    const auto past = [](const std::string& what, std::size_t limit, const char* unit) {
      return base::Status(base::StatusCode::limit_exceeded, what + " more than " + std::to_string(limit) + unit);
    };
    if (too_deep_) return past("holds messages within each other,", base::message_depth_max, " deep");
    if (size_.fields > most_.fields) return past("holds", most_.fields, " fields");
    if (size_.bytes > most_.bytes) return past("takes", most_.bytes, " bytes of memory");
    return size_;
  }

 private:
  bool add_field(CodedInputStream& in, const FieldDescriptor* field, std::uint32_t tag, int depth) {
    if (WireFormatLite::GetTagWireType(tag) != WireFormatLite::WIRETYPE_LENGTH_DELIMITED) {
      const int start = in.CurrentPosition();
      const bool skipped = WireFormatLite::SkipField(&in, tag);  // one that breaks off is kept up to there
      size_.bytes += item_bytes;
      if (WireFormatLite::GetTagWireType(tag) == WireFormatLite::WIRETYPE_START_GROUP) {
        size_.bytes += static_cast<std::size_t>(in.CurrentPosition() - start) * group_growth;
      }
      return skipped;
    }
    const bool is_message = field != nullptr && field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE;
    if (is_message) add_empty(*field->message_type());  // it is made before its length is read
    std::uint32_t length = 0;
    if (!in.ReadVarint32(&length)) return false;
    if (is_message) {
      too_deep_ = too_deep_ || depth == base::message_depth_max;
      if (too_deep_) return false;
      const CodedInputStream::Limit outer = in.PushLimit(static_cast<int>(length));
      if (!add(in, *field->message_type(), depth + 1)) return false;
      in.PopLimit(outer);
      return true;
    }
    // A number that stands alone cannot be packed: bytes in its place are kept as unknown.
    const bool is_packed = field != nullptr && field->is_packable();
    size_.bytes += item_bytes + (is_packed ? list_growth * number_bytes(*field) * packed_count(*field, rest(in, length))
                                           : sizeof(std::string) + length);
    return in.Skip(static_cast<int>(length));
  }

  /// The next bytes, as many as there are of `length`.
  static std::string_view rest(CodedInputStream& in, std::size_t length) {
    const void* bytes = nullptr;
    int size = 0;
    if (!in.GetDirectBufferPointer(&bytes, &size)) return {};
    return {static_cast<const char*>(bytes), std::min(length, static_cast<std::size_t>(size))};
  }

  std::size_t size_of(const Descriptor& descriptor) {
    const auto [known, is_new] = sizes_.try_emplace(&descriptor);
    if (is_new) {
      const auto* message = MessageFactory::generated_factory()->GetPrototype(&descriptor);
      known->second = message->SpaceUsedLong() + item_bytes;
    }
    return known->second;
  }

  const MessageSize most_;
  MessageSize size_;
  bool too_deep_ = false;
  std::unordered_map<const Descriptor*, std::size_t> sizes_;  // of empty messages
};

}  // namespace

base::Result<MessageSize> measure_message(std::string_view bytes, const Descriptor& descriptor,
                                          const MessageSize& most) {
  CodedInputStream in(reinterpret_cast<const std::uint8_t*>(bytes.data()), static_cast<int>(bytes.size()));
  Measure measure(most);
  measure.add_empty(descriptor);
  measure.add(in, descriptor, 0);
  return measure.result();
}

}  // namespace pneuma::app
