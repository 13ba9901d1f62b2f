#include "numerics/report/part.h"

namespace pneuma::report {
namespace {

void run(Context& context) {
  context.page.heading("Error against run time");
}

}  // namespace

Part work_precision() {
  return {.name = "work-precision", .title = "Error against run time", .quick_s = 10.0, .full_s = 60.0, .run = run};
}

}  // namespace pneuma::report
