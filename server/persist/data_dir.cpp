#include "persist/data_dir.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include "persist/command_log.h"
#include "persist/world_files.h"

namespace pneuma::persist {
namespace {

namespace fs = std::filesystem;

// What file systems allow one component of a path.
constexpr std::size_t component_bytes_max = 255;
// Not what encode_name can give, so no world is named so.
constexpr std::string_view removed_prefix = ".removed-";
constexpr std::size_t encoded_bytes_max = component_bytes_max - removed_prefix.size();

std::string holder(int lock) {
  std::array<char, 32> pid{};
  const ssize_t count = ::pread(lock, pid.data(), pid.size() - 1, 0);
  return count > 0 ? " (process " + std::string(pid.data(), static_cast<std::size_t>(count)) + ")" : "";
}

base::Result<int> take_lock(const std::string& path) {
  const int lock = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0640);
  if (lock < 0) return system_failure("open", path);
  if (::flock(lock, LOCK_EX | LOCK_NB) < 0) {
    const base::Status status = errno == EWOULDBLOCK
                                    ? base::Status(base::StatusCode::failed_precondition,
                                                   "another server uses this folder" + holder(lock), path)
                                    : system_failure("lock", path);
    ::close(lock);
    return status;
  }
  // For people; the lock itself is the kernel's, and ends with the process.
  const std::string pid = std::to_string(::getpid());
  if (::ftruncate(lock, 0) < 0 || ::pwrite(lock, pid.data(), pid.size(), 0) < 0) {
    const base::Status status = system_failure("write", path);
    ::close(lock);
    return status;
  }
  return lock;
}

std::string worlds_folder(const std::string& data_dir) {
  return data_dir + "/worlds";
}

/// Where there is no such folder, it is empty.
base::Result<std::vector<fs::directory_entry>> list_folder(const std::string& folder) {
  std::vector<fs::directory_entry> entries;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    entries.push_back(*entry);
  }
  if (!error || error == std::errc::no_such_file_or_directory) return entries;
  return base::Status(base::StatusCode::unavailable, "cannot list: " + error.message(), folder);
}

// Not through a link: what that leads to is not the server's.
bool is_folder(const fs::path& path) {
  std::error_code error;
  return fs::symlink_status(path, error).type() == fs::file_type::directory;
}

// A world's folder has files alone, and a link is removed without what it leads to.
base::Status check_removable(const std::string& folder) {
  if (!is_folder(folder)) return {};
  const auto entries = list_folder(folder);
  if (!entries.ok()) return entries.status();
  const auto inner = std::ranges::find_if(*entries, [](const auto& entry) { return is_folder(entry.path()); });
  if (inner == entries->end()) return {};
  return {base::StatusCode::failed_precondition, "cannot remove: it holds a folder, which no server made",
          inner->path().string()};
}

// A folder that has nothing but what is written before the first checkpoint is in its place.
bool was_being_made(const fs::path& folder) {
  if (decode_name(folder.filename().string()).empty() || !is_folder(folder)) return false;
  const auto entries = list_folder(folder.string());
  return entries.ok() && std::ranges::all_of(*entries, [&](const fs::directory_entry& entry) {
           std::error_code error;
           const std::string path = entry.path().string();
           return entry.path().filename() == unfinished_checkpoint ||
                  (path == numbered_file(folder.string(), log_prefix, 0) && entry.file_size(error) <= log_header_bytes);
         });
}

}  // namespace

base::Result<DataDir> DataDir::open(const std::string& path, Files& files) {
  std::error_code error;
  fs::create_directories(path, error);
  if (error) return base::Status(base::StatusCode::unavailable, "cannot make the folder: " + error.message(), path);
  const auto lock = take_lock(path + "/lock");
  if (!lock.ok()) return lock.status();
  DataDir data_dir(path, *lock, files);
  if (auto status = make_folder(files, worlds_folder(path)); !status.ok()) return status;

  const auto entries = list_folder(worlds_folder(path));
  if (!entries.ok()) return entries.status();
  for (const fs::directory_entry& entry : *entries) {
    if (!entry.path().filename().string().starts_with(removed_prefix) && !was_being_made(entry.path())) continue;
    if (auto status = data_dir.remove_folder(entry.path().string()); !status.ok()) data_dir.left_.push_back(status);
  }
  return data_dir;
}

DataDir::DataDir(DataDir&& other) noexcept
    : path_(std::move(other.path_)),
      lock_(std::exchange(other.lock_, -1)),
      files_(other.files_),
      left_(std::move(other.left_)) {}

DataDir& DataDir::operator=(DataDir&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(lock_, other.lock_);
  std::swap(files_, other.files_);
  std::swap(left_, other.left_);
  return *this;
}

DataDir::~DataDir() {
  if (lock_ >= 0) ::close(lock_);
}

base::Result<std::vector<std::string>> DataDir::list_worlds() const {
  const auto entries = list_folder(worlds_folder(path_));
  if (!entries.ok()) return entries.status();
  std::vector<std::string> worlds;
  for (const fs::directory_entry& entry : *entries) {
    std::string name = decode_name(entry.path().filename().string());
    std::error_code error;
    if (!name.empty() && entry.is_directory(error)) worlds.push_back(std::move(name));
    if (error) {
      return base::Status(base::StatusCode::unavailable, "cannot read: " + error.message(), entry.path().string());
    }
  }
  std::sort(worlds.begin(), worlds.end());
  return worlds;
}

base::Status DataDir::check_name(const std::string& world) {
  if (world.empty()) return base::invalid("a world without a name cannot be kept");
  const std::string component = encode_name(world);
  if (component.size() <= encoded_bytes_max) return {};
  return {base::StatusCode::limit_exceeded, "as a file name the world's name takes " +
                                                std::to_string(component.size()) + " bytes; at most " +
                                                std::to_string(encoded_bytes_max)};
}

base::Result<std::string> DataDir::world_folder(const std::string& world) const {
  if (auto status = check_name(world); !status.ok()) return status;
  return worlds_folder(path_) + "/" + encode_name(world);
}

base::Status DataDir::keep_aside(const std::string& world) const {
  const auto folder = world_folder(world);
  if (!folder.ok()) return folder.status();
  for (const std::string_view prefix : {checkpoint_prefix, log_prefix}) {
    const auto numbers = numbered_files(*folder, prefix);
    if (!numbers.ok()) return numbers.status();
    for (const std::uint64_t number : *numbers) {
      const std::string path = numbered_file(*folder, prefix, number);
      const std::string aside = numbered_file(*folder, "damaged-" + std::string(prefix), number);
      if (files_->link(path.c_str(), aside.c_str()) < 0 && errno != EEXIST) return system_failure("put aside", path);
    }
  }
  return sync_folder(*files_, *folder);
}

base::Status DataDir::remove_world(const std::string& world) const {
  const auto folder = world_folder(world);
  if (!folder.ok()) return folder.status();
  const std::string removed = worlds_folder(path_) + "/" + std::string(removed_prefix) + encode_name(world);
  if (auto status = remove_folder(removed); !status.ok()) return status;
  if (auto status = check_removable(*folder); !status.ok()) return status;
  if (files_->rename(folder->c_str(), removed.c_str()) < 0) {
    return errno == ENOENT ? base::Status() : system_failure("remove", *folder);
  }
  if (auto status = sync_folder(*files_, worlds_folder(path_)); !status.ok()) return status;
  return remove_folder(removed);
}

base::Status DataDir::remove_folder(const std::string& folder) const {
  if (auto status = check_removable(folder); !status.ok()) return status;
  if (!is_folder(folder)) {
    return files_->unlink(folder.c_str()) == 0 || errno == ENOENT ? base::Status() : system_failure("remove", folder);
  }
  const auto entries = list_folder(folder);
  if (!entries.ok()) return entries.status();
  for (const fs::directory_entry& entry : *entries) {
    if (files_->unlink(entry.path().c_str()) < 0) return system_failure("remove", entry.path().string());
  }
  if (files_->rmdir(folder.c_str()) < 0 && errno != ENOENT) return system_failure("remove", folder);
  return {};
}

}  // namespace pneuma::persist
