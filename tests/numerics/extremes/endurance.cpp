// Cases of long or heavy work: threads, half an hour, frames that take too long.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <stdexcept>

#include <malloc.h>
#include <spdlog/spdlog.h>

#include "app/hosted_world.h"
#include "numerics/extremes/cases.h"
#include "numerics/extremes/variants.h"
#include "scene_io/load.h"

namespace pneuma::extremes {
namespace {

using physics::Integrator;
using physics::Precision;
using physics::Scene;
using physics::World;

std::uint64_t hash_after(const Scene& scene, int ticks, std::size_t threads) {
  World world = make_world(scene);
  physics::Workers workers(threads);
  for (int tick = 0; tick < ticks; ++tick) world.step_tick(workers);
  return world.state_hash();
}

Result run_threads(bool quick) {
  std::vector<Variant> variants{{Integrator::midpoint, Precision::single_precision}};
  if (!quick) variants.push_back({Integrator::implicit_euler, Precision::double_precision});
  const int ticks = quick ? 40 : 90;
  int same = 0;
  for (const Variant& variant : variants) {
    const Scene scene = with(scene_of("19-threads.json"), variant);
    const std::uint64_t alone = hash_after(scene, ticks, 1);
    for (const std::size_t threads : {2U, 16U}) {
      if (hash_after(scene, ticks, threads) != alone) {
        return {false, name_of(variant).append(" differs on ").append(std::to_string(threads)).append(" threads")};
      }
      ++same;
    }
  }
  return {true, std::to_string(same).append(" runs on more threads have the hash of one thread")};
}

double energy_j(const World& world) {
  double sum = 0.0;
  for (std::size_t body = 0; body < world.soft_body_count(); ++body) {
    const physics::BodyMeasures sums = world.measure(body);
    sum += sums.kinetic_j + sums.elastic_j + sums.gas_j + sums.gravity_j;
  }
  return sum;
}

constexpr double energy_share_max = 0.2;
constexpr std::size_t heap_growth_max = 64 * 1024;

// The room turns and the balls lose what they hit with, so that their energy wavers about a mean.
Result run_half_an_hour(bool quick) {
  const int windows = quick ? 3 : 30;
  constexpr int window_ticks = 3'600;  // of a quarter as many, the means waver by a tenth
  World world = make_world(scene_of("20-half-an-hour.json"));
  physics::Workers workers(1);
  double first_j = 0.0;
  double furthest = 0.0;
  std::size_t heap = 0;
  for (int window = 0; window < windows; ++window) {
    double mean_j = 0.0;
    for (int tick = 0; tick < window_ticks; ++tick) {
      world.step_tick(workers);
      mean_j += energy_j(world) / window_ticks;
    }
    if (window == 0) {
      first_j = mean_j;
      heap = mallinfo2().uordblks;
    }
    furthest = std::max(furthest, std::abs(mean_j / first_j - 1.0));
    if (!std::isfinite(mean_j)) return {false, "the energy is not finite"};
  }
  const bool flat = mallinfo2().uordblks <= heap + heap_growth_max;
  const bool whole = world.take_frozen().empty();
  return {furthest < energy_share_max && flat && whole, std::string("energy ")
                                                            .append(brief(100.0 * furthest))
                                                            .append(" % off at most, heap ")
                                                            .append(flat ? "flat" : "grows")
                                                            .append(whole ? "" : ", a ball frozen")};
}

/// A world in a server's loop whose time is the case's own: a tick ends as long after its begin as `tick_cost` says.
class Loop {
 public:
  using TimePoint = app::HostedWorld::TimePoint;
  using Duration = TimePoint::duration;

  explicit Loop(app::LiveWorld live)
      : world_("w", std::move(live), true, nullptr, {[] { return 1U; }, [](std::uint32_t) {}, &metrics_}) {
    v1::ClientMessage subscribe;
    subscribe.mutable_subscribe()->set_world("w");
    ask(subscribe);
    v1::ClientMessage resume;
    resume.mutable_resume()->set_world("w");
    ask(resume);
  }

  struct Report {
    int ticks = 0;
    int slowed_events = 0;
  };

  Report run(Duration length, Duration tick_cost) {
    Report report;
    const TimePoint end = now_ + length;
    while (now_ < end) {
      world_.drain(now_, TimePoint::max(), outbox_);
      if (!world_.tick_due(now_)) {
        now_ = world_.next_due(now_).value();
        continue;
      }
      while (!world_.step([] { return false; })) {
      }
      world_.encode(outbox_);
      now_ += tick_cost;
      world_.end_tick(now_, outbox_);
      ++report.ticks;
      report.slowed_events += take_slowed_events();
    }
    return report;
  }

 private:
  void ask(const v1::ClientMessage& message) {
    const app::Request request{session_, std::make_shared<const v1::ClientMessage>(message)};
    if (world_.post(request) != app::Inbox::Post::taken) throw std::runtime_error("refused");
    world_.drain(now_, TimePoint::max(), outbox_);
  }
  int take_slowed_events() {
    int count = 0;
    for (const auto& item : outbox_.items) {
      v1::ServerMessage message;
      const auto* sent = std::get_if<app::Outbox::Send>(&item);
      if (sent != nullptr && message.ParseFromString(*sent->message)) {
        count += message.event().kind() == v1::Event::WORLD_SLOWED ? 1 : 0;
      }
    }
    outbox_ = {};
    return count;
  }

  app::Metrics metrics_;
  std::shared_ptr<app::Session> session_ = std::make_shared<app::Session>(1);
  app::Outbox outbox_;
  TimePoint now_{std::chrono::hours(1)};
  app::HostedWorld world_;
};

Result run_over_budget(bool) {
  auto scene = scene_io::load_scene(scene_path("21-over-budget.json"));
  if (!scene.ok()) throw std::runtime_error(scene.status().message());
  auto live = app::LiveWorld::create(*scene);
  if (!live.ok()) throw std::runtime_error(live.status().message());
  constexpr std::chrono::seconds length{30};
  constexpr int ticks_on_time = 30 * 60;
  constexpr int made_good_max = 7;  // what a stall of 0.1 s may leave, and the tick under way
  const Loop::Duration period = std::chrono::duration_cast<Loop::Duration>(std::chrono::duration<double>(1.0 / 60.0));

  Loop loop(std::move(*live));
  const auto level = spdlog::default_logger()->level();
  spdlog::default_logger()->set_level(spdlog::level::off);  // each slowed world is logged
  const Loop::Report slow = loop.run(length, 10 * period);
  const Loop::Report after = loop.run(length, period / 10);
  spdlog::default_logger()->set_level(level);

  const bool slows = std::abs(slow.ticks - ticks_on_time / 10) <= 1 && slow.slowed_events > 0;
  const bool recovers = std::abs(after.ticks - ticks_on_time) <= made_good_max && after.slowed_events == 0;
  return {slows && recovers, std::to_string(slow.ticks)
                                 .append(" ticks in 30 s, ")
                                 .append(std::to_string(slow.slowed_events))
                                 .append(" warnings; then ")
                                 .append(std::to_string(after.ticks))
                                 .append(" in 30 s")};
}

}  // namespace

std::vector<ExtremeCase> endurance_cases() {
  return {{.number = 19,
           .name = "1, 2 and 16 threads",
           .scene = "19-threads.json",
           .criterion = "the same hash",
           .run = run_threads,
           .bullet = nullptr},
          {.number = 20,
           .name = "30 minutes of five balls in a turning room",
           .scene = "20-half-an-hour.json",
           .criterion = "mean energy of each minute within 20 % of the first's; heap flat to 64 KiB",
           .alone = true,
           .run = run_half_an_hour,
           .bullet = nullptr},
          {.number = 21,
           .name = "frames ten times over budget",
           .scene = "21-over-budget.json",
           .criterion = "30 s give a tenth of their ticks, and no more than 0.1 s is made good after",
           .run = run_over_budget,
           .bullet = nullptr}};
}

}  // namespace pneuma::extremes
