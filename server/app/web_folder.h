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
  /// Reads all files of a folder and of those in it; FILE.gz is FILE compressed. Errors name the file: one that cannot
  /// be read, of a type that is not known, or past the limits; a folder without index.html.
  [[nodiscard]] static base::Result<WebFolder> load(const std::string& folder);

  /// The file at a path of the HTTP address, `/` being `/index.html`; null where there is none.
  [[nodiscard]] const net::HttpReply* find(std::string_view path) const;

 private:
  std::map<std::string, net::HttpReply, std::less<>> files_;
};

/// Where the page lies that was built or installed with this program: ../share/pneuma/web beside it. Empty: nowhere.
[[nodiscard]] std::string web_folder_of_program();

}  // namespace pneuma::app
