#include "command/interrupt.h"

#include <csignal>

namespace pneuma::client {

namespace {

volatile std::sig_atomic_t came = 0;

extern "C" void note_interrupt(int) {
  came = 1;
}

}  // namespace

void catch_interrupts() {
  std::signal(SIGINT, note_interrupt);
  std::signal(SIGTERM, note_interrupt);
}

bool interrupted() {
  return came != 0;
}

}  // namespace pneuma::client
