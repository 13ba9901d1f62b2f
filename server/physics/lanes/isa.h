// The instruction sets that the lane kernels are compiled for. Which one runs changes the time, never a bit.
#pragma once

#include <array>
#include <string_view>

#include "base/status.h"

namespace pneuma::physics {

enum class Isa { baseline, v3, v4 };  // levels of the x86-64 psABI; elsewhere there is the baseline alone
inline constexpr std::array<std::string_view, 3> isa_names{"baseline", "v3", "v4"};

/// Whether this processor, its system and this build have it.
[[nodiscard]] bool has_isa(Isa isa);
/// Whether this processor takes the square roots and quotients of 16 floats in little more time than those of 8.
[[nodiscard]] bool has_fast_wide_roots();

/// What worlds are created with from now on: the best that there is, unless use_isa said otherwise.
[[nodiscard]] Isa isa_in_use();
/// By name; refuses one that is unknown or that the processor lacks. Called once, before the first world is created.
[[nodiscard]] base::Status use_isa(std::string_view name);

}  // namespace pneuma::physics
