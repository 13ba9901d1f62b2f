#include "app/inbox.h"

#include <memory>
#include <utility>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

#include "requests.h"

namespace pneuma::app {
namespace {

ReaderReported report(net::SessionId session, std::uint32_t stream_id, double drain_bytes_s) {
  return {session, {.at = {}, .drain_bytes_s = drain_bytes_s, .stream = {.stream_id = stream_id, .totals = {}}}};
}

Request get_stats_of(std::uint64_t request_id) {
  v1::ClientMessage message;
  message.set_request_id(request_id);
  message.mutable_get_stats();
  return request_of(nullptr, message);
}

TEST(Inbox, KeepsTheLastReportOnAReaderOfAStream) {
  Inbox inbox;
  for (int i = 1; i <= 10'000; ++i) {
    for (const std::uint32_t stream_id : {1U, 2U}) {
      ASSERT_EQ(inbox.post(report(7, stream_id, i)), Inbox::Post::taken);
    }
  }
  for (int i = 0; i < 2; ++i) {
    const auto taken = inbox.take();
    ASSERT_TRUE(taken);
    EXPECT_EQ(std::get<ReaderReported>(*taken).report.drain_bytes_s, 10'000.0);
  }
  EXPECT_FALSE(inbox.take());
}

TEST(Inbox, RequestsComeBeforeReportsAndAreCountedWithoutThem) {
  Inbox inbox;
  for (std::uint32_t i = 0; i < base::world_inbox_requests_max; ++i) (void)inbox.post(report(1, i, 0.0));
  for (std::size_t i = 0; i < base::world_inbox_requests_max; ++i) {
    ASSERT_EQ(inbox.post(get_stats_of(1)), Inbox::Post::taken);
  }
  EXPECT_EQ(inbox.post(get_stats_of(1)), Inbox::Post::full);
  EXPECT_EQ(inbox.post(get_stats_of(0)), Inbox::Post::taken) << "the server's own";
  EXPECT_TRUE(std::holds_alternative<Request>(*inbox.take()));
}

TEST(Inbox, WhoIsGoneHearsNoAnswersButChangesWhatWasAsked) {
  Inbox inbox;
  const auto gone = std::make_shared<Session>(7);
  const auto other = std::make_shared<Session>(8);
  v1::ClientMessage question;
  question.set_request_id(1);
  question.mutable_nearest_point();
  v1::ClientMessage impulse;
  impulse.set_request_id(2);
  impulse.mutable_impulse();
  for (const auto& session : {gone, other}) {
    for (const v1::ClientMessage& message : {question, impulse}) {
      ASSERT_EQ(inbox.post(request_of(session, message)), Inbox::Post::taken);
    }
  }
  ASSERT_EQ(inbox.post(SessionEnded{7}), Inbox::Post::taken);
  std::vector<std::pair<net::SessionId, bool>> left;
  for (auto command = inbox.take(); command; command = inbox.take()) {
    if (const auto* request = std::get_if<Request>(&*command)) {
      left.emplace_back(request->session->id(), request->message->has_impulse());
    }
  }
  EXPECT_EQ(left, (std::vector<std::pair<net::SessionId, bool>>{{7, true}, {8, false}, {8, true}}));
}

TEST(Inbox, SessionsHaveTheirTurnsAndEachItsOrder) {
  Inbox inbox;
  const auto many = std::make_shared<Session>(7);
  const auto one = std::make_shared<Session>(8);
  const auto post = [&](const std::shared_ptr<Session>& session, std::uint64_t id) {
    v1::ClientMessage message;
    message.set_request_id(id);
    message.mutable_get_stats();
    ASSERT_EQ(inbox.post(request_of(session, message)), Inbox::Post::taken);
  };
  for (const std::uint64_t id : {1U, 2U, 3U}) post(many, id);
  post(one, 4);
  std::vector<std::uint64_t> taken;
  for (auto command = inbox.take(); command; command = inbox.take()) {
    taken.push_back(std::get<Request>(*command).message->request_id());
  }
  EXPECT_EQ(taken, (std::vector<std::uint64_t>{1, 4, 2, 3}));
}

TEST(Inbox, LooksAtBodiesCanBeLeftWithWhatIsBehindThem) {
  Inbox inbox;
  v1::ClientMessage look;
  look.set_request_id(1);
  look.mutable_nearest_point();
  const auto looker = std::make_shared<Session>(7);
  ASSERT_EQ(inbox.post(request_of(looker, look)), Inbox::Post::taken);
  v1::ClientMessage impulse;
  impulse.mutable_impulse();
  for (const std::uint64_t id : {2U, 3U}) {
    impulse.set_request_id(id);
    ASSERT_EQ(inbox.post(request_of(id == 2 ? looker : std::make_shared<Session>(8), impulse)), Inbox::Post::taken);
  }
  const auto third = std::make_shared<Session>(9);
  look.set_request_id(4);
  ASSERT_EQ(inbox.post(request_of(third, look)), Inbox::Post::taken);
  ASSERT_EQ(inbox.post(KeyWanted{9, 1}), Inbox::Post::taken);
  const auto next_id = [&](Inbox::Leave leave) {
    const auto command = inbox.take(leave);
    return command ? std::get<Request>(*command).message->request_id() : 0;
  };
  EXPECT_EQ(next_id(Inbox::Leave::looks_at_bodies), 3U);
  const auto notice = inbox.take(Inbox::Leave::looks_at_bodies);
  ASSERT_TRUE(notice && std::holds_alternative<KeyWanted>(*notice)) << "no request waits with it";
  EXPECT_EQ(next_id(Inbox::Leave::looks_at_bodies), 0U);
  EXPECT_FALSE(inbox.is_empty());
  EXPECT_EQ(next_id(Inbox::Leave::nothing), 1U);
  EXPECT_EQ(next_id(Inbox::Leave::looks_at_bodies), 2U);
  EXPECT_EQ(next_id(Inbox::Leave::nothing), 4U);
  EXPECT_TRUE(inbox.is_empty());
}

TEST(Inbox, TheEndOfAWorldIsTakenOutOfTurn) {
  Inbox inbox;
  ASSERT_EQ(inbox.post(get_stats_of(1)), Inbox::Post::taken);
  v1::ClientMessage message;
  message.set_request_id(2);
  message.mutable_destroy_world();
  ASSERT_EQ(inbox.post(request_of(std::make_shared<Session>(7), message)), Inbox::Post::taken);
  const auto destroy = inbox.take_destroy();
  ASSERT_TRUE(destroy);
  EXPECT_EQ(destroy->message->request_id(), 2U);
  EXPECT_FALSE(inbox.take_destroy());
  EXPECT_TRUE(inbox.take());
  EXPECT_FALSE(inbox.take());
}

}  // namespace
}  // namespace pneuma::app
