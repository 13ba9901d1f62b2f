#include "app/auth.h"

#include <array>
#include <fstream>

#include <openssl/crypto.h>
#include <openssl/sha.h>
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

bool same_token(std::string_view given, std::string_view expected) {
  // Digests have one length, so that the time does not tell the token's length either.
  const auto digest = [](std::string_view text) {
    std::array<unsigned char, SHA256_DIGEST_LENGTH> out{};
    SHA256(reinterpret_cast<const unsigned char*>(text.data()), text.size(), out.data());
    return out;
  };
  const auto a = digest(given);
  const auto b = digest(expected);
  return CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

}  // namespace pneuma::app
