// What has to wait until the rest of a file is known, kept out of memory: a file without a name.
#pragma once

#include <cstdio>
#include <memory>
#include <ostream>
#include <string_view>

#include "base/status.h"

namespace pneuma::client {

class ScratchFile {
 public:
  ScratchFile() : file_(std::tmpfile()) {}
  [[nodiscard]] base::Status append(std::string_view bytes);
  /// All of it, after what `out` holds.
  [[nodiscard]] base::Status copy_to(std::ostream& out);

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::unique_ptr<std::FILE, Close> file_;
};

}  // namespace pneuma::client
