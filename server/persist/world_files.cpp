#include "persist/world_files.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <system_error>

#include <fcntl.h>

namespace pneuma::persist {
namespace {

bool is_plain(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_' ||
         static_cast<unsigned char>(c) >= 0x80;
}

}  // namespace

std::string encode_name(std::string_view name) {
  constexpr std::string_view digits = "0123456789ABCDEF";
  std::string component;
  for (const char c : name) {
    if (is_plain(c)) {
      component += c;
    } else {
      const auto byte = static_cast<unsigned char>(c);
      component += {'%', digits[byte >> 4], digits[byte & 0xF]};
    }
  }
  return component;
}

std::string decode_name(std::string_view component) {
  std::string name;
  for (std::size_t i = 0; i < component.size(); ++i) {
    if (component[i] != '%') {
      name += component[i];
      continue;
    }
    unsigned byte = 0;
    const char* end = component.data() + std::min(i + 3, component.size());
    if (std::from_chars(component.data() + i + 1, end, byte, 16).ptr != component.data() + i + 3) return {};
    name += static_cast<char>(byte);
    i += 2;
  }
  return encode_name(name) == component ? name : std::string();
}

std::string numbered_file(const std::string& folder, std::string_view prefix, std::uint64_t sequence) {
  std::array<char, 24> number{};
  std::snprintf(number.data(), number.size(), "%020llu", static_cast<unsigned long long>(sequence));
  return folder + "/" + std::string(prefix) + number.data();
}

base::Result<std::vector<std::uint64_t>> numbered_files(const std::string& folder, std::string_view prefix) {
  std::vector<std::uint64_t> numbers;
  std::error_code error;
  std::filesystem::directory_iterator entry(folder, error);
  if (error == std::errc::no_such_file_or_directory) return numbers;
  for (; !error && entry != std::filesystem::directory_iterator(); entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (!name.starts_with(prefix)) continue;
    std::uint64_t number = 0;
    const char* end = name.data() + name.size();
    const auto read = std::from_chars(name.data() + prefix.size(), end, number);
    if (read.ec == std::errc() && read.ptr == end) numbers.push_back(number);
  }
  if (error) return base::Status(base::StatusCode::unavailable, "cannot list: " + error.message(), folder);
  std::sort(numbers.begin(), numbers.end());
  return numbers;
}

base::Status system_failure(const char* verb, const std::string& path) {
  return {base::StatusCode::unavailable, std::string("cannot ") + verb + ": " + std::generic_category().message(errno),
          path};
}

base::Result<std::string> read_file(Files& files, const std::string& path, std::uint64_t bytes_max) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) return base::Status(base::StatusCode::unavailable, "cannot read: " + error.message(), path);
  if (size > bytes_max) {
    return base::Status(base::StatusCode::limit_exceeded,
                        "has " + std::to_string(size) + " bytes; at most " + std::to_string(bytes_max), path);
  }
  const int file = files.open(path.c_str(), O_RDONLY | O_CLOEXEC, 0);
  if (file < 0) return system_failure("read", path);
  std::string bytes(size, '\0');
  std::size_t done = 0;
  ssize_t count = 1;
  while (done < bytes.size() && count > 0) {
    do count = files.pread(file, bytes.data() + done, bytes.size() - done, static_cast<off_t>(done));
    while (count < 0 && errno == EINTR);
    if (count > 0) done += static_cast<std::size_t>(count);
  }
  const base::Status failure = count < 0 ? system_failure("read", path) : base::Status();
  files.close(file);
  if (!failure.ok()) return failure;
  bytes.resize(done);
  return bytes;
}

base::Status write_all(Files& files, int file, const std::string& path, std::string_view bytes, std::uint64_t offset) {
  while (!bytes.empty()) {
    const ssize_t count = files.pwrite(file, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return system_failure("write", path);
    if (count == 0) return {base::StatusCode::unavailable, "cannot write: the disk takes no byte", path};
    bytes.remove_prefix(static_cast<std::size_t>(count));
    offset += static_cast<std::uint64_t>(count);
  }
  return {};
}

base::Status sync_folder(Files& files, const std::string& folder) {
  const int file = files.open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC, 0);
  if (file < 0) return system_failure("sync the folder", folder);
  const base::Status status = files.fsync(file) < 0 ? system_failure("sync the folder", folder) : base::Status();
  files.close(file);
  return status;
}

base::Status make_folder(Files& files, const std::string& folder) {
  if (files.mkdir(folder.c_str(), 0750) < 0 && errno != EEXIST) return system_failure("make the folder", folder);
  return {};
}

}  // namespace pneuma::persist
