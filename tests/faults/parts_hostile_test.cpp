// Shows that messages in parts, begun and never ended, too large, cut short or of garbage, cost a real server no more
// than the room that it gives them, and a bystander nothing; and that the room is there again once their senders go.
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "base/limits.h"
#include "integration/raw_connection.h"
#include "pneuma_client/client.h"
#include "support/process_memory.h"
#include "support/sanitizers.h"
#include "support/server_process.h"

namespace pneuma {
namespace {

using integration::RawConnection;

constexpr std::size_t part_bytes = 1'000'000;

class HostileParts : public testing::Test {
 protected:
  void SetUp() override {
    auto server = support::ServerProcess::start();
    ASSERT_TRUE(server.ok()) << server.status().message();
    server_.emplace(std::move(*server));
  }
  void TearDown() override {
    auto bystander = client::Client::connect(server_->tcp_address());
    ASSERT_TRUE(bystander.ok());
    EXPECT_TRUE(bystander->create_builtin("hanging-ball").ok());
    EXPECT_TRUE(server_->is_running());
  }

  /// The most memory that the server has taken so far.
  [[nodiscard]] std::size_t peak_bytes() const { return support::memory_bytes(server_->pid(), "VmHWM:").value(); }

  std::unique_ptr<RawConnection> opened() const {
    auto connection = std::make_unique<RawConnection>(server_->tcp_address());
    EXPECT_TRUE(connection->say_hello());
    return connection;
  }

  static void send_part(RawConnection& to, std::uint64_t request_id, std::string data, bool last = false) {
    v1::ClientMessage message;
    message.set_request_id(request_id);
    message.mutable_part()->set_data(std::move(data));
    message.mutable_part()->set_last(last);
    EXPECT_TRUE(to.send(message));
  }

  /// Sends parts of garbage until so many bytes have gone, and no last one; gives the first error that they get.
  static std::optional<v1::Error> fill(RawConnection& from, std::size_t bytes) {
    for (std::size_t sent = 0; sent < bytes; sent += part_bytes) {
      send_part(from, 5, std::string(std::min(part_bytes, bytes - sent), '\xff'));
    }
    v1::ClientMessage list;
    list.set_request_id(6);
    list.mutable_list_worlds();
    EXPECT_TRUE(from.send(list));
    const auto reply = from.receive();
    if (!reply || reply->request_id() != 5) return std::nullopt;
    EXPECT_TRUE(from.receive_reply(6)) << "the connection goes on";
    return reply->error();
  }

  std::optional<support::ServerProcess> server_;
};

TEST_F(HostileParts, APartBeforeHelloEndsTheConnection) {
  RawConnection raw(server_->tcp_address());
  send_part(raw, 5, "x");
  EXPECT_TRUE(raw.ends());
  EXPECT_EQ(raw.goodbye(), v1::Error::UNAUTHENTICATED);
}

TEST_F(HostileParts, GarbageInPartsIsAnErrorOfTheRequestAlone) {
  const auto raw = opened();
  send_part(*raw, 5, std::string(part_bytes, '\xff'));
  send_part(*raw, 5, std::string(part_bytes, '\xff'), true);
  const auto reply = raw->receive();
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->request_id(), 5U);
  EXPECT_EQ(reply->error().code(), v1::Error::INVALID_ARGUMENT);
}

TEST_F(HostileParts, APongInPartsLeavesTheServerUp) {
  const auto raw = opened();
  v1::ClientMessage pong;
  pong.set_request_id(5);
  pong.mutable_pong()->set_nonce(42);
  send_part(*raw, 5, pong.SerializeAsString(), true);
  v1::ClientMessage list;
  list.set_request_id(6);
  list.mutable_list_worlds();
  EXPECT_TRUE(raw->send(list));
  EXPECT_TRUE(raw->receive_reply(6));
  EXPECT_TRUE(server_->is_running());
}

TEST_F(HostileParts, OnePastTheLimitIsRefused) {
  const auto error = fill(*opened(), base::parts_bytes_max + 1);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->code(), v1::Error::LIMIT_EXCEEDED);
}

TEST_F(HostileParts, TheirRoomIsBoundedAndFreeAgainWhenTheyGo) {
  const std::size_t before = peak_bytes();
  std::vector<std::unique_ptr<RawConnection>> holders;
  // All are one client's, and one client has half of the room.
  for (std::size_t held = 0; held < base::Limits().parts_waiting_bytes_max / 2; held += base::parts_bytes_max) {
    holders.push_back(opened());
    EXPECT_FALSE(fill(*holders.back(), base::parts_bytes_max));
  }
  const auto late = opened();
  const auto refused = fill(*late, 1);
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->code(), v1::Error::UNAVAILABLE);
  EXPECT_GT(refused->retry_after_s(), 0.0);
  // The room, the one that grows a second time, and what each connection read of it. A sanitizer's allocator keeps
  // more.
  if (!support::is_sanitized) {
    EXPECT_LT(peak_bytes(), before + 2 * base::Limits().parts_waiting_bytes_max);
  }

  holders.clear();
  const auto next = opened();  // the server has seen the others' end by the time that it has room
  std::optional<v1::Error> error;
  std::uint64_t request_id = 10;
  do {
    send_part(*next, ++request_id, "\x08");  // a field's tag and no value
    send_part(*next, request_id, "\x08", true);
    const auto reply = next->receive_reply(request_id);
    ASSERT_TRUE(reply);
    error = reply->error();
    std::this_thread::sleep_for(std::chrono::milliseconds(100));  // what the rate gives back meanwhile is enough
  } while (error->code() == v1::Error::UNAVAILABLE);
  EXPECT_EQ(error->code(), v1::Error::INVALID_ARGUMENT) << error->what();
}

TEST_F(HostileParts, ASenderThatGoesInTheMiddleLeavesNothingBehind) {
  for (int i = 0; i < 40; ++i) {  // more than twice the room there is
    const auto raw = opened();
    EXPECT_FALSE(fill(*raw, base::parts_bytes_max / 2)) << i;
  }
}

}  // namespace
}  // namespace pneuma
