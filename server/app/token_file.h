// The file of --tokens: a line a token, "ID ROLE WORLDS EXPIRES DIGEST", of which the token itself cannot be told.
// Lines that begin with # are comments.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "app/auth.h"
#include "app/grant.h"
#include "base/status.h"

namespace pneuma::app {

struct Token {
  Grant grant;
  TokenDigest digest{};
  bool is_guessable = false;  // not one of those that are made here
};

/// Errors say FILE:LINE and what is wrong there.
[[nodiscard]] base::Result<std::vector<Token>> parse_tokens(std::string_view text, const std::string& file);
[[nodiscard]] base::Result<std::vector<Token>> read_tokens(const std::string& file);

/// "90s", "30m", "12h", "7d".
[[nodiscard]] base::Result<std::chrono::seconds> parse_duration(std::string_view text);
/// "2026-12-31T23:59:59Z", or "never".
[[nodiscard]] std::string expiry_text(const std::optional<std::chrono::sys_seconds>& expires);

struct NewToken {
  std::string id;
  std::string secret;  // what the client says; kept nowhere
};
/// Adds a token of 256 random bits to the file, which is made where there is none. The grant's id is chosen here. The
/// file gets the mode 0600 and is replaced as a whole: whoever reads it sees the old one or the new one.
[[nodiscard]] base::Result<NewToken> add_token(const std::string& file, Grant grant);
/// Takes the token out of the file.
[[nodiscard]] base::Status revoke_token(const std::string& file, const std::string& id);

/// Reads a file again where it has changed.
class WatchedTokenFile {
 public:
  explicit WatchedTokenFile(std::string file) : file_(std::move(file)) {}

  [[nodiscard]] const std::string& file() const { return file_; }
  /// What is in the file now.
  [[nodiscard]] base::Result<std::vector<Token>> read();
  /// Whether the file is another one than was read last, or could not be read then.
  [[nodiscard]] bool has_changed() const;

 private:
  /// Which file lies there, and how it was left; all 0 where none does.
  struct Mark {
    std::uint64_t inode = 0;
    std::uint64_t bytes = 0;
    std::int64_t modified_ns = 0;
    std::int64_t changed_ns = 0;
    bool operator==(const Mark&) const = default;
  };
  [[nodiscard]] Mark mark() const;

  std::string file_;
  Mark read_;
};

}  // namespace pneuma::app
