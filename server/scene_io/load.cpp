#include "scene_io/load.h"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <system_error>

#include "base/in_file.h"
#include "base/limits.h"
#include "base/nearest_word.h"
#include "scene_io/embedded_files.h"
#include "scene_io/json.h"
#include "scene_io/quoted.h"

namespace pneuma::scene_io {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view extension = ".json";

const EmbeddedFile* find_builtin(std::string_view name) {
  const EmbeddedFile* end = embedded_files + embedded_file_count;
  const EmbeddedFile* found = std::find_if(embedded_files, end, [name](const EmbeddedFile& file) {
    return file.name.size() == name.size() + extension.size() && file.name.starts_with(name) &&
           file.name.ends_with(extension);
  });
  return found == end ? nullptr : found;
}

/// The nearest of those there are, and all of them.
std::string builtin_hint(std::string_view name) {
  const std::vector<std::string> names = builtin_scene_names();
  std::string hint = base::did_you_mean(name, names) + " built-in are: ";
  if (!hint.starts_with(';')) hint.insert(0, ";");
  for (std::size_t i = 0; i < names.size(); ++i) hint.append(i > 0 ? ", " : "") += names[i];
  return hint;
}

base::Status cannot_read(const std::string& path, const std::string& why) {
  return {base::StatusCode::unavailable, "cannot read: " + why, path};
}

base::Result<std::string> read_scene_file(const std::string& path) {
  std::error_code error;
  const fs::file_status found = fs::status(path, error);
  if (found.type() == fs::file_type::not_found) {
    return base::not_found("no such scene file, and no built-in scene" + builtin_hint(path), path);
  }
  if (error) return cannot_read(path, error.message());
  if (!fs::is_regular_file(found)) return base::invalid("is not a file", path);
  const std::uintmax_t size = fs::file_size(path, error);
  if (error) return cannot_read(path, error.message());
  if (size > base::scene_file_bytes_max) {
    return base::Status(base::StatusCode::limit_exceeded,
                        "has " + std::to_string(size) + " bytes; a scene file has at most " +
                            std::to_string(base::scene_file_bytes_max),
                        path);
  }
  std::string text(size, '\0');
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file.read(text.data(), static_cast<std::streamsize>(size))) {
    return cannot_read(path, errno != 0 ? std::generic_category().message(errno) : "it became shorter meanwhile");
  }
  return text;
}

}  // namespace

std::vector<std::string> builtin_scene_names() {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < embedded_file_count; ++i) {
    std::string_view name = embedded_files[i].name;
    if (!name.ends_with(extension)) continue;
    name.remove_suffix(extension.size());
    names.emplace_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

base::Result<v1::Scene> builtin_scene(const std::string& name) {
  const EmbeddedFile* file = find_builtin(name);
  if (file == nullptr) {
    return base::not_found("no built-in scene is named " + in_quotes(name) + builtin_hint(name));
  }
  return parse_scene_json(file->text);
}

base::Status in_scene(const base::Status& status, const std::string& name_or_file) {
  return base::in_file(status, name_or_file);
}

base::Result<v1::Scene> load_scene(const std::string& name_or_file) {
  if (name_or_file.empty()) return base::invalid("a scene's name or file is wanted", "scene");
  if (find_builtin(name_or_file) != nullptr) return builtin_scene(name_or_file);
  const auto text = read_scene_file(name_or_file);
  if (!text.ok()) return text.status();
  auto scene = parse_scene_json(*text);
  if (!scene.ok()) return in_scene(scene.status(), name_or_file);
  if (scene->name().empty()) scene->set_name(fs::path(name_or_file).stem().string());
  return scene;
}

}  // namespace pneuma::scene_io
