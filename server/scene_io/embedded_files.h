#pragma once

#include <cstddef>
#include <string_view>

namespace pneuma::scene_io {

/// One file of server/scenes as it was when the library was built.
struct EmbeddedFile {
  std::string_view name;  ///< its path below server/scenes: "five-balls.json", "assets/hand.obj"
  std::string_view text;
};

/// Sorted by name; a last, empty entry lies past the count.
extern const EmbeddedFile embedded_files[];
extern const std::size_t embedded_file_count;

}  // namespace pneuma::scene_io
