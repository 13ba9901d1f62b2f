#include "app/machine_memory.h"

#include <algorithm>
#include <fstream>

#include <unistd.h>

namespace pneuma::app {

namespace {

/// Of "max", or where there is no such file, `otherwise`.
std::size_t number_in(const std::string& file, std::size_t otherwise) {
  std::ifstream in(file);
  std::size_t number = 0;
  return in >> number ? number : otherwise;
}

}  // namespace

std::size_t machine_memory_bytes(const std::string& root) {
  std::size_t least =
      static_cast<std::size_t>(::sysconf(_SC_PHYS_PAGES)) * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  // cgroups(7): version 2 has one line "0::/path", version 1 one for each controller, "9:memory:/path".
  std::ifstream groups(root + "/proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    const std::size_t first = line.find(':');
    const std::size_t second = line.find(':', first + 1);
    if (first == std::string::npos || second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1);
    const bool is_first_version = controllers.find("memory") != std::string::npos;
    if (!controllers.empty() && !is_first_version) continue;
    const std::string folder = root + (is_first_version ? "/sys/fs/cgroup/memory" : "/sys/fs/cgroup");
    const char* file = is_first_version ? "/memory.limit_in_bytes" : "/memory.max";
    // In a container the path may be that of the host, of which only the root is there.
    for (std::string path = line.substr(second + 1);; path.erase(path.rfind('/'))) {
      least = std::min(least, number_in(folder + path + file, least));
      if (path.empty() || path.find('/') == std::string::npos) break;
    }
  }
  return least;
}

}  // namespace pneuma::app
