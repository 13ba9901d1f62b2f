// The files of the page that browsers are shown, held in memory.
#pragma once

#include <map>
#include <string>
#include <string_view>

#include "base/status.h"
#include "net/server.h"

namespace pneuma::app {

class WebFolder {
 public:
  /// No files.
  WebFolder() = default;
  /// Reads all files of a folder and of those in it, but none whose name, or whose folder's, begins with a dot; FILE.gz
  /// is FILE compressed. A link to a file of the folder, by whatever name, is that file; links to folders are passed
  /// over. (So a mounted ConfigMap of Kubernetes will do: links, through `..data`, to files in a hidden folder.) Errors
  /// name the file: one that cannot be read, of a type that is not known, a link that leads nowhere or out of the
  /// folder, or past the limits; a folder without index.html.
  [[nodiscard]] static base::Result<WebFolder> load(const std::string& folder);

  /// The file at a path of the HTTP address, `/` being `/index.html`; null where there is none.
  [[nodiscard]] const net::HttpReply* find(std::string_view path) const;

 private:
  std::map<std::string, net::HttpReply, std::less<>> files_;
};

/// Where the page lies that was built or installed with this program: ../share/pneuma/web beside it. Empty: nowhere.
[[nodiscard]] std::string web_folder_of_program();

}  // namespace pneuma::app
