// Serves a recording over the network as if it were the world.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/status.h"
#include "pneuma_client/playback.h"
#include "replay/replayed_world.h"

namespace pneuma::replay {

/// Where the page lies that was built or installed with this program; "off": nowhere.
[[nodiscard]] std::string page_folder();

struct PlayerOptions {
  PlayOptions play;
  std::string listen = "127.0.0.1:0";
  std::string http = "127.0.0.1:0";      // for the page and /ws; or "off"
  std::string web_dir = page_folder();   // or "off"
  std::vector<std::string> allow_hosts;  // names by which it is asked over HTTP, beside its addresses
  std::string token;                     // that clients must know; empty: none is asked for
  bool insecure = false;                 // without a token, listens beyond this machine all the same
};

class Player {
 public:
  Player(client::Playback playback, PlayerOptions options);
  ~Player();
  Player(const Player&) = delete;
  Player& operator=(const Player&) = delete;

  /// Errors say what could not be had: a frame, an address.
  [[nodiscard]] base::Status start();
  [[nodiscard]] std::string tcp_address() const;
  [[nodiscard]] std::string http_address() const;

  struct Position {
    double at_s = 0.0;  // play time
    v1::WorldList::World world;
  };
  [[nodiscard]] Position position() const;
  /// Says goodbye to all, and lets the queues empty.
  void stop();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pneuma::replay
