// What a server is told at its start; main.cpp fills it from flags and the configuration file.
#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "base/limits.h"

namespace pneuma::app {

struct Config {
  std::string listen = "127.0.0.1:7420";
  std::string http = "127.0.0.1:7421";  // or "off"
  std::string web_dir = "off";          // the folder of the page for browsers, or "off"
  std::vector<std::string> scenes;      // built-in names or files; a world each
  std::string data_dir;                 // empty: nothing is kept
  std::size_t threads = 0;              // 0: as many as the hardware has
  std::string token_file;               // clients must know the token on its first line
  std::string token;                    // or this one; both empty: no token is asked for
  std::string tls_certificate;
  std::string tls_key;
  std::chrono::duration<double> checkpoint_interval{10.0};
  base::Limits limits;
};

}  // namespace pneuma::app
