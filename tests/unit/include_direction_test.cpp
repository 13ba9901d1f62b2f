// Shows that arrows point one way: main -> app -> {scene_io, physics, codec, net, persist, proto} -> base, and
// pneuma -> replay -> {app, pneuma_client}.
// Reads every #include below server/, client/cpp/, client/c/ and client/python/native/ and holds its first path
// component against the table. The rooms of server/physics have arrows of their own, downwards in a second table.

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace {

namespace fs = std::filesystem;

struct Folder {
  fs::path path;                      // below the source tree
  std::set<std::string> may_include;  // first components of "folder/file.h" and <library/file.h>, beside its own
};

const std::vector<Folder> folders = {
    {"server/base", {"sys"}},
    {"server/usage", {"base", "CLI"}},
    {"server/physics", {"base", "Eigen"}},
    {"server/codec", {"base", "openssl"}},
    {"server/net", {"base", "boost", "openssl", "sys", "netinet"}},
    {"server/persist", {"base", "sys"}},
    {"server/scene_io", {"base", "physics", "pneuma", "google", "boost", "Eigen"}},
    {"server/app",
     {"base", "physics", "codec", "net", "persist", "scene_io", "pneuma", "google", "boost", "Eigen", "openssl",
      "prometheus", "spdlog", "sys"}},
    {"server/replay", {"base", "physics", "app", "net", "pneuma", "pneuma_client", "Eigen", "spdlog"}},
    {"client/cpp",
     {"base", "codec", "command", "formats", "replay", "usage", "pneuma", "pneuma_client", "google", "boost", "openssl",
      "CLI", "sys"}},
    {"client/c", {"base", "physics", "app", "pneuma", "pneuma_client", "google", "Eigen"}},
    {"client/python/native", {"base", "physics", "scene_io", "app", "pneuma", "pneuma_client", "pybind11"}},
};

/// Rooms of server/physics, the upper ones first, each with those that it may include. "" is physics/ itself.
const std::vector<Folder> rooms = {
    {"",
     {"choice", "rest", "contact", "implicit", "xpbd", "lanes", "forces", "rigid", "state", "scene", "mesh",
      "machine"}},
    {"choice", {"lanes", "forces", "state", "scene", "mesh"}},
    {"rest", {"contact", "forces", "rigid", "state", "scene", "mesh"}},
    {"contact", {"implicit", "lanes", "forces", "rigid", "state", "scene", "mesh", "machine"}},
    {"implicit", {"lanes", "forces", "state", "scene", "mesh", "machine"}},
    {"xpbd", {"forces", "state", "scene", "mesh", "machine"}},
    {"lanes", {"forces", "state", "scene", "mesh", "machine"}},
    {"forces", {"state", "scene", "mesh", "machine"}},
    {"rigid", {"state", "scene", "mesh", "machine"}},
    {"state", {"scene", "mesh", "machine"}},
    {"scene", {"mesh", "machine"}},
    {"mesh", {"machine"}},
    {"machine", {}},
};

struct Include {
  fs::path file;
  int line;
  std::string target;
};

std::vector<Include> includes_below(const fs::path& folder) {
  static const std::regex directive(R"(^\s*#\s*include\s*[<"]([^>"]+)[>"])");
  std::vector<Include> includes;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.path().extension() != ".h" && entry.path().extension() != ".cpp") continue;
    std::ifstream in(entry.path());
    std::string text;
    for (int line = 1; std::getline(in, text); ++line) {
      std::smatch match;
      if (std::regex_search(text, match, directive)) includes.push_back({entry.path(), line, match[1]});
    }
  }
  return includes;
}

TEST(IncludeDirection, NoArrowGoesBack) {
  const fs::path root = PNEUMA_SOURCE_DIR;
  for (const Folder& folder : folders) {
    const std::string own = folder.path.filename();
    for (const Include& include : includes_below(root / folder.path)) {
      const auto slash = include.target.find('/');
      if (slash == std::string::npos) continue;  // the standard library, or the C library
      const std::string first = include.target.substr(0, slash);
      EXPECT_TRUE(first == own || folder.may_include.contains(first))
          << include.file.string() << ":" << include.line << ": " << folder.path.string() << " may not include "
          << include.target;
    }
  }
}

TEST(IncludeDirection, NoArrowBetweenRoomsOfPhysicsGoesBack) {
  const fs::path physics = fs::path(PNEUMA_SOURCE_DIR) / "server/physics";
  for (const Include& include : includes_below(physics)) {
    const fs::path target = include.target;
    if (*target.begin() != "physics") continue;
    const fs::path own = include.file.lexically_relative(physics).parent_path();
    const std::string other = target.lexically_relative("physics").parent_path();
    const auto room = std::ranges::find(rooms, own, &Folder::path);
    if (own == other || room == rooms.end()) continue;  // EveryRoomOfPhysicsIsInTheTable names it
    EXPECT_TRUE(room->may_include.contains(other)) << include.file.string() << ":" << include.line << ": physics/"
                                                   << own.string() << " may not include " << include.target;
  }
}

// So that no two rooms can include each other, directly or through others.
TEST(IncludeDirection, RoomsOfPhysicsMayIncludeOnlyThoseBelow) {
  std::set<std::string> above;
  for (const Folder& room : rooms) {
    above.insert(room.path);
    for (const std::string& other : room.may_include) {
      EXPECT_FALSE(above.contains(other)) << room.path.string() << " may include " << other << ", which is not below";
    }
  }
}

TEST(IncludeDirection, EveryRoomOfPhysicsIsInTheTable) {
  for (const auto& entry : fs::directory_iterator(fs::path(PNEUMA_SOURCE_DIR) / "server/physics")) {
    if (!entry.is_directory()) continue;
    EXPECT_NE(std::ranges::find(rooms, entry.path().filename(), &Folder::path), rooms.end())
        << entry.path().string() << " has no line in the table of this test";
  }
}

TEST(IncludeDirection, EveryFolderIsInTheTable) {
  for (const auto& entry : fs::directory_iterator(fs::path(PNEUMA_SOURCE_DIR) / "server")) {
    if (!entry.is_directory() || entry.path().filename() == "scenes") continue;
    const bool listed = std::any_of(folders.begin(), folders.end(), [&](const Folder& folder) {
      return folder.path == fs::path("server") / entry.path().filename();
    });
    EXPECT_TRUE(listed) << entry.path().string() << " has no line in the table of this test";
  }
}

}  // namespace
