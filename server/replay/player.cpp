#include "replay/player.h"

#include <utility>

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include "app/service.h"
#include "app/web_folder.h"
#include "replay/replay_host.h"

namespace pneuma::replay {

namespace {

constexpr const char* log_name = "pneuma";

app::Config config_of(PlayerOptions options) {
  app::Config config;
  config.listen = std::move(options.listen);
  config.http = std::move(options.http);
  config.web_dir = std::move(options.web_dir);
  config.allow_hosts = std::move(options.allow_hosts);
  config.token = std::move(options.token);
  config.insecure = options.insecure;
  return config;
}

}  // namespace

std::string page_folder() {
  std::string folder = app::web_folder_of_program();
  return folder.empty() ? "off" : folder;
}

struct Player::Impl {
  Impl(client::Playback playback, PlayerOptions options)
      : service(config_of(options), [&](const app::Config&, net::Server& server, app::Metrics&) {
          auto made = std::make_unique<ReplayHost>(std::move(playback), options.play, server);
          host = made.get();
          return made;
        }) {}

  const ReplayHost* host = nullptr;  // the service's
  app::Service service;
};

Player::Player(client::Playback playback, PlayerOptions options)
    : impl_(std::make_unique<Impl>(std::move(playback), std::move(options))) {}

Player::~Player() = default;

base::Status Player::start() {
  // The sessions that come and go are no news to who plays a file; what goes wrong is.
  if (spdlog::get(log_name) == nullptr) spdlog::set_default_logger(spdlog::stderr_logger_mt(log_name));
  spdlog::set_level(spdlog::level::warn);
  return impl_->service.start();
}

std::string Player::tcp_address() const {
  return impl_->service.tcp_address();
}

std::string Player::http_address() const {
  return impl_->service.http_address();
}

Player::Position Player::position() const {
  return {impl_->host->world().play_time_s(), impl_->host->world().status().listing};
}

void Player::stop() {
  (void)impl_->service.stop();  // a recording is kept as it is
}

}  // namespace pneuma::replay
