#include "app/web_folder.h"

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <system_error>
#include <utility>

#include "base/crc32c.h"

namespace pneuma::app {

namespace fs = std::filesystem;
using base::Status;
using base::StatusCode;

namespace {

// Held in memory; the page is a hundredth of it.
constexpr std::uintmax_t folder_bytes_max = 64 * 1024 * 1024;

constexpr std::array<std::pair<std::string_view, std::string_view>, 7> content_types{{
    {".css", "text/css; charset=utf-8"},
    {".html", "text/html; charset=utf-8"},
    {".ico", "image/x-icon"},
    {".js", "text/javascript; charset=utf-8"},
    {".json", "application/json"},
    {".svg", "image/svg+xml"},
    {".txt", "text/plain; charset=utf-8"},
}};

std::string content_type_of(const fs::path& file) {
  for (const auto& [ending, type] : content_types) {
    if (file.extension() == ending) return std::string(type);
  }
  return {};
}

base::Result<std::string> read(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  if (!in) return Status(StatusCode::unavailable, "cannot be read", file.string());
  return bytes;
}

std::string tag_of(std::string_view bytes) {
  std::array<char, 32> tag{};
  std::snprintf(tag.data(), tag.size(), "\"%08x-%zx\"", static_cast<unsigned>(base::crc32c(bytes)), bytes.size());
  return tag.data();
}

bool is_hidden(const fs::path& file) {
  return file.filename().native().starts_with('.');
}

/// Both without links.
bool is_within(const fs::path& file, const fs::path& folder) {
  return *file.lexically_relative(folder).begin() != "..";
}

/// The files to serve, by their path from the folder, each with where it really lies.
base::Result<std::map<fs::path, fs::path>> files_in(const fs::path& folder) {
  std::error_code error;
  const fs::path real_folder = fs::canonical(folder, error);
  if (error) return Status(StatusCode::not_found, error.message(), folder.string());
  std::map<fs::path, fs::path> files;
  fs::recursive_directory_iterator entry(folder, error);
  for (; !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    const fs::path& path = entry->path();
    if (is_hidden(path)) {
      entry.disable_recursion_pending();
      continue;
    }
    std::error_code unreadable;  // the increment would overwrite `error`
    const bool is_file = entry->is_regular_file(unreadable);
    if (!unreadable && !is_file) continue;
    fs::path real = unreadable ? fs::path() : fs::canonical(path, unreadable);
    if (unreadable) return Status(StatusCode::unavailable, unreadable.message(), path.string());
    if (!is_within(real, real_folder)) {
      return Status(StatusCode::invalid_argument, "a link that leads out of the folder", path.string());
    }
    files.emplace(path.lexically_relative(folder), std::move(real));
  }
  if (error) return Status(StatusCode::unavailable, error.message(), folder.string());
  return files;
}

}  // namespace

base::Result<WebFolder> WebFolder::load(const std::string& folder) {
  const auto files = files_in(folder);
  if (!files.ok()) return files.status();
  WebFolder web;
  std::uintmax_t bytes = 0;
  for (const auto& [path, real] : *files) {
    const auto refuse = [&, &named = path](std::string what) {
      return Status(StatusCode::invalid_argument, std::move(what), (fs::path(folder) / named).string());
    };
    const bool compressed = path.extension() == ".gz";
    const fs::path plain = compressed ? fs::path(path).replace_extension() : path;
    std::string type = content_type_of(plain);
    if (type.empty()) return refuse("of a type that is not served");
    std::error_code error;
    bytes += fs::file_size(real, error);
    if (error) return refuse(error.message());
    if (bytes > folder_bytes_max) return refuse("more than the page of a server may be");
    auto content = read(real);
    if (!content.ok()) return content.status();
    net::HttpReply& file = web.files_[std::string("/").append(plain.generic_string())];
    file.content_type = std::move(type);
    if (!compressed) file.tag = tag_of(*content);
    (compressed ? file.gzip_body : file.body) = std::make_shared<const std::string>(std::move(*content));
  }
  if (web.find("/") == nullptr) return Status(StatusCode::not_found, "holds no index.html", folder);
  return web;
}

const net::HttpReply* WebFolder::find(std::string_view path) const {
  const auto file = files_.find(path == "/" ? "/index.html" : path);
  // Compressed alone, it is none.
  return file == files_.end() || file->second.tag.empty() ? nullptr : &file->second;
}

std::string web_folder_of_program() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  const fs::path folder = program.parent_path().parent_path() / "share/pneuma/web";
  return !error && fs::is_directory(folder, error) ? folder.string() : std::string();
}

}  // namespace pneuma::app
