#include "app/token_file.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>
#include <system_error>

#include <fcntl.h>
#include <openssl/rand.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/token_limits.h"

namespace pneuma::app {

using base::Result;
using base::Status;
using base::StatusCode;
using std::chrono::sys_seconds;

namespace {

constexpr const char* expiry_form = "%Y-%m-%dT%H:%M:%SZ";
constexpr std::string_view never = "never";
constexpr std::size_t secret_bytes = 32;
constexpr std::size_t id_bytes = 4;  // names a token to people; guards nothing
constexpr std::string_view head =
    "# Tokens of pneuma-server, a line each: ID ROLE WORLDS EXPIRES DIGEST. pneuma-server token new, list and revoke\n"
    "# keep this file.\n";

Status failed(const std::string& what, const std::string& file) {
  return {StatusCode::unavailable, what + ": " + std::error_code(errno, std::generic_category()).message(), file};
}

std::string in_quotes(std::string_view text) {
  return std::string("'").append(text).append("'");
}

template <class Bytes>
std::string hex_of(const Bytes& bytes) {
  constexpr std::string_view digits = "0123456789abcdef";
  std::string text;
  for (const unsigned char byte : bytes) {
    text += digits[byte >> 4U];
    text += digits[byte & 15U];
  }
  return text;
}

bool read_hex(std::string_view text, TokenDigest& out) {
  if (text.size() != 2 * out.size()) return false;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const char* begin = text.data() + 2 * i;
    const auto [end, error] = std::from_chars(begin, begin + 2, out[i], 16);
    if (error != std::errc() || end != begin + 2) return false;
  }
  return true;
}

Result<std::string> random_hex(std::size_t bytes) {
  std::vector<unsigned char> drawn(bytes);
  if (RAND_bytes(drawn.data(), static_cast<int>(drawn.size())) != 1) {
    return Status(StatusCode::unavailable, "the system gives no random bytes");
  }
  return hex_of(drawn);
}

bool is_id(std::string_view text) {
  return text.size() == 2 * id_bytes && text.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

// What is no date, such as the 31st of February, does not come back as it was written.
bool read_expiry(const std::string& text, std::optional<sys_seconds>& out) {
  out.reset();
  if (text == never) return true;
  std::tm parts{};
  const char* end = ::strptime(text.c_str(), expiry_form, &parts);
  if (end == nullptr || *end != 0) return false;
  out = sys_seconds(std::chrono::seconds(::timegm(&parts)));
  return expiry_text(out) == text;
}

Result<Token> parse_line(const std::string& line) {
  std::istringstream words(line);
  std::string id;
  std::string role;
  std::string worlds;
  std::string expires;
  std::string digest;
  std::string more;
  words >> id >> role >> worlds >> expires >> digest;
  if (!words || words >> more) return base::invalid("is not ID ROLE WORLDS EXPIRES DIGEST");
  Token token;
  token.grant.token_id = id;
  if (!is_id(id)) return base::invalid(in_quotes(id) + " is no id of 8 hexadecimal digits");
  const auto named = role_named(role);
  if (!named) return base::invalid(in_quotes(role) + " is no role: view, edit or admin");
  token.grant.role = *named;
  auto pattern = WorldPattern::parse(worlds);
  if (!pattern.ok()) return pattern.status();
  token.grant.worlds = std::move(*pattern);
  if (!read_expiry(expires, token.grant.expires)) {
    return base::invalid(in_quotes(expires) + " is no time such as 2026-12-31T23:59:59Z, and not never");
  }
  if (!read_hex(digest, token.digest)) return base::invalid("the digest is not 64 hexadecimal digits");
  return token;
}

// Whatever waits for somebody to write, as a pipe does, is no file of tokens.
Result<std::string> read_text(const std::string& file) {
  std::error_code error;
  if (std::filesystem::exists(file, error) && !std::filesystem::is_regular_file(file, error)) {
    return Status(StatusCode::unavailable, std::string("is no ").append("regular file"), file);
  }
  std::ifstream in(file, std::ios::binary);
  if (!in) return failed("cannot be read", file);
  std::string text(base::token_file_bytes_max + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (in.bad()) return failed("cannot be read", file);
  text.resize(static_cast<std::size_t>(in.gcount()));
  if (text.size() > base::token_file_bytes_max) {
    return Status(StatusCode::limit_exceeded,
                  std::string("is larger than ").append(std::to_string(base::token_file_bytes_max)).append(" bytes"),
                  file);
  }
  return text;
}

/// An open file or folder.
class OpenDescriptor {
 public:
  explicit OpenDescriptor(int number) : number_(number) {}
  ~OpenDescriptor() {
    if (number_ >= 0) ::close(number_);
  }
  OpenDescriptor(const OpenDescriptor&) = delete;
  OpenDescriptor& operator=(const OpenDescriptor&) = delete;
  [[nodiscard]] int number() const { return number_; }
  [[nodiscard]] bool ok() const { return number_ >= 0; }

 private:
  int number_;
};

Status write_all(int file, std::string_view text, const std::string& name) {
  while (!text.empty()) {
    const ssize_t written = ::write(file, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return failed("cannot be written", name);
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return ::fsync(file) == 0 ? Status() : failed("cannot be written", name);
}

/// Root changes the file for a server that runs as another user, and has to read it: it stays that user's, and a new
/// one is the folder's owner's.
Status give_to_owner(int changed, const std::string& file, const OpenDescriptor& folder) {
  if (::geteuid() != 0) return {};
  struct stat owned{};
  if (::stat(file.c_str(), &owned) != 0 && ::fstat(folder.number(), &owned) != 0) return failed("has no owner", file);
  return ::fchown(changed, owned.st_uid, owned.st_gid) == 0 ? Status() : failed("cannot be given to its owner", file);
}

/// Only who holds the folder's lock changes files in it, so none loses another's token.
Status replace_file(const std::string& file, const OpenDescriptor& folder, std::string_view text) {
  const std::string temporary = file + ".new";
  ::unlink(temporary.c_str());  // of a writer that was killed
  {
    const OpenDescriptor out(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, S_IRUSR | S_IWUSR));
    if (!out.ok()) return failed("cannot be made", temporary);
    Status written = write_all(out.number(), text, temporary);
    if (written.ok()) written = give_to_owner(out.number(), file, folder);
    if (!written.ok()) {
      ::unlink(temporary.c_str());
      return written;
    }
  }
  if (::rename(temporary.c_str(), file.c_str()) != 0) return failed("cannot be replaced", file);
  return ::fsync(folder.number()) == 0 ? Status() : failed("its folder cannot be synced", file);
}

/// `change` makes the new text of the old one, whose tokens it is given.
template <class Change>
Status update_file(const std::string& given, bool may_be_new, const Change& change) {
  // A link to the file is followed, not replaced.
  std::error_code error;
  const std::filesystem::path file = std::filesystem::weakly_canonical(std::filesystem::absolute(given), error);
  if (error) return {StatusCode::unavailable, error.message(), given};
  const OpenDescriptor folder(::open(file.parent_path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!folder.ok() || ::flock(folder.number(), LOCK_EX) != 0) return failed("its folder cannot be opened", given);
  std::string text(head);
  if (!may_be_new || std::filesystem::exists(file, error)) {
    auto read = read_text(file);
    if (!read.ok()) return read.status();
    text = std::move(*read);
  }
  const auto tokens = parse_tokens(text, given);
  if (!tokens.ok()) return tokens.status();
  if (Status refused = change(text, *tokens); !refused.ok()) return refused;
  return replace_file(file, folder, text);
}

}  // namespace

Result<std::vector<Token>> parse_tokens(std::string_view text, const std::string& file) {
  std::vector<Token> tokens;
  std::set<std::string> ids;
  std::istringstream lines{std::string(text)};
  std::string line;
  for (std::size_t number = 1; std::getline(lines, line); ++number) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    const std::size_t first = line.find_first_not_of(" \t");
    if (first == std::string::npos || line[first] == '#') continue;
    auto token = parse_line(line);
    Status wrong = token.status();
    if (wrong.ok() && !ids.insert(token->grant.token_id).second) {
      wrong = base::invalid("the id " + token->grant.token_id + " was there already");
    }
    if (wrong.ok() && tokens.size() == base::tokens_max) {
      wrong = {StatusCode::limit_exceeded,
               std::string("is past the ").append(std::to_string(base::tokens_max)).append(" tokens of a file")};
    }
    if (!wrong.ok()) return Status(wrong.code(), wrong.what(), file + ":" + std::to_string(number));
    tokens.push_back(std::move(*token));
  }
  return tokens;
}

Result<std::vector<Token>> read_tokens(const std::string& file) {
  auto text = read_text(file);
  if (!text.ok()) return text.status();
  return parse_tokens(*text, file);
}

Result<std::chrono::seconds> parse_duration(std::string_view text) {
  const Status wrong = base::invalid(in_quotes(text) + " is no time such as 90s, 30m, 12h or 7d");
  std::uint32_t count = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), count);
  if (error != std::errc() || end + 1 != text.data() + text.size() || count == 0) return wrong;
  std::chrono::seconds duration{};
  switch (*end) {
    case 's':
      duration = std::chrono::seconds(count);
      break;
    case 'm':
      duration = std::chrono::minutes(count);
      break;
    case 'h':
      duration = std::chrono::hours(count);
      break;
    case 'd':
      duration = std::chrono::days(count);
      break;
    default:
      return wrong;
  }
  if (duration > base::token_life_max) {
    return Status(StatusCode::limit_exceeded,
                  in_quotes(text) + " is past " + std::to_string(base::token_life_max.count()) + " days");
  }
  return duration;
}

std::string expiry_text(const std::optional<sys_seconds>& expires) {
  if (!expires) return std::string(never);
  const std::time_t seconds = expires->time_since_epoch().count();
  std::tm parts{};
  std::array<char, 32> text{};
  if (::gmtime_r(&seconds, &parts) == nullptr) return {};
  return {text.data(), std::strftime(text.data(), text.size(), expiry_form, &parts)};
}

Result<NewToken> add_token(const std::string& file, Grant grant) {
  auto secret = random_hex(secret_bytes);
  if (!secret.ok()) return secret.status();
  Status added = update_file(file, true, [&](std::string& text, const std::vector<Token>& tokens) {
    if (tokens.size() == base::tokens_max) {
      return Status(StatusCode::limit_exceeded, "holds its " + std::to_string(base::tokens_max) + " tokens already",
                    file);
    }
    do {
      auto id = random_hex(id_bytes);
      if (!id.ok()) return id.status();
      grant.token_id = std::move(*id);
    } while (std::ranges::any_of(tokens, [&](const Token& t) { return t.grant.token_id == grant.token_id; }));
    if (!text.empty() && text.back() != '\n') text += '\n';
    text.append(grant.token_id).append(" ").append(name_of(grant.role)).append(" ").append(grant.worlds.text());
    text.append(" ").append(expiry_text(grant.expires)).append(" ").append(hex_of(digest_of(*secret))).append("\n");
    return Status();
  });
  if (!added.ok()) return added;
  return NewToken{grant.token_id, std::move(*secret)};
}

Status revoke_token(const std::string& file, const std::string& id) {
  return update_file(file, false, [&](std::string& text, const std::vector<Token>& tokens) {
    if (std::ranges::none_of(tokens, [&](const Token& t) { return t.grant.token_id == id; })) {
      return base::not_found("holds no token " + id, file);
    }
    std::istringstream lines(text);
    std::string kept;
    for (std::string line; std::getline(lines, line);) {
      std::istringstream words(line);
      std::string first;
      words >> first;
      if (first != id) kept.append(line).append("\n");
    }
    text = std::move(kept);
    return Status();
  });
}

WatchedTokenFile::Mark WatchedTokenFile::mark() const {
  struct stat status{};
  if (::stat(file_.c_str(), &status) != 0) return {};
  const auto nanoseconds = [](const timespec& time) {
    constexpr std::int64_t nanoseconds_per_s = 1'000'000'000;
    return std::int64_t{time.tv_sec} * nanoseconds_per_s + time.tv_nsec;
  };
  return {status.st_ino, static_cast<std::uint64_t>(status.st_size), nanoseconds(status.st_mtim),
          nanoseconds(status.st_ctim)};
}

// The mark is taken first: what changes while the file is read is read again.
Result<std::vector<Token>> WatchedTokenFile::read() {
  read_ = mark();
  return read_tokens(file_);
}

bool WatchedTokenFile::has_changed() const {
  return mark() != read_;
}

}  // namespace pneuma::app
