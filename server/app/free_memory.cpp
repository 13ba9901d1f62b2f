#include "app/free_memory.h"

#include <cstddef>

#include <malloc.h>

namespace pneuma::app {

namespace {

// Less is soon used again.
constexpr std::size_t free_bytes_worth_giving_back = 8 * 1024 * 1024;

}  // namespace

void give_back_free_memory() {
  const struct mallinfo2 heap = mallinfo2();
  if (heap.fordblks >= free_bytes_worth_giving_back && heap.fordblks >= heap.uordblks / 4) malloc_trim(0);
}

}  // namespace pneuma::app
