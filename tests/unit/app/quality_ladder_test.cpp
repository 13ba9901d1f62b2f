// Shows how a reader's quality follows what its connection takes, on a model of one: what is offered past its capacity
// waits up to a bound, and past that frames are dropped. Time is simulated.
#include "app/quality_ladder.h"

#include <algorithm>
#include <functional>
#include <vector>

#include <gtest/gtest.h>

namespace pneuma::app {
namespace {

using namespace std::chrono_literals;

constexpr double asked_bytes_s = 100'000.0;  // what the quality asked for takes
constexpr double frame_bytes = 1'000.0;
constexpr double queue_bytes_max = 4 * frame_bytes;
constexpr std::chrono::milliseconds report_interval{250};
constexpr net::TimePoint ladder_start{1000s};

/// A reader on a connection of the capacity, in bytes a second, that is told for each second.
class Simulation {
 public:
  explicit Simulation(std::function<double(double seconds)> capacity) : capacity_(std::move(capacity)) {}

  void run(std::chrono::seconds length) {
    for (const auto end = now_ + length; now_ < end; now_ += report_interval) {
      const double dt = std::chrono::duration<double>(report_interval).count();
      const double seconds = std::chrono::duration<double>(now_ - ladder_start).count();
      const double offered = asked_bytes_s * quality_rungs[ladder_.rung()].bytes_share * dt;
      const double taken = std::min(queued_ + offered, capacity_(seconds) * dt);
      queued_ += offered - taken;
      const double dropped = std::max(0.0, queued_ - queue_bytes_max);
      queued_ -= dropped;
      totals_.bytes_sent += static_cast<std::uint64_t>(taken);
      totals_.bytes_dropped += static_cast<std::uint64_t>(dropped);
      totals_.frames_dropped += static_cast<std::uint64_t>(dropped / frame_bytes + 0.999);
      const auto rung = ladder_.advise({now_, taken / dt, {1, totals_, {}}});
      if (!rung) continue;
      moves_.push_back(*rung);
      ladder_.moved(*rung);
      totals_ = {};
      queued_ = 0.0;
    }
  }

  [[nodiscard]] std::size_t rung() const { return ladder_.rung(); }
  [[nodiscard]] const std::vector<std::size_t>& moves() const { return moves_; }

 private:
  std::function<double(double)> capacity_;
  QualityLadder ladder_;
  net::TimePoint now_ = ladder_start;
  net::FrameTotals totals_;
  double queued_ = 0.0;
  std::vector<std::size_t> moves_;
};

TEST(QualityLadder, AReaderThatKeepsUpStays) {
  Simulation reader([](double) { return 1.1 * asked_bytes_s; });
  reader.run(600s);
  EXPECT_TRUE(reader.moves().empty());
}

TEST(QualityLadder, ASlowOneComesToWhatFitsAndTriesMoreEverMoreRarely) {
  for (const double share : {0.9, 0.7, 0.5, 0.25}) {
    Simulation reader([share](double) { return share * asked_bytes_s; });
    reader.run(3600s);
    ASSERT_FALSE(reader.moves().empty());
    EXPECT_LE(quality_rungs[reader.moves().front()].bytes_share, share) << "by what it takes, not step by step";
    const auto fits = std::ranges::find_if(quality_rungs, [&](const Rung& rung) { return rung.bytes_share <= share; });
    EXPECT_NEAR(static_cast<double>(reader.rung()), static_cast<double>(fits - quality_rungs.begin()), 1.0);
    // A try and its failure every calm_max once it has doubled: 37 of them in an hour, and a few at first.
    EXPECT_LE(reader.moves().size(), 2U * (3600 / 96 + 6));
  }
}

TEST(QualityLadder, OneThatTakesNothingGoesAllTheWayAtOnceAndStays) {
  Simulation reader([](double) { return 0.0; });
  reader.run(60s);
  EXPECT_EQ(reader.moves(), std::vector<std::size_t>{quality_rungs.size() - 1});
}

TEST(QualityLadder, OneThatRecoversComesBackToWhatItAskedFor) {
  Simulation reader([](double seconds) { return (seconds < 20.0 ? 0.15 : 2.0) * asked_bytes_s; });
  reader.run(20s);
  EXPECT_EQ(reader.rung(), quality_rungs.size() - 1);
  reader.run(40s);
  EXPECT_EQ(reader.rung(), 0U);
  EXPECT_EQ(reader.moves(), (std::vector<std::size_t>{4, 3, 2, 1, 0}));
}

TEST(QualityLadder, AFrameThatWaitsTooLongIsStrain) {
  QualityLadder ladder;
  net::ReaderReport report{ladder_start, asked_bytes_s, {}};
  EXPECT_EQ(ladder.advise(report), std::nullopt);
  report.at += 2s;
  report.stream.queue_age = QualityLadder::queue_age_max;
  EXPECT_EQ(ladder.advise(report), std::nullopt);
  report.at += 250ms;
  report.stream.queue_age += 1ms;
  EXPECT_EQ(ladder.advise(report), std::optional<std::size_t>(1));
}

TEST(QualityLadder, NothingHappensBeforeAMoveHasShown) {
  QualityLadder ladder;
  net::ReaderReport report{ladder_start, 0.0, {}};
  (void)ladder.advise(report);
  report.at += 999ms;
  report.stream.totals.frames_dropped = 5;
  EXPECT_EQ(ladder.advise(report), std::nullopt);
  report.at += 1ms;
  report.stream.totals.frames_dropped = 6;
  EXPECT_NE(ladder.advise(report), std::nullopt);
}

}  // namespace
}  // namespace pneuma::app
