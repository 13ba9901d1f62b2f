// Shows that the members of a team have all of a body between them, that each sees what its rings reach, and that what
// one sends is at its place in the others' halos after a meeting.
#include "physics/lanes/lane_team.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "physics/machine/workers.h"
#include "physics/mesh/mesh_builders.h"

namespace pneuma::physics {
namespace {

Rings large_rings() {
  return make_rings(**make_icosphere(5, 0.5));
}

TEST(LaneTeam, GivesEachBlockToOneMember) {
  const Rings rings = large_rings();
  for (const std::size_t members : {2U, 3U, 11U}) {
    const LaneTeam<float> team(rings, members);
    std::size_t next = 0;
    for (std::size_t member = 0; member < members; ++member) {
      EXPECT_EQ(team.blocks_of(member).begin, next);
      EXPECT_GT(team.blocks_of(member).end, next);
      next = team.blocks_of(member).end;
    }
    EXPECT_EQ(next, block_count_of(rings));
  }
}

TEST(LaneTeam, HasInEachHaloWhatTheMembersRingsReachOfOthersAndTheFirstSlot) {
  const Rings rings = large_rings();
  const LaneTeam<float> team(rings, 3);
  for (std::size_t member = 0; member < 3; ++member) {
    const BlockRun blocks = team.blocks_of(member);
    const std::size_t packs_end = std::min(blocks.end * block_packs, rings.packs.size());
    const auto is_own = [&](std::size_t slot) {
      return slot >= blocks.begin * block_packs * pack_slots && slot < packs_end * pack_slots;
    };
    const std::vector<std::uint32_t>& halo = team.halo_of(member);
    EXPECT_TRUE(std::ranges::is_sorted(halo));
    EXPECT_TRUE(std::ranges::none_of(halo, is_own));
    EXPECT_TRUE(is_own(0) || halo.front() == 0);
    for (std::size_t p = blocks.begin * block_packs; p < packs_end; ++p) {
      for (std::size_t i = 0; i < rings.packs[p].degree * pack_slots; ++i) {
        const std::uint32_t slot = rings.neighbours[rings.packs[p].first + i] / 4;
        ASSERT_TRUE(is_own(slot) || std::ranges::binary_search(halo, slot)) << slot;
      }
    }
  }
}

TEST(LaneTeam, BringsForcesToTheHalosAndVolumesToTheMeeting) {
  constexpr std::size_t members = 3;
  constexpr int rounds = 5;
  const Rings rings = large_rings();
  LaneTeam<double> team(rings, members);
  Workers workers(members);
  int meetings = 0;
  std::vector<std::size_t> wrong(members, 0);
  workers.for_each(members, [&](std::size_t member) {
    LaneScratch<double> own;
    own.block_volumes.resize(block_count_of(rings));
    for (int round = 1; round <= rounds; ++round) {
      own.force.assign(4 * rings.slot_count(), 0.0);
      own.gradient.assign(4 * rings.slot_count(), 0.0);
      for (std::size_t slot = 0; slot < rings.slot_count(); ++slot) {
        own.force[4 * slot] = static_cast<double>(slot) + 0.1 * round;
        own.gradient[4 * slot + 2] = static_cast<double>(slot) - 0.1 * round;
      }
      for (auto& volume : own.block_volumes) volume.lanes[0] = round;
      team.prepare_to_send(member, true);
      team.send(member, true, own);
      team.meet(member, [&] {
        ++meetings;
        EXPECT_EQ(team.volume_18_m3(), static_cast<double>(block_count_of(rings)) * round);
      });
      const auto& received = team.received(member);
      for (std::size_t i = 0; i < team.halo_of(member).size(); ++i) {
        const std::size_t slot = team.halo_of(member)[i];
        if (received.force[4 * i] != own.force[4 * slot]) ++wrong[member];
        if (received.gradient[4 * i + 2] != own.gradient[4 * slot + 2]) ++wrong[member];
      }
    }
  });
  EXPECT_EQ(meetings, rounds);
  EXPECT_EQ(wrong, std::vector<std::size_t>(members, 0));
}

}  // namespace
}  // namespace pneuma::physics
