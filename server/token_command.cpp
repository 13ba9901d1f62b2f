#include "token_command.h"

#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>

#include "app/gatekeeper.h"
#include "app/token_file.h"

namespace pneuma {

namespace {

using app::Grant;
using app::Token;
using base::Status;

struct Asked {
  std::string file;
  std::string role;
  std::string worlds = "*";
  std::string expires;
  std::string id;
};

std::string wrong_worlds(const std::string& text) {
  const auto pattern = app::WorldPattern::parse(text);
  return pattern.ok() ? std::string() : pattern.status().what();
}

std::string wrong_duration(const std::string& text) {
  const auto duration = app::parse_duration(text);
  return duration.ok() ? std::string() : duration.status().what();
}

Status make_token(const Asked& asked) {
  Grant grant;
  grant.role = app::role_named(asked.role).value_or(app::Role::view);
  auto worlds = app::WorldPattern::parse(asked.worlds);
  if (!worlds.ok()) return worlds.status();
  grant.worlds = std::move(*worlds);
  if (!asked.expires.empty()) {
    const auto duration = app::parse_duration(asked.expires);
    if (!duration.ok()) return duration.status();
    grant.expires = app::wall_clock_now() + *duration;
  }
  const auto token = app::add_token(asked.file, std::move(grant));
  if (!token.ok()) return token.status();
  // The token alone on standard output, for scripts.
  std::fprintf(stderr, "token %s, which is shown this once:\n", token->id.c_str());
  std::puts(token->secret.c_str());
  return {};
}

Status list_tokens(const Asked& asked) {
  const auto tokens = app::read_tokens(asked.file);
  if (!tokens.ok()) return tokens.status();
  const auto now = app::wall_clock_now();
  std::size_t width = 6;
  for (const Token& token : *tokens) width = std::max(width, token.grant.worlds.text().size());
  std::printf("%-8s  %-5s  %-*s  %s\n", "ID", "ROLE", static_cast<int>(width), "WORLDS", "EXPIRES");
  for (const Token& token : *tokens) {
    const Grant& grant = token.grant;
    const bool has_expired = grant.expires && *grant.expires <= now;
    std::printf("%-8s  %-5s  %-*s  %s%s\n", grant.token_id.c_str(), std::string(app::name_of(grant.role)).c_str(),
                static_cast<int>(width), grant.worlds.text().c_str(), app::expiry_text(grant.expires).c_str(),
                has_expired ? " (expired)" : "");
  }
  return {};
}

}  // namespace

void add_token_commands(CLI::App& app, std::function<Status()>& work) {
  auto* tokens = app.add_subcommand("token", "Make, list and revoke tokens: who may do what");
  tokens->require_subcommand(1);
  const auto asked = std::make_shared<Asked>();
  const auto add = [&work, tokens, asked](const char* name, const char* what, Status (*does)(const Asked&)) {
    auto* command = tokens->add_subcommand(name, what);
    command->add_option("--tokens", asked->file, "The file of the server's --tokens")->required();
    command->callback([&work, asked, does] { work = [asked, does] { return does(*asked); }; });
    return command;
  };
  auto* make = add("new", "Make a token, and show it once", make_token);
  make->add_option("--role", asked->role,
                   "view: list, watch; edit: also push, edit, pause; admin: also create and destroy worlds")
      ->required()
      ->check(CLI::IsMember({"view", "edit", "admin"}));
  make->add_option("--world", asked->worlds, "A world's name, a prefix such as 'lab-*', or '*' for all")
      ->check(wrong_worlds, "")
      ->capture_default_str();
  make->add_option("--expires", asked->expires, "How long it counts: 90s, 30m, 12h, 7d")
      ->check(wrong_duration, "")
      ->default_str("for ever");
  add("list", "List the tokens, without what clients say", list_tokens);
  add("revoke", "End a token, and the sessions that it has",
      [](const Asked& given) { return app::revoke_token(given.file, given.id); })
      ->add_option("ID", asked->id, "As listed")
      ->required();
}

}  // namespace pneuma
