// Memory that was freed, given back to the system: the C library keeps it for later otherwise.
#pragma once

namespace pneuma::app {

/// Does so where enough is free to be worth the time. Now and then.
void give_back_free_memory();

}  // namespace pneuma::app
