// Awaits whose errors come in a variable: most are a peer's doing and nothing to throw for.
#pragma once

#include <boost/asio/redirect_error.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/system/error_code.hpp>

namespace pneuma::net {

[[nodiscard]] inline auto into(boost::system::error_code& error) {
  return boost::asio::redirect_error(boost::asio::use_awaitable, error);
}

}  // namespace pneuma::net
