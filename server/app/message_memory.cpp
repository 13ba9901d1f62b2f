#include "app/message_memory.h"

#include <cstdint>
#include <string>
#include <unordered_map>

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/message.h>
#include <google/protobuf/wire_format_lite.h>

namespace pneuma::app {

namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::MessageFactory;
using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedInputStream;

// Of what stands in a list: its pointer there, with the list's spare room, and the allocator's own.
constexpr std::size_t item_bytes = 32;
// A number of a list, with its spare room; or of what the message does not know.
constexpr std::size_t number_bytes = 16;
// A packed number takes at least a byte on the wire; those that are told in so few take 4.
constexpr std::size_t packed_growth = 4;
// An unknown group is kept as it came, field by field; an empty one of two bytes is the worst.
constexpr std::size_t group_growth = 40;

class Sum {
 public:
  explicit Sum(std::size_t bytes_max) : bytes_max_(bytes_max) {}

  /// Goes through a message; false once the sum is past its limit, or the bytes are no such message.
  bool add(CodedInputStream& in, const Descriptor& descriptor, int depth) {
    bytes_ += size_of(descriptor);
    while (const std::uint32_t tag = in.ReadTag()) {
      if (!add_field(in, descriptor.FindFieldByNumber(WireFormatLite::GetTagFieldNumber(tag)), tag, depth))
        return false;
      if (!fits()) return false;
    }
    return in.ConsumedEntireMessage();
  }
  [[nodiscard]] bool fits() const { return bytes_ <= bytes_max_; }

 private:
  bool add_field(CodedInputStream& in, const FieldDescriptor* field, std::uint32_t tag, int depth) {
    if (WireFormatLite::GetTagWireType(tag) != WireFormatLite::WIRETYPE_LENGTH_DELIMITED) {
      const int start = in.CurrentPosition();
      if (!WireFormatLite::SkipField(&in, tag)) return false;
      bytes_ += number_bytes;
      if (WireFormatLite::GetTagWireType(tag) == WireFormatLite::WIRETYPE_START_GROUP) {
        bytes_ += static_cast<std::size_t>(in.CurrentPosition() - start) * group_growth;
      }
      return true;
    }
    std::uint32_t length = 0;
    if (!in.ReadVarint32(&length)) return false;
    if (field != nullptr && field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
      constexpr int depth_max = 100;  // protobuf's own
      if (depth == depth_max) return false;
      const CodedInputStream::Limit outer = in.PushLimit(static_cast<int>(length));
      if (!add(in, *field->message_type(), depth + 1)) return false;
      in.PopLimit(outer);
      return true;
    }
    const bool is_text = field == nullptr || field->cpp_type() == FieldDescriptor::CPPTYPE_STRING;
    bytes_ += is_text ? item_bytes + sizeof(std::string) + length : length * packed_growth;
    return in.Skip(static_cast<int>(length));
  }

  std::size_t size_of(const Descriptor& descriptor) {
    const auto [known, is_new] = sizes_.try_emplace(&descriptor);
    if (is_new) {
      const auto* message = MessageFactory::generated_factory()->GetPrototype(&descriptor);
      known->second = message->SpaceUsedLong() + item_bytes;
    }
    return known->second;
  }

  std::size_t bytes_max_;
  std::size_t bytes_ = 0;
  std::unordered_map<const Descriptor*, std::size_t> sizes_;  // of empty messages
};

}  // namespace

bool takes_at_most(std::string_view bytes, const Descriptor& descriptor, std::size_t bytes_max) {
  CodedInputStream in(reinterpret_cast<const std::uint8_t*>(bytes.data()), static_cast<int>(bytes.size()));
  Sum sum(bytes_max);
  sum.add(in, descriptor, 0);
  return sum.fits();
}

}  // namespace pneuma::app
