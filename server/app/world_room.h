// What a world may take of the machine.
#pragma once

#include "app/step_budget.h"
#include "app/world_memory.h"

namespace pneuma::app {

struct WorldRoom {
  WorldMemory memory = WorldMemory::unlimited();
  StepBudget time;
};

}  // namespace pneuma::app
