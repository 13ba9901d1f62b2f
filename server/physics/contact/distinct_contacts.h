// Notes of contacts without those that say the same again.
#pragma once

#include "physics/contact/contact_note.h"

namespace pneuma::physics {

/// By vertex and other, each wall of the other once.
[[nodiscard]] ContactNotes distinct(ContactNotes notes);

}  // namespace pneuma::physics
