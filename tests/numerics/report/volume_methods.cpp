#include "numerics/report/part.h"

namespace pneuma::report {
namespace {

void run(Context& context) {
  context.page.heading("Volume methods");
}

}  // namespace

Part volume_methods() {
  return {.name = "volume-methods", .title = "Volume methods", .quick_s = 10.0, .full_s = 60.0, .run = run};
}

}  // namespace pneuma::report
