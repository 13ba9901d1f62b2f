#include "numerics/report/part.h"

namespace pneuma::report {
namespace {

void run(Context& context) {
  context.page.heading("Observed order");
}

}  // namespace

Part observed_order() {
  return {.name = "observed-order", .title = "Observed order", .quick_s = 10.0, .full_s = 60.0, .run = run};
}

}  // namespace pneuma::report
