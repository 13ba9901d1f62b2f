#include "physics/lanes/isa.h"

#if defined(__x86_64__)
#include <cpuid.h>
#endif

#include <algorithm>
#include <atomic>
#include <string>

namespace pneuma::physics {

namespace {

Isa best_isa() {
  for (const Isa isa : {Isa::v4, Isa::v3}) {
    if (has_isa(isa)) return isa;
  }
  return Isa::baseline;
}

std::atomic<Isa>& chosen() {
  static std::atomic<Isa> isa{best_isa()};
  return isa;
}

}  // namespace

bool has_isa(Isa isa) {
#if defined(__x86_64__)
  // GCC gives a bit, Clang a truth value.
  if (isa == Isa::v4) return __builtin_cpu_supports("x86-64-v4") != 0;
  if (isa == Isa::v3) return __builtin_cpu_supports("x86-64-v3") != 0;
#endif
  return isa == Isa::baseline;
}

// AMD's family 26 is Zen 5. Earlier families, and Intel's processors, work on the two halves of a register in turn.
bool has_fast_wide_roots() {
#if defined(__x86_64__)
  constexpr unsigned amd = 0x6874'7541;  // the first four letters of AuthenticAMD
  unsigned eax = 0;
  unsigned ebx = 0;
  unsigned ecx = 0;
  unsigned edx = 0;
  if (__get_cpuid(0, &eax, &ebx, &ecx, &edx) == 0 || ebx != amd) return false;
  if (__get_cpuid(1, &eax, &ebx, &ecx, &edx) == 0) return false;
  return ((eax >> 8U) & 0xfU) + ((eax >> 20U) & 0xffU) >= 26;
#else
  return false;
#endif
}

Isa isa_in_use() {
  return chosen().load();
}

base::Status use_isa(std::string_view name) {
  const auto found = std::ranges::find(isa_names, name);
  if (found == isa_names.end()) {
    return base::invalid(std::string("'").append(name).append("' is none of baseline, v3, v4"), "isa");
  }
  const auto isa = static_cast<Isa>(found - isa_names.begin());
  if (!has_isa(isa)) {
    return {base::StatusCode::failed_precondition, std::string("this processor lacks x86-64-").append(name), "isa"};
  }
  chosen().store(isa);
  return {};
}

}  // namespace pneuma::physics
