// Threads that step one body together. Each member has a run of the body's blocks, and copies of its halo, the slots of
// others that its own rings reach. It moves these itself, by the forces that their owners send it, so that a whole
// evaluation of the forces needs one meeting, and no member reads what another writes in between.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "physics/lanes/lane_bodies.h"
#include "physics/machine/spin_wait.h"

namespace pneuma::physics {

template <class Real>
class LaneTeam {
 public:
  /// 2 to block_count_of(rings) members. The rings must outlive it.
  LaneTeam(const Rings& rings, std::size_t members);

  [[nodiscard]] bool is_for(const Rings& rings, std::size_t members) const {
    return &rings == rings_ && members == members_.size();
  }
  [[nodiscard]] BlockRun blocks_of(std::size_t member) const { return members_[member].blocks; }
  /// The halo's slots, ascending; the last one repeated up to a multiple of pack_slots.
  [[nodiscard]] const std::vector<std::uint32_t>& halo_of(std::size_t member) const { return members_[member].halo; }
  /// x, y, z, 0 of each slot of the halo, and what belongs to its motion.
  [[nodiscard]] LaneScratch<Real>& halo_scratch(std::size_t member) { return members_[member].halo_scratch; }
  /// Of a member but the first, which has the caller's.
  [[nodiscard]] LaneScratch<Real>& scratch_of(std::size_t member) { return members_[member].scratch; }

  /// The forces at a halo's slots and, of a body with gas, 6 grad V.
  struct HaloForces {
    LaneArray<Real> force;
    LaneArray<Real> gradient;
  };

  /// Before the ring pass: asks for the cache lines that send() will write.
  void prepare_to_send(std::size_t member, bool gas);
  /// After it, and before the meeting: the forces and the blocks' sums that are the member's own.
  void send(std::size_t member, bool gas, const LaneScratch<Real>& scratch);
  /// What came to the member by the last meeting; it may change it.
  [[nodiscard]] HaloForces& received(std::size_t member) { return members_[member].halo_forces[parity(member)]; }
  /// In a meeting: 18 times the volume, by the blocks' sums in order.
  [[nodiscard]] double volume_18_m3() const;

  /// All members come here; the first one then runs `alone`, and all go on once it has.
  template <class Alone>
  void meet(std::size_t member, const Alone& alone) {
    const std::uint64_t round = ++members_[member].round;
    const auto wait_for = [round](const std::atomic<std::uint64_t>& other) {
      return comes_within(late_after, [&] { return other.load(std::memory_order_acquire) >= round; });
    };
    if (member != 0) {
      members_[member].arrived.store(round, std::memory_order_release);
      (void)wait_for(going_on_);
      return;
    }
    for (std::size_t i = 1; i < members_.size(); ++i) {
      if (!wait_for(members_[i].arrived) && round > first_round_of_call_) calls_apart_ = calls_apart_after_wait;
    }
    alone();
    going_on_.store(round, std::memory_order_release);
  }

  /// Before each call for a step: whether to share it. Not for some calls after the first member has waited long, for
  /// another's core has other work then. To the first meeting of a call they may come late: they may have slept.
  [[nodiscard]] bool should_share() {
    first_round_of_call_ = members_[0].round + 1;
    return calls_apart_ == 0 || --calls_apart_ == 0;
  }

  /// For the first member to set in a meeting, and all to read after it.
  PerLane<Real> pressure_sixth_pa;
  /// A member's own; the first one reads them in a meeting.
  [[nodiscard]] std::uint8_t& is_well(std::size_t member) { return members_[member].is_well; }
  [[nodiscard]] bool are_all_well() const {
    return std::ranges::all_of(members_, [](const Member& member) { return member.is_well != 0; });
  }

  [[nodiscard]] std::size_t bytes() const;

 private:
  // A meeting comes every 10 microseconds or so, a call takes a millisecond: a wait this long is of a thread that was
  // put off its core, and the calls that follow it make up for the next try.
  static constexpr std::chrono::microseconds late_after{300};
  static constexpr std::uint32_t calls_apart_after_wait = 32;

  // Of a member's halo, [begin, end) are some other member's slots.
  struct HaloRun {
    std::size_t begin = 0;
    std::size_t end = 0;
  };
  struct alignas(cache_line_bytes) Member {
    BlockRun blocks;
    std::vector<std::uint32_t> halo;
    std::vector<HaloRun> sends;  // to each member
    LaneScratch<Real> scratch;
    LaneScratch<Real> halo_scratch;
    // By turns: others write one while the member still reads the other.
    std::array<HaloForces, 2> halo_forces;
    std::array<LaneArray<Real>, 2> volumes_18_m3;  // one a block of its own, by turns too
    std::uint64_t round = 0;                       // the last meeting's number
    std::uint8_t is_well = 0;
    alignas(cache_line_bytes) std::atomic<std::uint64_t> arrived{0};
  };

  [[nodiscard]] std::size_t parity(std::size_t member) const { return members_[member].round % 2; }
  [[nodiscard]] std::vector<std::uint32_t> find_halo(std::size_t member) const;

  const Rings* rings_;
  std::vector<Member> members_;
  std::uint32_t calls_apart_ = 0;
  std::uint64_t first_round_of_call_ = 1;
  alignas(cache_line_bytes) std::atomic<std::uint64_t> going_on_{0};
};

}  // namespace pneuma::physics
