// A folder that is written as a whole or not at all.
#pragma once

#include <filesystem>

namespace pneuma::report {

/// Where a report is written until it is whole: one that was interrupted leaves the page and the plots of the last.
class UnfinishedFolder {
 public:
  /// Within `target`, which is made where it is not there. What another one left is removed.
  explicit UnfinishedFolder(std::filesystem::path target);
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// What was written takes the place of what `target` has by the same names; the rest of it stays.
  void finish() const;

 private:
  std::filesystem::path target_;
  std::filesystem::path path_;
};

}  // namespace pneuma::report
