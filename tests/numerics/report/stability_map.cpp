#include "numerics/report/part.h"

namespace pneuma::report {
namespace {

void run(Context& context) {
  context.page.heading("Stability map");
}

}  // namespace

Part stability_map() {
  return {.name = "stability-map", .title = "Stability map", .quick_s = 10.0, .full_s = 60.0, .run = run};
}

}  // namespace pneuma::report
