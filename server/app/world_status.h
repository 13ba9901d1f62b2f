// What others may know of a world without asking the thread that runs it.
#pragma once

#include <chrono>
#include <string>

#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

struct WorldStatus {
  v1::WorldList::World listing;
  std::chrono::steady_clock::time_point last_active;  // when a tick last ended, or the world began or went on
  std::string disk_trouble;                           // why the world cannot be kept; empty: it can
};

}  // namespace pneuma::app
