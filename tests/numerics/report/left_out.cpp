#include "numerics/report/part.h"

namespace pneuma::report {
namespace {

void run(Context& context) {
  context.page.heading("What a scene leaves out");
}

}  // namespace

Part left_out() {
  return {.name = "left-out", .title = "What a scene leaves out", .quick_s = 10.0, .full_s = 60.0, .run = run};
}

}  // namespace pneuma::report
