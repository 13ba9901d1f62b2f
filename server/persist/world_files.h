// The names of a world's files, and whole-file reads and writes through the seam.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/status.h"
#include "persist/files.h"

namespace pneuma::persist {

/// `name` as one path component: ASCII letters, digits, - and _ and every byte past ASCII stand for themselves, the
/// rest is %XX. So no name leaves the folder, and none is hidden.
[[nodiscard]] std::string encode_name(std::string_view name);
/// Empty where `component` is not what encode_name gives.
[[nodiscard]] std::string decode_name(std::string_view component);

inline constexpr std::string_view checkpoint_prefix = "checkpoint-";
inline constexpr std::string_view log_prefix = "log-";
inline constexpr std::string_view unfinished_checkpoint = "unfinished";

[[nodiscard]] std::string numbered_file(const std::string& folder, std::string_view prefix, std::uint64_t sequence);
/// The numbers of the files in `folder` that begin with `prefix`, ascending; none where there is no folder.
[[nodiscard]] base::Result<std::vector<std::uint64_t>> numbered_files(const std::string& folder,
                                                                      std::string_view prefix);

/// "cannot <verb>: <what errno says>", at `path`.
[[nodiscard]] base::Status system_failure(const char* verb, const std::string& path);

/// All of a file of at most `bytes_max` bytes; larger ones are refused unread.
[[nodiscard]] base::Result<std::string> read_file(Files& files, const std::string& path, std::uint64_t bytes_max);
/// All of `bytes` from `offset` on, however many writes it takes.
[[nodiscard]] base::Status write_all(Files& files, int file, const std::string& path, std::string_view bytes,
                                     std::uint64_t offset);
/// So that the folder's entries outlive the machine.
[[nodiscard]] base::Status sync_folder(Files& files, const std::string& folder);
/// Makes the folder where there is none; its parent exists.
[[nodiscard]] base::Status make_folder(Files& files, const std::string& folder);

}  // namespace pneuma::persist
