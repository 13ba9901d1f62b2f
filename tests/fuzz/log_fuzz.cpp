// No command log may crash the server that reads it back, whoever gave it the right sums; and a log that may go on does
// go on, with all that was there.
// Input: a byte of flags (sums are mended; the version is 1), then the file behind its header.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "base/byte_order.h"
#include "base/crc32c.h"
#include "persist/command_log.h"
#include "persist/world_files.h"
#include "support/temporary_folder.h"

using namespace pneuma;

namespace {

constexpr std::size_t length_at = 0, first_sum_at = 4;
constexpr std::size_t record_header_bytes = 20;
const std::string world = "w";

void must(bool holds) {
  if (!holds) std::abort();
}

void put(std::string& bytes, std::size_t at, std::uint32_t number) {
  std::string four;
  base::append_number(four, number);
  bytes.replace(at, four.size(), four);
}

/// Of records as version 2 has them: u32 length, u32 head sum, u64 tick, u32 sum, bytes.
void mend_sums(std::string& bytes) {
  std::uint32_t sum = 0;
  for (std::size_t at = 0; bytes.size() - at >= record_header_bytes;) {
    const auto length = base::number_at<std::uint32_t>(bytes, at + length_at);
    const std::string head = bytes.substr(at + length_at, 4) + bytes.substr(at + 8, 8);
    sum = base::crc32c(head, sum);
    put(bytes, at + first_sum_at, sum);
    if (length > bytes.size() - at - record_header_bytes) return;
    sum = base::crc32c(std::string_view(bytes).substr(at + record_header_bytes, length), sum);
    put(bytes, at + 16, sum);
    at += record_header_bytes + length;
  }
}

/// Likewise of version 1: u32 length, u32 sum of tick and bytes, u64 tick, bytes.
void mend_sums_unchained(std::string& bytes) {
  constexpr std::size_t header_bytes = 16;
  for (std::size_t at = 0; bytes.size() - at >= header_bytes;) {
    const auto length = base::number_at<std::uint32_t>(bytes, at + length_at);
    if (length > bytes.size() - at - header_bytes) return;
    put(bytes, at + first_sum_at, base::crc32c(std::string_view(bytes).substr(at + 8, 8 + length)));
    at += header_bytes + length;
  }
}

std::string header(std::uint32_t version) {
  std::string sequence;
  base::append_number(sequence, std::uint64_t{1});
  std::string bytes = "PNEUMALG";
  base::append_number(bytes, version);
  base::append_number(bytes, base::crc32c(sequence));
  return bytes + sequence;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  if (size == 0) return 0;
  static const support::TemporaryFolder folder(
      std::filesystem::is_directory("/dev/shm") ? "/dev/shm" : std::filesystem::temp_directory_path());
  static const auto data_dir = persist::DataDir::open(folder.path());
  must(data_dir.ok());
  must(data_dir->remove_world(world).ok());
  const std::string of_world = *data_dir->world_folder(world);
  std::filesystem::create_directory(of_world);

  const bool is_unchained = (bytes[0] & 2U) != 0;
  std::string records(reinterpret_cast<const char*>(bytes) + 1, size - 1);
  if ((bytes[0] & 1U) != 0) is_unchained ? mend_sums_unchained(records) : mend_sums(records);
  std::ofstream(persist::numbered_file(of_world, persist::log_prefix, 1), std::ios::binary)
      << header(is_unchained ? 1 : 2) << records;

  const auto replay = persist::read_commands(*data_dir, world, 1);
  if (!replay.ok() || replay->damage || !replay->end) return 0;
  auto log = persist::CommandLog::resume(*data_dir, world, *replay->end, persist::Sync::none);
  must(log.ok());
  const std::uint64_t tick = replay->records.empty() ? 0 : replay->records.back().tick;
  if (!log->write(tick, "more").ok()) return 0;  // full
  const auto again = persist::read_commands(*data_dir, world, 1);
  must(again.ok() && !again->damage && !again->torn && again->records.size() == replay->records.size() + 1);
  for (std::size_t i = 0; i < replay->records.size(); ++i) {
    must(again->records[i].tick == replay->records[i].tick && again->records[i].bytes == replay->records[i].bytes);
  }
  return 0;
}
