// What a server is told at its start; main.cpp fills it from flags and the configuration file.
#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "app/step_budget.h"
#include "base/limits.h"
#include "persist/command_log.h"

namespace pneuma::app {

struct Config {
  std::string listen = "127.0.0.1:7420";
  std::string http = "127.0.0.1:7421";   // or "off"
  std::string web_dir = "off";           // the folder of the page for browsers, or "off"
  std::vector<std::string> allow_hosts;  // names by which the server is asked over HTTP, beside its addresses
  std::vector<std::string> scenes;       // built-in names or files; a world each
  std::string data_dir;                  // empty: nothing is kept
  std::set<std::string> recover;         // worlds that come back up to the damage in their logs
  std::size_t threads = 0;               // 0: as many as the hardware has
  std::string tokens;                    // file of tokens, each with a role (token_file.h)
  std::string token_file;                // clients may know the token on its first line, and do everything then
  std::string token;                     // or this one; all three empty: no token is asked for
  bool insecure = false;                 // without a token, listens beyond this machine all the same
  std::string tls_certificate;
  std::string tls_key;
  std::chrono::duration<double> checkpoint_interval{10.0};
  persist::Sync sync = persist::Sync::none;
  base::Limits limits;

  /// Bytes of memory that worlds may take, by estimate.
  struct Memory {
    std::size_t bytes_max = 0;         // of the server in all; 0: what the machine or its control group has
    std::size_t worlds_bytes_max = 0;  // of all worlds
    std::size_t client_bytes_max = 0;  // of those that one client made; 0: half of all
    std::size_t world_bytes_max = 0;   // of one; 0: a quarter of all
  };
  Memory memory;

  /// Seconds of processor time a second that worlds may take.
  struct StepTime {
    double world_processors = TimeBudget::unlimited;   // one world
    double client_processors = TimeBudget::unlimited;  // all those that one client made
  };
  StepTime step_time;
};

/// Fills in what is left open of the memory's limits, and cuts those of messages to their share of it.
void fit_to_memory(Config& config);

}  // namespace pneuma::app
