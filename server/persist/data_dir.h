// The folder that holds what a server keeps: a lock, and a folder a world. To hold a DataDir is to hold the lock, so
// that two servers never write to the same worlds.
#pragma once

#include <string>
#include <vector>

#include "base/status.h"
#include "persist/files.h"

namespace pneuma::persist {

class DataDir {
 public:
  /// Makes the folder where there is none, and takes its lock until this object dies. Fails with failed_precondition
  /// where another process holds it. What was being made or removed when a process ended is gone then: nobody was told
  /// of it. `files` outlives this object.
  [[nodiscard]] static base::Result<DataDir> open(const std::string& path, Files& files = system_files());
  DataDir(DataDir&& other) noexcept;
  DataDir& operator=(DataDir&& other) noexcept;
  ~DataDir();

  /// Why something that was being made or removed is still there, one each.
  [[nodiscard]] const std::vector<base::Status>& left() const { return left_; }

  /// The worlds that have a folder, sorted by name.
  [[nodiscard]] base::Result<std::vector<std::string>> list_worlds() const;
  /// Removes what is kept of a world, at once for whoever looks: half a world is never seen. OK where there is none.
  /// Fails with failed_precondition, and removes nothing, where a folder lies among its files. Of a link to a folder
  /// the link is removed alone.
  [[nodiscard]] base::Status remove_world(const std::string& world) const;

  /// Keeps a second name of each of a world's checkpoints and logs, "damaged-" before its own, which nothing removes
  /// but remove_world.
  [[nodiscard]] base::Status keep_aside(const std::string& world) const;
  /// Refuses a name that no folder can have: world_folder's own refusals.
  [[nodiscard]] static base::Status check_name(const std::string& world);

  /// Where a world's files lie; the folder itself is made by the first write. Fails for an empty name, and for one
  /// whose file name would be too long (most ASCII punctuation takes three bytes).
  [[nodiscard]] base::Result<std::string> world_folder(const std::string& world) const;
  [[nodiscard]] Files& files() const { return *files_; }

 private:
  DataDir(std::string path, int lock, Files& files) : path_(std::move(path)), lock_(lock), files_(&files) {}
  [[nodiscard]] base::Status remove_folder(const std::string& folder) const;

  std::string path_;
  int lock_;  // a file, held with flock
  Files* files_;
  std::vector<base::Status> left_;
};

}  // namespace pneuma::persist
