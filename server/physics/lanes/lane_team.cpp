#include "physics/lanes/lane_team.h"

#include <algorithm>

namespace pneuma::physics {

template <class Real>
LaneTeam<Real>::LaneTeam(const Rings& rings, std::size_t members) : rings_(&rings), members_(members) {
  const std::size_t blocks = block_count_of(rings);
  for (std::size_t i = 0; i < members; ++i) members_[i].blocks = {i * blocks / members, (i + 1) * blocks / members};
  for (std::size_t i = 0; i < members; ++i) {
    Member& member = members_[i];
    member.halo = find_halo(i);
    for (HaloForces& forces : member.halo_forces) {
      forces.force.resize(4 * member.halo.size());
      forces.gradient.resize(4 * member.halo.size());
    }
    for (auto& volumes : member.volumes_18_m3) volumes.resize(member.blocks.end - member.blocks.begin);
    for (Member& owner : members_) {
      const auto first = std::ranges::lower_bound(member.halo, owner.blocks.begin * block_packs * pack_slots);
      const auto last = std::ranges::lower_bound(member.halo, owner.blocks.end * block_packs * pack_slots);
      owner.sends.push_back({static_cast<std::size_t>(first - member.halo.begin()),
                             static_cast<std::size_t>(last - member.halo.begin())});
    }
  }
}

// With slot 0, which the volume is measured from.
template <class Real>
std::vector<std::uint32_t> LaneTeam<Real>::find_halo(std::size_t member) const {
  const BlockRun blocks = members_[member].blocks;
  const std::size_t packs_end = std::min(blocks.end * block_packs, rings_->packs.size());
  const std::size_t own_begin = blocks.begin * block_packs * pack_slots;
  const std::size_t own_end = packs_end * pack_slots;
  std::vector<std::uint32_t> halo;
  if (own_begin > 0) halo.push_back(0);
  for (std::size_t p = blocks.begin * block_packs; p < packs_end; ++p) {
    const RingPack& pack = rings_->packs[p];
    for (std::size_t entry = pack.first; entry < pack.first + pack.degree * pack_slots; ++entry) {
      const std::uint32_t slot = rings_->neighbours[entry] / 4;
      if (slot < own_begin || slot >= own_end) halo.push_back(slot);
    }
  }
  std::ranges::sort(halo);
  const auto repeated = std::ranges::unique(halo);
  halo.erase(repeated.begin(), repeated.end());
  if (!halo.empty()) halo.resize((halo.size() + pack_slots - 1) / pack_slots * pack_slots, halo.back());
  return halo;
}

template <class Real>
void LaneTeam<Real>::prepare_to_send(std::size_t member, bool gas) {
  constexpr std::size_t line = cache_line_bytes / sizeof(Real);
  const std::size_t next = (members_[member].round + 1) % 2;
  for (std::size_t i = 0; i < members_.size(); ++i) {
    HaloForces& forces = members_[i].halo_forces[next];
    const HaloRun run = members_[member].sends[i];
    for (std::size_t at = 4 * run.begin; at < 4 * run.end; at += line) {
      __builtin_prefetch(forces.force.data() + at, 1);
      if (gas) __builtin_prefetch(forces.gradient.data() + at, 1);
    }
  }
}

template <class Real>
void LaneTeam<Real>::send(std::size_t member, bool gas, const LaneScratch<Real>& scratch) {
  Member& sender = members_[member];
  const std::size_t next = (sender.round + 1) % 2;
  const auto copy_row = [](const LaneArray<Real>& from, std::size_t slot, LaneArray<Real>& to, std::size_t place) {
    std::copy_n(from.data() + 4 * slot, 4, to.data() + 4 * place);
  };
  for (std::size_t i = 0; i < members_.size(); ++i) {
    Member& receiver = members_[i];
    HaloForces& forces = receiver.halo_forces[next];
    for (std::size_t place = sender.sends[i].begin; place < sender.sends[i].end; ++place) {
      copy_row(scratch.force, receiver.halo[place], forces.force, place);
      if (gas) copy_row(scratch.gradient, receiver.halo[place], forces.gradient, place);
    }
  }
  for (std::size_t block = sender.blocks.begin; gas && block < sender.blocks.end; ++block) {
    sender.volumes_18_m3[next][block - sender.blocks.begin] = scratch.block_volumes[block].lanes[0];
  }
}

template <class Real>
double LaneTeam<Real>::volume_18_m3() const {
  double sum = 0.0;
  for (const Member& member : members_) {
    for (const Real volume_18_m3 : member.volumes_18_m3[parity(0)]) sum += static_cast<double>(volume_18_m3);
  }
  return sum;
}

template <class Real>
std::size_t LaneTeam<Real>::bytes() const {
  std::size_t bytes = 0;
  for (const Member& member : members_) {
    bytes += sizeof(Member) + member.halo.capacity() * sizeof(std::uint32_t) + member.scratch.bytes() +
             member.halo_scratch.bytes() + member.sends.capacity() * sizeof(HaloRun);
    for (const LaneArray<Real>& volumes : member.volumes_18_m3) bytes += volumes.capacity() * sizeof(Real);
    for (const HaloForces& forces : member.halo_forces) {
      bytes += (forces.force.capacity() + forces.gradient.capacity()) * sizeof(Real);
    }
  }
  return bytes;
}

template class LaneTeam<float>;
template class LaneTeam<double>;

}  // namespace pneuma::physics
