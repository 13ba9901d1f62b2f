#include "app/gatekeeper.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <utility>

namespace pneuma::app {

using base::Status;
using base::StatusCode;

namespace {

bool has_expired(const Grant& grant, std::chrono::sys_seconds now) {
  return grant.expires && *grant.expires <= now;
}

}  // namespace

void Gatekeeper::use(std::vector<Token> tokens) {
  asks_for_tokens_ = true;
  std::vector<Known> known;
  for (Token& token : tokens) {
    const auto same = std::ranges::find_if(
        known_, [&](const Known& before) { return *before.grant == token.grant && before.digest == token.digest; });
    GrantPtr grant = same != known_.end() ? same->grant : std::make_shared<const Grant>(std::move(token.grant));
    known.push_back({std::move(grant), token.digest, token.is_guessable});
  }
  known_ = std::move(known);
  valid_.clear();
  for (const Known& each : known_) valid_.insert(each.grant);
}

// Every token is compared, so that the time does not tell which one was nearly said. A token that nobody can guess is
// taken at any time: others at the address must not keep its client out.
Gatekeeper::Verdict Gatekeeper::admit(std::string_view token, const std::string& address, TimePoint now,
                                      std::chrono::sys_seconds wall_clock) {
  if (!asks_for_tokens_) return {everything(), {}, 0.0};
  const auto refused = [](const char* what) {
    return Verdict{nullptr, Status(StatusCode::unauthenticated, what), 0.0};
  };
  if (token.empty()) return refused("is missing: this server asks for a token");
  const TokenDigest digest = digest_of(token);
  const Known* said = nullptr;
  for (const Known& known : known_) {
    if (same_digest(known.digest, digest)) said = &known;
  }
  if (said != nullptr && has_expired(*said->grant, wall_clock)) said = nullptr;  // told from no other
  if (said != nullptr && !said->is_guessable) return {said->grant, {}, 0.0};
  if (const double wait_s = guesses_.wait_s(address, now); wait_s > 0.0) {
    return {nullptr, Status(StatusCode::limit_exceeded, "your address has said too many wrong tokens"), wait_s};
  }
  if (said != nullptr) return {said->grant, {}, 0.0};
  guesses_.note_wrong(address, digest, now);
  return refused("is not this server's");
}

Status Gatekeeper::check_still(const GrantPtr& grant, std::chrono::sys_seconds wall_clock) const {
  if (!asks_for_tokens_) return {};
  if (has_expired(*grant, wall_clock)) return {StatusCode::unauthenticated, "the token has expired"};
  if (valid_.contains(grant)) return {};
  return {StatusCode::unauthenticated, "the token was revoked, or allows something else now"};
}

std::string client_of(const Grant& grant, const std::string& address) {
  return grant.token_id.empty() ? address : grant.token_id + " at " + address;
}

std::chrono::sys_seconds wall_clock_now() {
  return std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
}

}  // namespace pneuma::app
