// Failures of a text that came from a file.
#pragma once

#include <string>

#include "base/status.h"

namespace pneuma::base {

/// The same failure in a file that the user knows: `where` becomes the file, with its line and column behind it
/// (`scene.json:3:7`) where it was `line 3, column 7`. Another path stays, before what was wrong.
[[nodiscard]] Status in_file(const Status& status, const std::string& file);

}  // namespace pneuma::base
