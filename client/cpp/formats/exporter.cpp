#include "formats/exporter.h"

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <set>

namespace pneuma::client {

base::Status check_same_bodies(const std::vector<SoftBodyFrame>& first, const Sample& sample) {
  if (same_bodies(first, sample.bodies)) return {};
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(),
                "the bodies or their meshes change by %.3f s, which this format cannot show: export the parts by --to "
                "and --from, or one body by --body",
                sample.at_s);
  return {base::StatusCode::unsupported, text.data()};
}

std::vector<std::string> file_names(const std::vector<SoftBodyFrame>& bodies, std::string_view others) {
  const auto is_plain = [&](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           others.find(c) != std::string_view::npos;
  };
  std::vector<std::string> names;
  std::set<std::string> taken;
  for (const SoftBodyFrame& body : bodies) {
    std::string plain = body.name;
    for (char& c : plain) c = is_plain(c) ? c : '_';
    if (plain.empty() || (plain[0] >= '0' && plain[0] <= '9')) plain.insert(0, 1, '_');
    std::string name = plain;
    for (int i = 2; !taken.insert(name).second; ++i) name = plain + "_" + std::to_string(i);
    names.push_back(std::move(name));
  }
  return names;
}

base::Status write_failure(const std::string& path) {
  return {base::StatusCode::unavailable, std::strerror(errno), path};
}

base::Status make_folder(const std::string& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error) return {base::StatusCode::unavailable, error.message(), path};
  return {};
}

}  // namespace pneuma::client
