#include "formats/sampler.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

#include "base/limits.h"

namespace pneuma::client {

namespace {

// Of a period: frames' times are sums, and one that is meant to be at a sample's time may be a little beside it.
constexpr double rounding = 1e-6;
constexpr double rate_hz_min = 1.0 / 86'400.0;

std::string seconds_text(double time_s) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.3f s", time_s);
  return text.data();
}

}  // namespace

bool same_bodies(const std::vector<SoftBodyFrame>& a, const std::vector<SoftBodyFrame>& b) {
  return std::ranges::equal(a, b, [](const SoftBodyFrame& one, const SoftBodyFrame& other) {
    return one.name == other.name && one.topology->hash == other.topology->hash;
  });
}

base::Result<Sampler> Sampler::start(Playback& playback, const SampleRange& range) {
  const double duration_s = playback.index().duration_s();
  const double to_s = range.to_s.value_or(duration_s);
  Sampler sampler(playback, range);
  sampler.rate_hz_ = range.rate_hz > 0.0 ? range.rate_hz : playback.header().stream().rate_hz();
  const double slack_s = rounding / sampler.rate_hz_;
  if (range.from_s > duration_s + slack_s) {
    return base::invalid("the recording ends at " + seconds_text(duration_s), "--from");
  }
  if (sampler.rate_hz_ < rate_hz_min || sampler.rate_hz_ > base::rate_hz_max) {
    return base::invalid("must be from one frame a day to 1,000 a second", "--rate");
  }
  if (to_s < range.from_s) return base::invalid("is before the start", "--to");
  sampler.from_s_ = range.from_s;
  sampler.count_ =
      1 + static_cast<std::size_t>((std::min(to_s, duration_s) - range.from_s) * sampler.rate_hz_ + rounding);
  if (base::Status found = playback.seek(range.from_s); !found.ok()) return found;
  if (base::Status read = sampler.read_on(); !read.ok()) return read;
  if (!sampler.after_) return base::not_found("the recording holds no frame");
  sampler.before_ = std::move(*sampler.after_);
  if (base::Status read = sampler.read_on(); !read.ok()) return read;
  return sampler;
}

void Sampler::drop_other_bodies(RecordedFrame& frame) const {
  if (!body_.empty()) std::erase_if(frame.frame.bodies, [&](const SoftBodyFrame& body) { return body.name != body_; });
}

/// The next frame becomes `after_`.
base::Status Sampler::read_on() {
  after_.reset();
  while (!after_) {
    auto recorded = playback_->next();
    if (!recorded.ok()) return recorded.status();
    if (!*recorded) return {};
    if (auto* frame = std::get_if<RecordedFrame>(&**recorded)) after_ = std::move(*frame);
  }
  drop_other_bodies(*after_);
  return {};
}

base::Result<std::optional<Sample>> Sampler::next() {
  if (index_ == count_) return std::optional<Sample>();
  Sample sample;
  sample.index = index_;
  sample.at_s = from_s_ + static_cast<double>(index_) / rate_hz_;
  const double slack_s = rounding / rate_hz_;
  while (after_ && after_->at_s <= sample.at_s + slack_s) {
    before_ = std::move(*after_);
    if (base::Status read = read_on(); !read.ok()) return read;
  }
  if (index_ == 0) drop_other_bodies(before_);
  if (before_.frame.bodies.empty()) {
    return base::not_found(body_.empty() ? "no soft body is there at " + seconds_text(sample.at_s)
                                         : "no soft body of that name is there at " + seconds_text(sample.at_s),
                           body_);
  }
  ++index_;
  sample.bodies = before_.frame.bodies;
  const double share = after_ ? (sample.at_s - before_.at_s) / (after_->at_s - before_.at_s) : 0.0;
  if (share <= rounding || !same_bodies(before_.frame.bodies, after_->frame.bodies))
    return std::optional(std::move(sample));
  for (std::size_t body = 0; body < sample.bodies.size(); ++body) {
    std::vector<double>& positions_m = sample.bodies[body].positions_m;
    const std::vector<double>& after_m = after_->frame.bodies[body].positions_m;
    for (std::size_t i = 0; i < positions_m.size(); ++i) positions_m[i] = std::lerp(positions_m[i], after_m[i], share);
  }
  return std::optional(std::move(sample));
}

}  // namespace pneuma::client
