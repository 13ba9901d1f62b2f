#include "command/telling.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "base/in_file.h"
#include "base/nearest_word.h"
#include "command/json.h"
#include "command/output.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::client {

namespace {

// As many names as a line has room for.
// The digits that number_text shows.
constexpr double rounding_told = 1e-6;

/// A path begins with a request and one of its fields, as in "pause.world"; a file or an address does not.
bool is_wire_path(const std::string& where) {
  const std::size_t dot = where.find('.');
  if (dot == std::string::npos) return false;
  const auto* request = v1::ClientMessage::descriptor()->FindFieldByName(where.substr(0, dot));
  const std::size_t end = where.find_first_of(".[", dot + 1);
  return request != nullptr && request->message_type() != nullptr &&
         request->message_type()->FindFieldByName(where.substr(dot + 1, end - dot - 1)) != nullptr;
}

/// "is not finite" says it of the field: the path's last part goes before it.
bool lacks_subject(const std::string& what) {
  constexpr std::array<std::string_view, 11> verbs{"is",    "must",   "has",     "holds", "stands", "names",
                                                   "makes", "cannot", "belongs", "may",   "lacks"};
  return std::find(verbs.begin(), verbs.end(), what.substr(0, what.find(' '))) != verbs.end();
}

}  // namespace

std::string told(const base::Status& status) {
  const std::string& where = status.where();
  if (!is_wire_path(where)) return status.message();
  const std::string subject = lacks_subject(status.what()) ? where.substr(where.rfind('.') + 1) + " " : "";
  return subject + status.what() + " (" + where + ")";
}

base::Status in_users_file(const base::Status& status, const std::string& field, const std::string& file) {
  const std::string& where = status.where();
  if (!where.starts_with(field)) return status;
  const std::size_t dot = where.size() > field.size() && where[field.size()] == '.' ? 1 : 0;
  return base::in_file({status.code(), status.what(), where.substr(field.size() + dot)}, file);
}

base::Status with_suggestion(const base::Status& status, std::string_view word, std::span<const std::string> words) {
  return {status.code(), status.what() + base::nearest_or_all(word, words), status.where()};
}

void note(const Session& session, const std::string& text) {
  const std::string line = session.json ? JsonObject().add("note", text).text() : "pneuma: " + text;
  std::fprintf(stderr, "%s\n", shown(line).c_str());
}

void note_rounding(const Session& session, const SubscribeOptions& asked, const v1::Subscribed& got) {
  const auto differs = [](double wanted, double value) {
    return wanted > 0.0 && std::abs(wanted - value) > rounding_told * wanted;
  };
  if (differs(asked.rate_hz, got.rate_hz())) {
    note(session, number_text(got.rate_hz()) + " frames a second, not " + number_text(asked.rate_hz) +
                      ": a stream has the world's rate, or a whole part of it");
  }
  if (differs(asked.max_error_m, got.max_error_m())) {
    note(session, "within " + number_text(got.max_error_m()) + " m, not " + number_text(asked.max_error_m));
  }
}

void note_new_name(Session& session, const std::string& world) {
  const std::size_t dash = world.rfind('-');
  if (dash == std::string::npos || world.find_first_not_of("0123456789", dash + 1) != std::string::npos) return;
  const auto list = session.client.list_worlds();
  if (!list.ok()) return;
  const std::string name = world.substr(0, dash);
  const auto is_taken = [&](const auto& other) { return other.name() == name; };
  if (std::ranges::any_of(list->worlds(), is_taken)) {
    note(session, "the new world is " + world + ": there is a world " + name + " already");
  }
}

}  // namespace pneuma::client
