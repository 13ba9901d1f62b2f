#include "net/listening.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include "base/address.h"

namespace pneuma::net {

namespace {

using boost::system::error_code;
using Tcp = asio::ip::tcp;

// What the kernel holds unsent of a connection: enough to keep the wire busy. What waits in our queue instead can still
// be dropped, and a slow reader's queue gets room again in small steps.
constexpr int unsent_bytes_max = 16 * 1024;

/// At least one.
base::Result<Tcp::resolver::results_type> resolve(asio::io_context& io, const std::string& address) {
  const auto parsed = base::parse_address(address);
  if (!parsed.ok()) return parsed.status();
  error_code error;
  auto found = Tcp::resolver(io).resolve(parsed->host, parsed->port,
                                         Tcp::resolver::passive | Tcp::resolver::numeric_service, error);
  if (error) return base::Status(base::StatusCode::unavailable, error.message(), address);
  return found;
}

base::Status check_file(const std::string& file, const char* what) {
  std::error_code error;
  if (std::filesystem::is_regular_file(file, error)) return {};
  return base::not_found(std::string("no such file, to read the ") + what + " from", file);
}

}  // namespace

base::Result<bool> reaches_this_machine_alone(const std::string& address) {
  asio::io_context io;
  const auto endpoints = resolve(io, address);
  if (!endpoints.ok()) return endpoints.status();
  return std::ranges::all_of(*endpoints, [](const auto& entry) { return entry.endpoint().address().is_loopback(); });
}

std::string to_text(const Tcp::endpoint& endpoint) {
  const std::string address = endpoint.address().to_string();
  return (endpoint.address().is_v6() ? "[" + address + "]" : address) + ":" + std::to_string(endpoint.port());
}

base::Result<Tcp::acceptor> listen_at(asio::io_context& io, const std::string& address) {
  const auto endpoints = resolve(io, address);
  if (!endpoints.ok()) return endpoints.status();
  const Tcp::endpoint endpoint = endpoints->begin()->endpoint();
  Tcp::acceptor acceptor(io);
  error_code error;
  acceptor.open(endpoint.protocol(), error);
  if (!error) acceptor.set_option(Tcp::acceptor::reuse_address(true), error);
  if (!error) acceptor.bind(endpoint, error);
  if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (error) return base::Status(base::StatusCode::unavailable, "cannot listen: " + error.message(), address);
  return acceptor;
}

base::Result<std::shared_ptr<asio::ssl::context>> load_tls(const Tls& tls) {
  if (auto status = check_file(tls.certificate_file, "certificate"); !status.ok()) return status;
  if (auto status = check_file(tls.key_file, "key"); !status.ok()) return status;
  auto context = std::make_shared<asio::ssl::context>(asio::ssl::context::tls_server);
  error_code error;
  context->set_options(asio::ssl::context::default_workarounds | asio::ssl::context::no_sslv2 |
                           asio::ssl::context::no_sslv3 | asio::ssl::context::no_tlsv1 | asio::ssl::context::no_tlsv1_1,
                       error);
  if (!error) context->use_certificate_chain_file(tls.certificate_file, error);
  if (error) return base::invalid("no certificate in PEM form: " + error.message(), tls.certificate_file);
  context->use_private_key_file(tls.key_file, asio::ssl::context::pem, error);
  if (error) return base::invalid("no key in PEM form that fits the certificate: " + error.message(), tls.key_file);
  return context;
}

// A client of IPv4 is the same over either kind of socket, and one of IPv6 commonly has 2^64 addresses to call from.
std::string counted_as(const asio::ip::address& address) {
  if (address.is_v4()) return address.to_string();
  const asio::ip::address_v6 v6 = address.to_v6();
  if (v6.is_v4_mapped()) return asio::ip::make_address_v4(asio::ip::v4_mapped, v6).to_string();
  auto bytes = v6.to_bytes();
  if (!v6.is_loopback()) std::fill(bytes.begin() + 8, bytes.end(), static_cast<unsigned char>(0));
  return asio::ip::address_v6(bytes).to_string();
}

void tune(Tcp::socket& socket) {
  error_code ignored;
  socket.set_option(Tcp::no_delay(true), ignored);
  ::setsockopt(socket.native_handle(), IPPROTO_TCP, TCP_NOTSENT_LOWAT, &unsent_bytes_max, sizeof unsent_bytes_max);
}

}  // namespace pneuma::net
