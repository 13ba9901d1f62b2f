// What the server counts, for /metrics. Any thread.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <prometheus/counter.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/metric_family.h>
#include <prometheus/registry.h>

#include "app/grant.h"
#include "net/server.h"

namespace pneuma::app {

class Metrics {
 private:
  prometheus::Registry registry_;  // first: the others live in it
  prometheus::Family<prometheus::Counter>& commands_;

 public:
  Metrics();

  prometheus::Gauge& worlds;
  prometheus::Gauge& worlds_damaged;
  prometheus::Gauge& worlds_restoring;
  prometheus::Counter& ticks;
  prometheus::Histogram& step_seconds;
  prometheus::Histogram& encode_seconds;
  prometheus::Counter& slipped_seconds;
  prometheus::Counter& held_back_seconds;
  prometheus::Gauge& sessions;
  prometheus::Gauge& queue_bytes;
  prometheus::Counter& frames_sent;
  prometheus::Counter& frames_dropped;
  prometheus::Counter& frame_bytes;
  prometheus::Counter& frame_vertices;
  prometheus::Histogram& queue_seconds;
  prometheus::Counter& bytes_sent;
  prometheus::Counter& bytes_received;
  prometheus::Counter& disk_errors;
  prometheus::Counter& damaged_files;
  prometheus::Counter& log_lines_dropped;
  prometheus::Counter& connections_refused;

  /// `kind` is a request's field name, `result` "ok" or an error code's name.
  void count_command(std::string_view kind, std::string_view result);
  /// Adds what a session did since `before` to the counters.
  void count_session(const net::SessionStats& before, const net::SessionStats& now);

  /// As metrics_text has it, with what else there is to tell now.
  [[nodiscard]] std::string text(const MayName& may_name, std::vector<prometheus::MetricFamily> also = {}) const;
};

/// Prometheus's text format. Of what has a label `world`, those that `may_name` takes.
[[nodiscard]] std::string metrics_text(std::vector<prometheus::MetricFamily> families, const MayName& may_name);

}  // namespace pneuma::app
