#include "numerics/report/part.h"

namespace pneuma::report {
namespace {

void run(Context& context) {
  context.page.heading("Extreme cases");
}

}  // namespace

Part extreme_cases() {
  return {.name = "extreme-cases", .title = "Extreme cases", .quick_s = 10.0, .full_s = 60.0, .run = run};
}

}  // namespace pneuma::report
