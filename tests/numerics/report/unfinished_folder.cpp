#include "numerics/report/unfinished_folder.h"

#include <utility>

namespace pneuma::report {

namespace fs = std::filesystem;

UnfinishedFolder::UnfinishedFolder(fs::path target) : target_(std::move(target)), path_(target_ / "unfinished") {
  fs::remove_all(path_);
  fs::create_directories(path_);
}

void UnfinishedFolder::finish() const {
  for (const fs::directory_entry& entry : fs::directory_iterator(path_)) {
    const fs::path place = target_ / entry.path().filename();
    fs::remove_all(place);
    fs::rename(entry.path(), place);
  }
  fs::remove(path_);
}

}  // namespace pneuma::report
