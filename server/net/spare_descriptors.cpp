#include "net/spare_descriptors.h"

#include <fcntl.h>
#include <unistd.h>

#include "base/token_limits.h"

namespace pneuma::net {

SpareDescriptors::~SpareDescriptors() {
  while (give_up_one()) {
  }
}

bool SpareDescriptors::fill() {
  while (files_.size() < base::spare_descriptors) {
    const int file = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
    if (file < 0) return false;
    files_.push_back(file);
  }
  return true;
}

bool SpareDescriptors::give_up_one() {
  if (files_.empty()) return false;
  ::close(files_.back());
  files_.pop_back();
  return true;
}

}  // namespace pneuma::net
