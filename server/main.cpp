// pneuma-server: flags, wiring, signals.
#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <utility>

#include <CLI/CLI.hpp>
#include <pthread.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include "app/config.h"
#include "app/health_probe.h"
#include "app/service.h"
#include "app/web_folder.h"
#include "app/world_host.h"
#include "base/address.h"
#include "base/version.h"
#include "config_file.h"
#include "physics/lanes/isa.h"

namespace {

using pneuma::app::Config;

struct Options {
  Config config;
  std::string isa;
  std::string log_level = "info";
  bool health = false;
};

/// CLI::Range prints a double with six decimals or all its digits, and lets NaN pass.
CLI::Validator number_between(double least, double most) {
  const auto check = [least, most](const std::string& text) -> std::string {
    double number = 0.0;
    if (CLI::detail::lexical_cast(text, number) && number >= least && number <= most) return {};
    std::array<char, 64> range{};
    std::snprintf(range.data(), range.size(), "' is no number from %.10g to %.10g", least, most);
    return "'" + text + range.data();
  };
  return {check, ""};
}

void add_limits(CLI::App& app, pneuma::base::Limits& limits) {
  const auto milliseconds = [&](const char* flag, std::chrono::milliseconds& value, const char* what) {
    constexpr long day_ms = 86'400'000;
    app.add_option_function<long>(
           flag, [&value](long ms) { value = std::chrono::milliseconds(ms); }, what)
        ->check(CLI::Range(1L, day_ms))
        ->default_str(std::to_string(value.count()))
        ->group("Limits");
  };
  const auto amount = [&](const char* flag, std::size_t& value, const char* what) {
    constexpr double message_size_max = 2'147'483'647.0;  // of protobuf
    app.add_option(flag, value, what)
        ->capture_default_str()
        ->check(number_between(1.0, message_size_max))
        ->group("Limits");
  };
  const auto rate = [&](const char* flag, double& value, const char* what) {
    app.add_option(flag, value, what)->capture_default_str()->check(number_between(1.0, 1e9))->group("Limits");
  };
  amount("--message-bytes-max", limits.message_bytes_max, "Largest message taken of a client");
  amount("--connections-max", limits.connections_max, "Connections in all");
  amount("--connections-per-address-max", limits.connections_per_address_max, "Connections of one address");
  amount("--worlds-max", limits.worlds_max, "Worlds in all");
  rate("--commands-per-s", limits.commands_per_s, "Commands a second of one client");
  rate("--commands-burst", limits.commands_burst, "Commands of one client at once");
  amount("--output-queue-bytes-max", limits.output_queue_bytes_max, "Unsent bytes past which frames are dropped");
  milliseconds("--hello-timeout-ms", limits.hello_timeout, "Time to say hello");
  milliseconds("--partial-message-timeout-ms", limits.partial_message_timeout, "Time to finish a message begun");
  milliseconds("--ping-interval-ms", limits.ping_interval, "Between pings; two unanswered close");
  milliseconds("--write-stall-timeout-ms", limits.write_stall_timeout, "Time for a client to read anything");
  milliseconds("--drain-timeout-ms", limits.drain_timeout, "At the end: time for the queues to empty");
}

std::string wrong_address(const std::string& text) {
  const auto parsed = pneuma::base::parse_address(text);
  return parsed.ok() ? std::string() : parsed.status().message();
}

std::string wrong_http_address(const std::string& text) {
  return text == "off" ? std::string() : wrong_address(text);
}

void add_flags(CLI::App& app, Options& options) {
  Config& config = options.config;
  // A flag given twice: the last one counts, so that a container's own can be overruled.
  app.option_defaults()->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
  app.set_version_flag("--version", "pneuma-server " + std::string(pneuma::base::version));
  app.set_config("--config", "", "Read flags from this file (TOML or INI)");
  app.allow_config_extras(CLI::config_extras_mode::error);
  app.config_formatter(std::make_shared<pneuma::ConfigFile>(app));
  app.add_option("--listen", config.listen, "HOST:PORT for the protocol; port 0 picks one")
      ->check(wrong_address, "")
      ->capture_default_str();
  app.add_option("--http", config.http, "HOST:PORT for the page, /ws, /healthz and /metrics, or off")
      ->check(wrong_http_address, "")
      ->capture_default_str();
  app.add_option("--web-dir", config.web_dir, "The page for browsers at the HTTP address, or off")
      ->default_str("../share/pneuma/web beside this program, if there is one");
  app.add_option("--scene", config.scenes, "A built-in scene or a scene file; a world each")->take_all();
  app.add_option("--data-dir", config.data_dir, "Keep worlds here over restarts");
  app.add_option("--threads", config.threads, "Stepping threads; 0: as many as the hardware has")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  app.add_option("--isa", options.isa, "Instruction set, baseline, v3 or v4; worlds do not depend on it")
      ->default_str("the best there is")
      ->check(CLI::IsMember({"baseline", "v3", "v4"}));
  app.add_option("--token-file", config.token_file,
                 "Clients must know the token on its first line; otherwise PNEUMA_TOKEN's value");
  CLI::Option* certificate = app.add_option("--tls-cert", config.tls_certificate, "PEM chain; with --tls-key");
  CLI::Option* key = app.add_option("--tls-key", config.tls_key, "PEM key; with --tls-cert");
  certificate->needs(key);
  key->needs(certificate);
  app.add_option_function<double>(
         "--checkpoint-interval-s",
         [&config](double seconds) { config.checkpoint_interval = std::chrono::duration<double>(seconds); },
         "Between two checkpoints of a world")
      ->check(number_between(1e-3, 1e6))
      ->default_str("10");
  app.add_option("--log-level", options.log_level, "Least level that is logged")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "off"}))
      ->capture_default_str();
  app.add_flag("--health", options.health, "Ask the server at --http whether it is well, and exit");
  add_limits(app, config.limits);
}

int fail(const pneuma::base::Status& status) {
  std::fprintf(stderr, "pneuma-server: %s\n", status.message().c_str());
  return 1;
}

/// A token in the environment does not show in the list of processes.
pneuma::base::Status read_environment(Config& config) {
  const char* token = std::getenv("PNEUMA_TOKEN");
  if (token == nullptr || !config.token_file.empty()) return {};
  config.token = token;
  // A secret that was meant to be there, and is not: no reason to let everyone in.
  return config.token.empty() ? pneuma::base::invalid("holds no token", "PNEUMA_TOKEN") : pneuma::base::Status();
}

int check_health(const Config& config) {
  if (config.http == "off") return fail(pneuma::base::invalid("--http is off: there is nothing to ask", "--health"));
  const auto status = pneuma::app::probe_health(config.http, !config.tls_certificate.empty());
  if (!status.ok()) return fail(status);
  std::puts("ok");
  return 0;
}

int serve(Config config) {
  // Blocked before any thread starts, so that only sigwait sees them.
  sigset_t ending;
  sigemptyset(&ending);
  sigaddset(&ending, SIGTERM);
  sigaddset(&ending, SIGINT);
  pthread_sigmask(SIG_BLOCK, &ending, nullptr);

  if (auto status = read_environment(config); !status.ok()) return fail(status);
  pneuma::app::Service service(std::move(config), [](const auto& its_config, auto& server, auto& metrics) {
    return std::make_unique<pneuma::app::WorldHost>(its_config, server, metrics);
  });
  if (auto status = service.start(); !status.ok()) return fail(status);
  std::printf("ready tcp=%s http=%s\n", service.tcp_address().c_str(), service.http_address().c_str());
  std::fflush(stdout);

  int signal = 0;
  sigwait(&ending, &signal);
  spdlog::info("signal={} shutting down", signal);
  service.stop();
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Hosts worlds of soft bodies under pressure and streams them to clients.", "pneuma-server");
  Options options;
  if (auto folder = pneuma::app::web_folder_of_program(); !folder.empty()) options.config.web_dir = std::move(folder);
  add_flags(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ConfigError& error) {
    const auto file = app.get_config_ptr()->as<std::string>();
    std::fprintf(stderr, "pneuma-server: %s: %s\n", file.c_str(), error.what());
    return 2;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    std::fprintf(stderr, "pneuma-server: %s\n", error.what());
    return 2;
  }
  spdlog::set_default_logger(spdlog::stderr_logger_mt("pneuma"));
  spdlog::set_level(spdlog::level::from_str(options.log_level));
  spdlog::set_pattern("%Y-%m-%dT%H:%M:%S.%e%z %l %v");
  std::signal(SIGPIPE, SIG_IGN);
  if (options.health) return check_health(options.config);
  if (!options.isa.empty()) {
    if (auto status = pneuma::physics::use_isa(options.isa); !status.ok()) return fail(status);
  }
  return serve(std::move(options.config));
}
