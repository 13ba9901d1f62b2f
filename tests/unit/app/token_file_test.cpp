// Shows what the file of tokens holds and what is wrong with a broken one: written, read back, and damaged by hand.
#include "app/token_file.h"

#include <filesystem>
#include <fstream>
#include <iterator>

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "support/temporary_folder.h"

namespace pneuma::app {
namespace {

std::string text_of(const std::string& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

Grant grant_of(Role role, const std::string& worlds) {
  Grant grant;
  grant.role = role;
  grant.worlds = *WorldPattern::parse(worlds);
  return grant;
}

TEST(TokenFile, ATokenIsKeptByItsDigestAlone) {
  const support::TemporaryFolder folder;
  const std::string file = folder / "tokens";
  Grant grant = grant_of(Role::edit, "lab-*");
  grant.expires = std::chrono::sys_days(std::chrono::year(2031) / 2 / 28) + std::chrono::hours(12);
  const auto made = add_token(file, grant);
  ASSERT_TRUE(made.ok()) << made.status().message();
  EXPECT_EQ(made->secret.size(), 64U) << "256 bits";
  EXPECT_EQ(text_of(file).find(made->secret), std::string::npos);

  const auto tokens = read_tokens(file);
  ASSERT_TRUE(tokens.ok()) << tokens.status().message();
  ASSERT_EQ(tokens->size(), 1U);
  grant.token_id = made->id;
  EXPECT_EQ(tokens->front().grant, grant);
  EXPECT_TRUE(same_digest(tokens->front().digest, digest_of(made->secret)));
  EXPECT_FALSE(same_digest(tokens->front().digest, digest_of(made->secret.substr(1))));
}

TEST(TokenFile, OnlyItsOwnerMayReadIt) {
  const support::TemporaryFolder folder;
  const std::string file = folder / "tokens";
  const auto mode = [&] { return std::filesystem::status(file).permissions(); };
  using std::filesystem::perms;
  ASSERT_TRUE(add_token(file, grant_of(Role::view, "*")).ok());
  EXPECT_EQ(mode(), perms::owner_read | perms::owner_write);
  std::filesystem::permissions(file, perms::all);
  ASSERT_TRUE(add_token(file, grant_of(Role::view, "*")).ok());
  EXPECT_EQ(mode(), perms::owner_read | perms::owner_write);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1) << "nothing is left beside it";
}

TEST(TokenFile, WhatRootChangesStaysItsOwners) {
  if (::geteuid() != 0) GTEST_SKIP() << "root alone gives files away";
  constexpr uid_t server = 4'321;
  const support::TemporaryFolder folder;
  const std::string file = folder / "tokens";
  const auto owner = [&] {
    struct stat found{};
    EXPECT_EQ(::stat(file.c_str(), &found), 0);
    return found.st_uid;
  };
  ASSERT_EQ(::chown(folder.path().c_str(), server, server), 0);
  const auto first = add_token(file, grant_of(Role::view, "*"));
  ASSERT_TRUE(first.ok());
  EXPECT_EQ(owner(), server);
  ASSERT_TRUE(revoke_token(file, first->id).ok());
  EXPECT_EQ(owner(), server);
}

TEST(TokenFile, ALinkToItIsFollowed) {
  const support::TemporaryFolder folder;
  std::filesystem::create_directory(folder / "real");
  ASSERT_TRUE(add_token(folder / "real/tokens", grant_of(Role::view, "*")).ok());
  std::filesystem::create_symlink(folder / "real/tokens", folder / "tokens");
  ASSERT_TRUE(add_token(folder / "tokens", grant_of(Role::view, "*")).ok());
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "tokens"));
  EXPECT_EQ(read_tokens(folder / "real/tokens")->size(), 2U);
}

TEST(TokenFile, ItsNameMayBeRelative) {
  const support::TemporaryFolder folder;
  const std::string relative = std::filesystem::relative(folder / "tokens").string();
  ASSERT_TRUE(add_token(relative, grant_of(Role::view, "*")).ok());
  EXPECT_EQ(read_tokens(folder / "tokens")->size(), 1U);
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(folder.path());
  EXPECT_TRUE(add_token("more-tokens", grant_of(Role::view, "*")).ok()) << "a file of the folder we are in";
  std::filesystem::current_path(before);
}

TEST(TokenFile, ARevokedTokenLeavesAndTheRestStaysAsItWas) {
  const support::TemporaryFolder folder;
  const std::string file = folder / "tokens";
  const auto first = add_token(file, grant_of(Role::view, "*"));
  std::ofstream(file, std::ios::app) << "# of the night shift\n";
  const std::string before = text_of(file);
  const auto second = add_token(file, grant_of(Role::admin, "lab"));
  ASSERT_TRUE(second.ok());
  EXPECT_TRUE(revoke_token(file, second->id).ok());
  EXPECT_EQ(text_of(file), before);
  const auto gone = revoke_token(file, second->id);
  EXPECT_EQ(gone.code(), base::StatusCode::not_found);
  EXPECT_EQ(read_tokens(file)->front().grant.token_id, first->id);
}

TEST(TokenFile, WhatIsWrongIsToldWithItsLine) {
  const std::string digest(64, 'a');
  const std::string good = "# a comment\n\n00000001 view * never " + digest + "\n";
  ASSERT_TRUE(parse_tokens(good, "f").ok());
  struct Case {
    std::string line;
    std::string says;
  };
  for (const Case& wrong : {
           Case{"00000002 boss * never " + digest, "'boss' is no role: view, edit or admin"},
           Case{"00000002 view lab/* never " + digest, "'lab/*' is no world's name"},
           Case{"00000002 view * 2026-02-31T00:00:00Z " + digest, "'2026-02-31T00:00:00Z' is no time"},
           Case{"00000002 view * never " + digest + "a", "the digest is not 64 hexadecimal digits"},
           Case{"00000002 view * never " + std::string(64, 'g'), "the digest is not 64 hexadecimal digits"},
           Case{"00000002 view * never", "is not ID ROLE WORLDS EXPIRES DIGEST"},
           Case{"00000002 view * never " + digest + " more", "is not ID ROLE WORLDS EXPIRES DIGEST"},
           Case{"0000000x view * never " + digest, "'0000000x' is no id"},
           Case{"00000001 view * never " + digest, "the id 00000001 was there already"},
       }) {
    const auto tokens = parse_tokens(good + wrong.line + "\n", "f");
    ASSERT_FALSE(tokens.ok()) << wrong.line;
    EXPECT_TRUE(tokens.status().message().starts_with("f:4: " + wrong.says)) << tokens.status().message();
  }
}

TEST(TokenFile, ABrokenFileIsNotWrittenOver) {
  const support::TemporaryFolder folder;
  const std::string file = folder / "tokens";
  std::ofstream(file) << "mine\n";
  EXPECT_FALSE(add_token(file, grant_of(Role::view, "*")).ok());
  EXPECT_EQ(text_of(file), "mine\n");
}

TEST(TokenFile, DurationsAreANumberAndAUnit) {
  EXPECT_EQ(*parse_duration("90s"), std::chrono::seconds(90));
  EXPECT_EQ(*parse_duration("30m"), std::chrono::minutes(30));
  EXPECT_EQ(*parse_duration("12h"), std::chrono::hours(12));
  EXPECT_EQ(*parse_duration("7d"), std::chrono::days(7));
  for (const char* wrong : {"", "7", "d", "0d", "-1d", "7 d", "7days", "1.5d", "4294967296s", "36526d"}) {
    EXPECT_FALSE(parse_duration(wrong).ok()) << wrong;
  }
}

TEST(TokenFile, AChangeIsSeen) {
  const support::TemporaryFolder folder;
  WatchedTokenFile watched(folder / "tokens");
  EXPECT_FALSE(watched.read().ok());
  EXPECT_FALSE(watched.has_changed());
  const auto made = add_token(watched.file(), grant_of(Role::view, "*"));
  EXPECT_TRUE(watched.has_changed());
  EXPECT_EQ(watched.read()->size(), 1U);
  EXPECT_FALSE(watched.has_changed());
  ASSERT_TRUE(revoke_token(watched.file(), made->id).ok());
  EXPECT_TRUE(watched.has_changed());
}

}  // namespace
}  // namespace pneuma::app
