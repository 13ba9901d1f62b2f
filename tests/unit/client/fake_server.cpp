#include "unit/client/fake_server.h"

#include <array>
#include <vector>

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include "codec/frame_codec.h"
#include "codec/topology_hash.h"

namespace pneuma::client {

namespace {

constexpr timeval patience{.tv_sec = 60, .tv_usec = 0};

const std::vector<std::uint32_t> tetrahedron{0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};

/// A writer of that one body.
class Writer {
 public:
  Writer() : writer_({std::make_shared<codec::MeshOrder>(codec::make_mesh_order(4, tetrahedron))}, 0.01) {}

  std::string key(std::int64_t offset) {
    writer_.place_body(0, positions_m(offset));
    std::string payload;
    writer_.write_key(payload);
    return payload;
  }
  std::string delta(std::int64_t offset, std::int64_t base_offset) {
    writer_.place_body(0, positions_m(base_offset));
    writer_.begin_delta();
    writer_.move_body(0, positions_m(offset));
    std::string payload;
    writer_.take_delta(payload);
    return payload;
  }

 private:
  [[nodiscard]] std::vector<double> positions_m(std::int64_t offset) const {
    std::vector<double> positions_m{0, 0, 0, 1000, 0, 0, 0, 1000, 0, 0, 0, 1000};
    for (double& value : positions_m) value = (value + static_cast<double>(offset)) * writer_.grid_step_m();
    return positions_m;
  }

  codec::FrameWriter writer_;
};

}  // namespace

bool FakeSession::read_exactly(char* bytes, std::size_t size) {
  while (size > 0) {
    const ssize_t count = recv(socket_, bytes, size, 0);
    if (count == 0) return false;
    if (count < 0) {
      if (errno != ECONNRESET) ADD_FAILURE() << "the client said nothing";
      return false;
    }
    bytes += count;
    size -= static_cast<std::size_t>(count);
  }
  return true;
}

std::optional<v1::ClientMessage> FakeSession::receive() {
  std::array<unsigned char, 4> prefix{};
  if (!read_exactly(reinterpret_cast<char*>(prefix.data()), prefix.size())) return std::nullopt;
  std::string bytes((std::size_t{prefix[0]} << 24) | (std::size_t{prefix[1]} << 16) | (std::size_t{prefix[2]} << 8) |
                        std::size_t{prefix[3]},
                    '\0');
  if (!read_exactly(bytes.data(), bytes.size())) return std::nullopt;
  v1::ClientMessage message;
  EXPECT_TRUE(message.ParseFromString(bytes));
  EXPECT_NE(message.request_id(), 0U);
  return message;
}

void FakeSession::send(const v1::ServerMessage& message) {
  send_bytes(framed(message.SerializeAsString()));
}

void FakeSession::send_bytes(const std::string& bytes) {
  for (std::size_t sent = 0; sent < bytes.size();) {
    const ssize_t count = ::send(socket_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (count <= 0) return;  // the client may go at any time
    sent += static_cast<std::size_t>(count);
  }
}

v1::Hello FakeSession::welcome(std::uint32_t message_bytes_max, std::uint32_t parts_bytes_max) {
  v1::Hello hello;
  reply([&](const v1::ClientMessage& request, v1::ServerMessage& message) {
    EXPECT_TRUE(request.has_hello());
    hello = request.hello();
    message.mutable_welcome()->set_protocol_version(1);
    message.mutable_welcome()->set_server_version("fake");
    message.mutable_welcome()->set_message_bytes_max(message_bytes_max);
    message.mutable_welcome()->set_parts_bytes_max(parts_bytes_max);
  });
  return hello;
}

bool FakeSession::reply(const std::function<void(const v1::ClientMessage&, v1::ServerMessage&)>& fill) {
  const auto request = receive();
  if (!request) return false;
  v1::ServerMessage message;
  message.set_request_id(request->request_id());
  fill(*request, message);
  send(message);
  return true;
}

void FakeSession::drain() {
  std::array<char, 4096> ignored{};
  while (recv(socket_, ignored.data(), ignored.size(), 0) > 0) {
  }
}

FakeServer::FakeServer(Script script) {
  listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in name{};
  name.sin_family = AF_INET;
  name.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(name);
  setsockopt(listener_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
  EXPECT_EQ(bind(listener_, reinterpret_cast<sockaddr*>(&name), size), 0);
  EXPECT_EQ(listen(listener_, 1), 0);
  EXPECT_EQ(getsockname(listener_, reinterpret_cast<sockaddr*>(&name), &size), 0);
  address_ = "127.0.0.1:" + std::to_string(ntohs(name.sin_port));
  thread_ = std::thread([this, script = std::move(script)] {
    const int socket = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (socket < 0) return;
    setsockopt(socket, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
    setsockopt(socket, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof(patience));
    FakeSession session(socket);
    script(session);
    close(socket);
  });
}

FakeServer::~FakeServer() {
  shutdown(listener_, SHUT_RDWR);  // wakes an accept that nobody came for
  thread_.join();
  close(listener_);
}

std::string framed(const std::string& message) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(static_cast<char>((message.size() >> shift) & 0xffU));
  return bytes + message;
}

v1::ServerMessage topology_message() {
  v1::ServerMessage message;
  v1::Topology& topology = *message.mutable_topology();
  topology.set_hash(codec::topology_hash(4, tetrahedron));
  topology.set_vertex_count(4);
  topology.mutable_indices()->Add(tetrahedron.begin(), tetrahedron.end());
  return message;
}

v1::ServerMessage layout_message(std::uint32_t stream_id, std::uint32_t layout_id) {
  v1::ServerMessage message;
  v1::Layout& layout = *message.mutable_layout();
  layout.set_stream_id(stream_id);
  layout.set_layout_id(layout_id);
  auto* body = layout.add_soft_bodies();
  body->set_name("ball");
  body->set_topology_hash(codec::topology_hash(4, tetrahedron));
  auto* solid = layout.add_solids();
  solid->set_name("floor");
  solid->mutable_shape()->mutable_plane();
  return message;
}

v1::ServerMessage key_frame(std::uint32_t stream_id, std::uint64_t tick, std::int64_t offset, std::uint32_t layout_id) {
  v1::ServerMessage message;
  v1::Frame& frame = *message.mutable_frame();
  frame.set_stream_id(stream_id);
  frame.set_layout_id(layout_id);
  frame.set_tick(tick);
  frame.set_time_s(static_cast<double>(tick) / 60.0);
  frame.set_payload(Writer().key(offset));
  auto* pose = frame.add_poses();
  pose->mutable_position()->set_y(-1.0);
  pose->mutable_orientation()->set_w(1.0);
  return message;
}

v1::ServerMessage delta_frame(std::uint32_t stream_id, std::uint64_t tick, std::uint64_t base_tick, std::int64_t offset,
                              std::int64_t base_offset) {
  v1::ServerMessage message = key_frame(stream_id, tick);
  v1::Frame& frame = *message.mutable_frame();
  frame.set_base_tick(base_tick);
  frame.clear_layout_id();
  frame.clear_time_s();
  frame.clear_poses();
  frame.set_payload(Writer().delta(offset, base_offset));
  return message;
}

void fill_subscribed(std::uint32_t stream_id, v1::ServerMessage& message) {
  v1::Subscribed& subscribed = *message.mutable_subscribed();
  subscribed.set_stream_id(stream_id);
  subscribed.set_world("w");
  subscribed.set_rate_hz(60.0);
  subscribed.set_grid_step_m(1e-3);
  subscribed.set_tick_s(1.0 / 60.0);
}

}  // namespace pneuma::client
