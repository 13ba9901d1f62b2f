// Shows that no vertex of any frame of any built-in scene decodes further from its true place than the bound; and that
// a client that joined in the middle decodes what the others do.
#include <string>

#include <gtest/gtest.h>

#include "codec/frame_codec.h"
#include "support/recording.h"

namespace pneuma {
namespace {

class BuiltInScene : public testing::TestWithParam<std::string> {};

TEST_P(BuiltInScene, EveryFrameIsWithinItsBound) {
  const support::Recording recording = support::record(support::world_of(GetParam()), 180);
  for (const double max_error_m : {1e-2, 1e-3, 1e-5}) {
    codec::FrameWriter writer(recording.orders, max_error_m);
    codec::FrameReader reader(recording.orders);
    codec::FrameReader late(recording.orders);
    for (std::size_t tick = 0; tick < recording.frames_m.size(); ++tick) {
      std::string payload;
      if (tick > 0) writer.begin_delta();
      for (std::size_t body = 0; body < recording.orders.size(); ++body) {
        const std::vector<double>& positions_m = recording.frames_m[tick][body];
        if (tick == 0) writer.place_body(body, positions_m);
        if (tick > 0) writer.move_body(body, positions_m);
      }
      if (tick == 0) writer.write_key(payload);
      if (tick > 0) writer.take_delta(payload);
      ASSERT_TRUE(reader.read(payload, tick == 0).ok());
      ASSERT_LE(support::furthest_m(recording, tick, reader, writer.grid_step_m()), max_error_m) << "tick " << tick;

      constexpr std::size_t join_tick = 77;
      if (tick < join_tick) continue;
      if (tick == join_tick) {
        payload.clear();
        writer.write_key(payload);
      }
      ASSERT_TRUE(late.read(payload, tick == join_tick).ok());
      ASSERT_LE(support::furthest_m(recording, tick, late, writer.grid_step_m()), max_error_m) << "tick " << tick;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Frames, BuiltInScene, testing::ValuesIn(scene_io::builtin_scene_names()),
                         [](const auto& info) {
                           std::string name = info.param;
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace pneuma
