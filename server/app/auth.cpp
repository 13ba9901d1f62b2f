#include "app/auth.h"

#include <fstream>

#include <openssl/crypto.h>
#include <openssl/sha.h>
#include <strings.h>
#include <sys/stat.h>

namespace pneuma::app {

base::Result<std::string> read_token(const std::string& file) {
  std::ifstream in(file);
  std::string token;
  if (!in || !std::getline(in, token)) return base::invalid("cannot read a token from it", file);
  if (!token.empty() && token.back() == '\r') token.pop_back();
  if (token.empty()) return base::invalid("its first line holds no token", file);
  return token;
}

bool is_world_readable(const std::string& file) {
  struct stat status{};
  return ::stat(file.c_str(), &status) == 0 && (status.st_mode & S_IROTH) != 0;
}

TokenDigest digest_of(std::string_view token) {
  static_assert(std::tuple_size_v<TokenDigest> == SHA256_DIGEST_LENGTH);
  TokenDigest digest{};
  SHA256(reinterpret_cast<const unsigned char*>(token.data()), token.size(), digest.data());
  return digest;
}

bool same_digest(const TokenDigest& a, const TokenDigest& b) {
  return CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

std::optional<std::string_view> bearer_token(std::string_view authorization) {
  constexpr std::string_view scheme = "Bearer ";  // in either case (RFC 9110, 11.1)
  if (authorization.size() <= scheme.size()) return std::nullopt;
  if (::strncasecmp(authorization.data(), scheme.data(), scheme.size()) != 0) return std::nullopt;
  return authorization.substr(scheme.size());
}

}  // namespace pneuma::app
