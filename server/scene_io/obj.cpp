#include "scene_io/obj.h"

#include <algorithm>
#include <charconv>
#include <string>

namespace pneuma::scene_io {
namespace {

/// The next word of the line; empty at its end.
std::string_view take_word(std::string_view& line) {
  constexpr std::string_view blank = " \t\r";
  line.remove_prefix(std::min(line.find_first_not_of(blank), line.size()));
  const std::string_view word = line.substr(0, line.find_first_of(blank));
  line.remove_prefix(word.size());
  return word;
}

bool take_position(std::string_view line, Eigen::Vector3d& position) {
  for (double& coordinate : position) {
    const std::string_view word = take_word(line);
    const auto read = std::from_chars(word.data(), word.data() + word.size(), coordinate);
    if (word.empty() || read.ec != std::errc() || read.ptr != word.data() + word.size()) return false;
  }
  return true;
}

bool take_face(std::string_view line, physics::Face& face) {
  for (std::uint32_t& corner : face) {
    std::string_view word = take_word(line);
    word = word.substr(0, word.find('/'));
    const auto read = std::from_chars(word.data(), word.data() + word.size(), corner);
    if (word.empty() || read.ec != std::errc() || read.ptr != word.data() + word.size() || corner == 0) return false;
    --corner;
  }
  return take_word(line).empty();
}

}  // namespace

base::Result<ObjMesh> parse_obj(std::string_view text) {
  ObjMesh mesh;
  for (std::size_t number = 1; !text.empty(); ++number) {
    std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    const std::string_view kind = take_word(line);
    bool good = true;
    if (kind == "v") good = take_position(line, mesh.positions_m.emplace_back());
    if (kind == "f") good = take_face(line, mesh.faces.emplace_back());
    if (!good) {
      return base::invalid(kind == "v" ? "a vertex needs three numbers" : "a face needs three positive indices",
                           "line " + std::to_string(number));
    }
  }
  return mesh;
}

}  // namespace pneuma::scene_io
