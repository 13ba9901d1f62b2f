#include "app/metrics.h"

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

#include <prometheus/text_serializer.h>

namespace pneuma::app {

namespace {

// From a small world's tick to one that is far behind 60 Hz.
const prometheus::Histogram::BucketBoundaries seconds{5e-5, 1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3,
                                                      1e-2, 2e-2, 5e-2, 0.1,  0.2,  0.5,  1.0};

prometheus::Counter& counter(prometheus::Registry& registry, const char* name, const char* help) {
  return prometheus::BuildCounter().Name(name).Help(help).Register(registry).Add({});
}
prometheus::Gauge& gauge(prometheus::Registry& registry, const char* name, const char* help) {
  return prometheus::BuildGauge().Name(name).Help(help).Register(registry).Add({});
}
prometheus::Histogram& histogram(prometheus::Registry& registry, const char* name, const char* help) {
  return prometheus::BuildHistogram().Name(name).Help(help).Register(registry).Add({}, seconds);
}

}  // namespace

Metrics::Metrics()
    : commands_(prometheus::BuildCounter()
                    .Name("pneuma_commands_total")
                    .Help("Requests answered, by kind and result.")
                    .Register(registry_)),
      worlds(gauge(registry_, "pneuma_worlds", "Worlds hosted.")),
      worlds_damaged(gauge(registry_, "pneuma_worlds_damaged", "Worlds kept on the disk that cannot be brought back.")),
      worlds_restoring(gauge(registry_, "pneuma_worlds_restoring", "Worlds kept on the disk that are not up yet.")),
      ticks(counter(registry_, "pneuma_ticks_total", "Ticks done, all worlds.")),
      step_seconds(histogram(registry_, "pneuma_step_seconds", "Time to step one tick.")),
      encode_seconds(histogram(registry_, "pneuma_encode_seconds", "Time to encode one tick for all its qualities.")),
      slipped_seconds(counter(registry_, "pneuma_slipped_seconds_total", "Real time that worlds fell behind.")),
      held_back_seconds(counter(registry_, "pneuma_held_back_seconds_total",
                                "Time for which worlds waited since they had used up their processor time.")),
      sessions(gauge(registry_, "pneuma_sessions", "Connections open.")),
      queue_bytes(gauge(registry_, "pneuma_queue_bytes", "Bytes waiting to be sent, all sessions.")),
      frames_sent(counter(registry_, "pneuma_frames_sent_total", "Frames sent.")),
      frames_dropped(counter(registry_, "pneuma_frames_dropped_total", "Frames left out for slow readers.")),
      frame_bytes(counter(registry_, "pneuma_frame_bytes_total", "Bytes of the frames sent.")),
      frame_vertices(counter(registry_, "pneuma_frame_vertices_total", "Vertices that the frames sent show.")),
      queue_seconds(prometheus::BuildHistogram()
                        .Name("pneuma_frame_queue_seconds")
                        .Help("How long frames waited before they were sent.")
                        .Register(registry_)
                        .Add({}, prometheus::Histogram::BucketBoundaries(net::QueueAges::bounds_s.begin(),
                                                                         net::QueueAges::bounds_s.end()))),
      bytes_sent(counter(registry_, "pneuma_sent_bytes_total", "Bytes sent.")),
      bytes_received(counter(registry_, "pneuma_received_bytes_total", "Bytes received.")),
      disk_errors(counter(registry_, "pneuma_disk_errors_total", "Checkpoints and log records that failed.")),
      damaged_files(counter(registry_, "pneuma_damaged_files_total",
                            "Checkpoints and logs that were found damaged, and kept aside.")),
      log_lines_dropped(counter(registry_, "pneuma_log_lines_dropped_total",
                                "Lines of the server's log that repeated others, or that nobody read in time.")),
      connections_refused(counter(registry_, "pneuma_connections_refused_total",
                                  "Connections past a limit of connections, all told or of one address.")) {}

void Metrics::count_command(std::string_view kind, std::string_view result) {
  commands_.Add({{"kind", std::string(kind)}, {"result", std::string(result)}}).Increment();
}

void Metrics::count_session(const net::SessionStats& before, const net::SessionStats& now) {
  frames_sent.Increment(static_cast<double>(now.frames.frames_sent - before.frames.frames_sent));
  frames_dropped.Increment(static_cast<double>(now.frames.frames_dropped - before.frames.frames_dropped));
  frame_bytes.Increment(static_cast<double>(now.frames.bytes_sent - before.frames.bytes_sent));
  frame_vertices.Increment(static_cast<double>(now.frames.vertices_sent - before.frames.vertices_sent));
  std::vector<double> waited;
  for (std::size_t i = 0; i < now.queue_ages.counts.size(); ++i) {
    waited.push_back(static_cast<double>(now.queue_ages.counts[i] - before.queue_ages.counts[i]));
  }
  queue_seconds.ObserveMultiple(waited, now.queue_ages.sum_s - before.queue_ages.sum_s);
  bytes_sent.Increment(static_cast<double>(now.bytes_sent - before.bytes_sent));
  bytes_received.Increment(static_cast<double>(now.bytes_received - before.bytes_received));
}

std::string metrics_text(std::vector<prometheus::MetricFamily> families, const MayName& may_name) {
  for (prometheus::MetricFamily& family : families) {
    std::erase_if(family.metric, [&](const prometheus::ClientMetric& metric) {
      return std::ranges::any_of(metric.label, [&](const prometheus::ClientMetric::Label& label) {
        return label.name == "world" && !may_name(label.value);
      });
    });
  }
  return prometheus::TextSerializer().Serialize(families);
}

std::string Metrics::text(const MayName& may_name, std::vector<prometheus::MetricFamily> also) const {
  std::vector<prometheus::MetricFamily> families = registry_.Collect();
  std::ranges::move(also, std::back_inserter(families));
  return metrics_text(std::move(families), may_name);
}

}  // namespace pneuma::app
