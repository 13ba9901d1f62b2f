// Shows whom a token lets in, in which worlds and for how long; and what each kind of request asks for.
#include "app/gatekeeper.h"

#include <algorithm>
#include <map>
#include <string>

#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>

#include "app/request_kinds.h"
#include "base/token_limits.h"

namespace pneuma::app {
namespace {

constexpr std::chrono::sys_seconds noon{std::chrono::hours(500'000)};

Token token_of(const std::string& secret, Role role, std::optional<std::chrono::sys_seconds> expires = {}) {
  return {{"id-of-" + secret, role, {}, expires}, digest_of(secret)};
}

constexpr Gatekeeper::TimePoint gate_start{std::chrono::hours(1)};

GrantPtr admitted(Gatekeeper& gatekeeper, const std::string& token, std::chrono::sys_seconds wall_clock = noon) {
  return gatekeeper.admit(token, "here", gate_start, wall_clock).grant;
}

TEST(Gatekeeper, WithoutTokensEveryoneMayDoEverything) {
  Gatekeeper open;
  EXPECT_EQ(admitted(open, "")->role, Role::admin);
  EXPECT_TRUE(admitted(open, "anything")->worlds.covers("any-world"));
}

TEST(Gatekeeper, WithTokensNobodyElseGetsIn) {
  Gatekeeper gatekeeper;
  gatekeeper.use({token_of("a", Role::view), token_of("b", Role::admin)});
  EXPECT_EQ(admitted(gatekeeper, "a")->role, Role::view);
  EXPECT_EQ(admitted(gatekeeper, "b")->role, Role::admin);
  for (const char* wrong : {"", "c", "A", "ab"}) {
    const auto verdict = gatekeeper.admit(wrong, "here", gate_start, noon);
    EXPECT_EQ(verdict.grant, nullptr) << wrong;
    EXPECT_EQ(verdict.refusal.code(), base::StatusCode::unauthenticated) << wrong;
  }
  gatekeeper.use({});
  EXPECT_EQ(admitted(gatekeeper, "a"), nullptr) << "no token is not an open house";
  EXPECT_EQ(admitted(gatekeeper, ""), nullptr);
}

TEST(Gatekeeper, ATokenEndsWhenItExpires) {
  Gatekeeper gatekeeper;
  gatekeeper.use({token_of("a", Role::view, noon)});
  const auto before = noon - std::chrono::seconds(1);
  const GrantPtr grant = admitted(gatekeeper, "a", before);
  ASSERT_NE(grant, nullptr);
  EXPECT_TRUE(gatekeeper.check_still(grant, before).ok());
  EXPECT_EQ(gatekeeper.check_still(grant, noon).code(), base::StatusCode::unauthenticated);
  EXPECT_EQ(admitted(gatekeeper, "a"), nullptr);
}

TEST(Gatekeeper, AGrantHoldsForAsLongAsItsTokenStaysAsItIs) {
  Gatekeeper gatekeeper;
  gatekeeper.use({token_of("a", Role::view), token_of("b", Role::view)});
  const GrantPtr grant = admitted(gatekeeper, "a");
  gatekeeper.use({token_of("a", Role::view)});
  EXPECT_TRUE(gatekeeper.check_still(grant, noon).ok()) << "another one went";
  Gatekeeper demoted = gatekeeper;
  demoted.use({token_of("a", Role::edit)});
  EXPECT_FALSE(demoted.check_still(grant, noon).ok()) << "it has another role";
  Token renewed = token_of("a", Role::view);
  renewed.digest = digest_of("c");
  gatekeeper.use({renewed});
  EXPECT_FALSE(gatekeeper.check_still(grant, noon).ok()) << "it is another one of the same id";
}

std::string guess(int number) {
  return "guess " + std::to_string(number);
}

// B11 of the list of attacks: 5,400 a second.
TEST(Gatekeeper, GuessesOfAnAddressBecomeFewAndFewer) {
  Gatekeeper gatekeeper;
  gatekeeper.use({});
  int looked_at = 0;
  double wait_max_s = 0.0;
  for (int ms = 0; ms < 3'600'000; ms += 100) {
    const auto verdict = gatekeeper.admit(guess(ms), "here", gate_start + std::chrono::milliseconds(ms), noon);
    ASSERT_EQ(verdict.grant, nullptr);
    if (verdict.refusal.code() == base::StatusCode::unauthenticated) {
      ++looked_at;
    } else {
      EXPECT_EQ(verdict.refusal.code(), base::StatusCode::limit_exceeded);
    }
    wait_max_s = std::max(wait_max_s, verdict.retry_after_s);
  }
  EXPECT_LE(looked_at, 5 + 6 + 60) << "in an hour: five at once, then after 1, 2, 4, 8, 16, 32 s, then each minute";
  EXPECT_GE(looked_at, 60);
  EXPECT_NEAR(wait_max_s, 60.0, 0.2);
}

TEST(Gatekeeper, GuessesOfOneAddressDoNotKeepOthersOut) {
  Gatekeeper gatekeeper;
  Token short_one = token_of("short", Role::admin);
  short_one.is_guessable = true;
  gatekeeper.use({token_of("random", Role::view), short_one});
  for (int i = 0; i < 100; ++i) (void)gatekeeper.admit(guess(i), "here", gate_start, noon);
  EXPECT_EQ(gatekeeper.admit("short", "here", gate_start, noon).refusal.code(), base::StatusCode::limit_exceeded)
      << "or the waits would tell that the others are wrong";
  EXPECT_NE(admitted(gatekeeper, "random"), nullptr) << "nobody finds that one by guessing";
  EXPECT_NE(gatekeeper.admit("short", "there", gate_start, noon).grant, nullptr);
  EXPECT_NE(gatekeeper.admit("short", "here", gate_start + std::chrono::minutes(2), noon).grant, nullptr);
}

TEST(Gatekeeper, TheSameWrongTokenAgainIsNoGuess) {
  Gatekeeper gatekeeper;
  Token short_one = token_of("short", Role::admin);
  short_one.is_guessable = true;
  gatekeeper.use({short_one});
  for (int i = 0; i < 1'000; ++i) EXPECT_EQ(admitted(gatekeeper, "of last year"), nullptr);
  EXPECT_NE(admitted(gatekeeper, "short"), nullptr);
}

TEST(GuessLimits, RememberSoManyAddressesAndNoMore) {
  GuessLimits limits;
  for (std::size_t i = 0; i < base::token_guessers_max + 100; ++i) {
    limits.note_wrong(std::to_string(i), digest_of("wrong"), gate_start + std::chrono::milliseconds(i));
  }
  EXPECT_EQ(limits.addresses(), base::token_guessers_max);
}

TEST(ClientRates, RememberAClientUntilItsBurstIsBack) {
  base::Limits limits;
  limits.commands_per_s = 1.0;
  limits.commands_burst = 10.0;
  ClientRates rates(limits);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(rates.commands_of("here", gate_start)->take(gate_start), 0.0);
  (void)rates.commands_of("there", gate_start + std::chrono::seconds(4));
  EXPECT_EQ(rates.clients(), 2U);
  (void)rates.commands_of("there", gate_start + std::chrono::seconds(5));
  EXPECT_EQ(rates.clients(), 1U);
}

TEST(WorldPatterns, CoverANameAPrefixOrAll) {
  const auto covers = [](const char* pattern, const char* world) {
    return WorldPattern::parse(pattern)->covers(world);
  };
  EXPECT_TRUE(covers("lab", "lab"));
  EXPECT_FALSE(covers("lab", "lab-1"));
  EXPECT_FALSE(covers("lab", "la"));
  EXPECT_TRUE(covers("lab-*", "lab-1"));
  EXPECT_TRUE(covers("lab-*", "lab-"));
  EXPECT_FALSE(covers("lab-*", "lab"));
  EXPECT_FALSE(covers("lab-*", "my-lab-1"));
  EXPECT_TRUE(covers("*", "anything"));
}

TEST(WorldPatterns, WhatIsNoPatternIsRefused) {
  for (const char* wrong : {"", "*lab", "l*b", "lab**", "lab 1", "lab/1", "läb"}) {
    EXPECT_FALSE(WorldPattern::parse(wrong).ok()) << wrong;
  }
}

// The roles stand here once more, so that a kind that is added, or given another role, is looked at twice.
TEST(RequestKinds, EachAsksForItsRoleAndNamesItsWorld) {
  const std::map<std::string, Role> roles{
      {"hello", Role::none},        {"ping", Role::view},           {"pong", Role::view},
      {"part", Role::view},         {"list_worlds", Role::view},    {"subscribe", Role::view},
      {"unsubscribe", Role::view},  {"get_stats", Role::view},      {"get_scene", Role::view},
      {"edit", Role::edit},         {"impulse", Role::edit},        {"grab", Role::edit},
      {"move_grab", Role::edit},    {"release_grab", Role::edit},   {"pause", Role::edit},
      {"resume", Role::edit},       {"step", Role::edit},           {"reset", Role::edit},
      {"seek", Role::edit},         {"create_world", Role::admin},  {"destroy_world", Role::admin},
      {"request_key", Role::view},  {"take_snapshot", Role::view},  {"read_snapshot", Role::view},
      {"rewind_world", Role::edit}, {"restore_world", Role::admin}, {"branch_world", Role::admin},
      {"get_state", Role::view},    {"set_state", Role::edit},      {"step_until", Role::edit},
      {"raycast", Role::view},      {"nearest_point", Role::view},  {"bodies_in_box", Role::view},
  };
  const auto* requests = v1::ClientMessage::descriptor()->FindOneofByName("request");
  EXPECT_EQ(static_cast<std::size_t>(requests->field_count()), roles.size());
  for (int i = 0; i < requests->field_count(); ++i) {
    const auto* field = requests->field(i);
    ASSERT_TRUE(roles.contains(field->name())) << field->name();
    EXPECT_EQ(role_for(static_cast<v1::ClientMessage::RequestCase>(field->number())), roles.at(field->name()))
        << field->name();
    // A field `world` of the request is the world that is looked at.
    v1::ClientMessage message;
    auto* request = message.GetReflection()->MutableMessage(&message, field);
    const auto* world = field->message_type()->FindFieldByName("world");
    ASSERT_EQ(world_of(message) != nullptr, world != nullptr) << field->name();
    if (world == nullptr) continue;
    request->GetReflection()->SetString(request, world, "w");
    EXPECT_EQ(*world_of(message), "w") << field->name();
  }
}

TEST(Bearer, TheTokenIsTakenOutOfItsHeader) {
  EXPECT_EQ(bearer_token("Bearer abc"), "abc");
  EXPECT_EQ(bearer_token("bearer abc"), "abc");
  for (const char* wrong : {"", "Bearer", "Bearer ", "Basic abc", "abc"}) {
    EXPECT_FALSE(bearer_token(wrong)) << wrong;
  }
}

}  // namespace
}  // namespace pneuma::app
