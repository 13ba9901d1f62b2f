// Where a step's time goes: a row a stage, in the order of the step.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <string_view>

namespace pneuma::physics {

enum class Stage {
  springs,
  bending,
  volume,
  pressure,
  wind,
  grabs,
  integrate,
  joints,
  bounds,
  broad_phase,
  soft_contact,
  solid_contact,
  rigid,
  move,
  sleep
};
inline constexpr std::size_t stage_count = 15;
inline constexpr std::array<std::string_view, stage_count> stage_names{
    "springs", "bending",     "volume",       "pressure",      "wind",  "grabs", "integrate", "joints",
    "bounds",  "broad_phase", "soft_contact", "solid_contact", "rigid", "move",  "sleep"};

struct StageRow {
  std::chrono::nanoseconds time{0};
  std::uint64_t calls = 0;
  std::uint64_t bytes = 0;  // held now, for this stage
};
using Profile = std::array<StageRow, stage_count>;

/// Adds the time from its birth to its death to a stage; does nothing where `profile` is null. Where another timer is
/// running, of the stage `within`, that one counts the rest alone.
class StageTimer {
 public:
  StageTimer(Profile* profile, Stage stage) : StageTimer(profile, stage, stage) {}
  StageTimer(Profile* profile, Stage stage, Stage within) {
    if (profile == nullptr) return;
    row_ = &(*profile)[static_cast<std::size_t>(stage)];
    if (within != stage) outer_ = &(*profile)[static_cast<std::size_t>(within)];
    start_ = std::chrono::steady_clock::now();
  }
  ~StageTimer() {
    if (row_ == nullptr) return;
    const auto time = std::chrono::steady_clock::now() - start_;
    row_->time += time;
    ++row_->calls;
    if (outer_ != nullptr) outer_->time -= time;
  }
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

 private:
  StageRow* row_ = nullptr;
  StageRow* outer_ = nullptr;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace pneuma::physics
