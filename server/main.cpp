// pneuma-server: flags, wiring, signals.
#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <initializer_list>
#include <latch>
#include <memory>
#include <string>
#include <utility>

#include <CLI/CLI.hpp>
#include <pthread.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include "app/config.h"
#include "app/descriptors.h"
#include "app/free_memory.h"
#include "app/health_probe.h"
#include "app/log.h"
#include "app/service.h"
#include "app/web_folder.h"
#include "app/world_host.h"
#include "base/address.h"
#include "base/page_link.h"
#include "base/version.h"
#include "config_file.h"
#include "physics/lanes/isa.h"
#include "token_command.h"
#include "usage/usage.h"

namespace {

using pneuma::app::Config;

struct Options {
  Config config;
  std::string isa;
  std::string log_level = "info";
  std::string log_format = "text";
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
    app.add_option(flag, value, what)
        ->capture_default_str()
        ->check(number_between(1.0, 1e9))
        ->each([&limits](const std::string&) { limits.limits_loopback = true; })
        ->group("Limits");
  };
  amount("--message-bytes-max", limits.message_bytes_max, "Largest message taken of a client");
  amount("--connections-max", limits.connections_max, "Connections in all");
  amount("--connections-per-address-max", limits.connections_per_address_max, "Connections of one address");
  amount("--worlds-max", limits.worlds_max, "Worlds in all; one client may make all but a fourth");
  rate("--commands-per-s", limits.commands_per_s,
       "Commands a second of one client; those on this machine count where this flag or the next is given");
  rate("--commands-burst", limits.commands_burst, "Commands of one client at once");
  amount("--output-queue-bytes-max", limits.output_queue_bytes_max, "Unsent bytes past which frames are dropped");
  amount("--queued-bytes-max", limits.queued_bytes_max, "Unsent bytes of all clients together");
  amount("--received-bytes-max", limits.received_bytes_max, "Bytes of messages that come, of all clients together");
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

/// Bytes, also as "512 MiB". 0: the server's own choice.
void add_memory(CLI::App& app, Config::Memory& memory) {
  const auto amount = [&app](const char* flag, std::size_t& value, const char* what, const char* otherwise) {
    app.add_option(flag, value, what)->transform(CLI::AsSizeValue(false))->default_str(otherwise)->group("Limits");
  };
  amount("--memory-bytes-max", memory.bytes_max, "Memory of the server; half of it is for worlds",
         "that of the machine or its control group");
  amount("--client-memory-bytes-max", memory.client_bytes_max, "Of the worlds that one client made",
         "half of all worlds'");
  amount("--world-memory-bytes-max", memory.world_bytes_max, "Of one world", "a quarter of all worlds'");
}

/// Without a limit where a flag is not given.
void add_step_time(CLI::App& app, Config::StepTime& step_time) {
  const auto processors = [&app](const char* flag, double& value, const char* what) {
    app.add_option(flag, value, what)->check(number_between(1e-3, 1e3))->default_str("no limit")->group("Limits");
  };
  processors("--world-processors-max", step_time.world_processors,
             "Processor seconds a second that one world may take");
  processors("--client-processors-max", step_time.client_processors, "The same of all worlds that one client made");
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
  app.add_option("--allow-host", config.allow_hosts,
                 "A name by which the HTTP address is asked, beside its addresses and localhost; * for any")
      ->take_all();
  app.add_option("--scene", config.scenes, "A built-in scene or a scene file; a world each")->take_all();
  app.add_option("--data-dir", config.data_dir, "Keep worlds here over restarts");
  app.add_option("--recover", config.recover,
                 "A kept world that is damaged comes back up to the damage; its files are kept aside")
      ->take_all();
  app.add_option("--threads", config.threads, "Stepping threads; 0: as many as the hardware has")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  app.add_option("--isa", options.isa, "Instruction set, baseline, v3 or v4; worlds do not depend on it")
      ->default_str("the best there is")
      ->check(CLI::IsMember({"baseline", "v3", "v4"}));
  app.add_option("--tokens", config.tokens,
                 "File of the tokens that clients may say, each with a role; pneuma-server token new makes them");
  app.add_option("--token-file", config.token_file,
                 "The token on its first line may do everything; otherwise PNEUMA_TOKEN's value");
  app.add_flag("--insecure", config.insecure, "Serve others than this machine without asking for a token");
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
  using pneuma::persist::Sync;
  app.add_option_function<std::string>(
         "--sync",
         [&config](const std::string& name) {
           config.sync = name == "request" ? Sync::every_record : name == "second" ? Sync::each_second : Sync::none;
         },
         "What a crash of the machine may lose of what was answered: request, nothing; second, about the last second; "
         "os, what the system had not written yet")
      ->check(CLI::IsMember({"os", "request", "second"}))
      ->default_str("os");
  app.add_option("--log-level", options.log_level, "Least level that is logged")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "off"}))
      ->capture_default_str();
  app.add_option("--log-format", options.log_format, "How lines are logged: text, or json, an object a line")
      ->check(CLI::IsMember({"text", "json"}))
      ->capture_default_str();
  app.add_flag("--health", options.health, "Ask the server at --http whether it is well, and exit");
  add_limits(app, config.limits);
  add_memory(app, config.memory);
  add_step_time(app, config.step_time);
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

sigset_t signals(std::initializer_list<int> numbers) {
  sigset_t set;
  sigemptyset(&set);
  for (const int number : numbers) sigaddset(&set, number);
  return set;
}

/// Returns when the server is asked to end. No other signal ends it.
void await_end(pneuma::app::Service& service, const sigset_t& awaited, const std::string& log_level) {
  constexpr timespec second{1, 0};
  for (;;) {
    const int signal = sigtimedwait(&awaited, nullptr, &second);
    service.tend();
    if (signal < 0) {
      pneuma::app::give_back_free_memory();
    } else if (signal == SIGHUP) {
      spdlog::info("signal={} reads its files again", signal);
      service.reload();
    } else if (signal == SIGTERM || signal == SIGINT) {
      spdlog::info("signal={} shutting down", signal);
      return;
    } else if (signal == SIGUSR1) {
      spdlog::info("signal={} log_level={}", signal, pneuma::app::toggle_debug_log(log_level));
    } else {
      spdlog::info("signal={} changes nothing", signal);
    }
  }
}

/// By a handler: the first process of a container has no default that ends it.
void end_at_once_when_asked_again() {
  for (const int number : {SIGTERM, SIGINT}) std::signal(number, [](int) { _exit(1); });
  const sigset_t ending = signals({SIGTERM, SIGINT});
  pthread_sigmask(SIG_UNBLOCK, &ending, nullptr);
}

pneuma::base::Status serve(Options options) {
  // Blocked before any thread starts, so that only sigtimedwait sees them.
  const sigset_t awaited = signals({SIGTERM, SIGINT, SIGHUP, SIGUSR1, SIGUSR2});
  pthread_sigmask(SIG_BLOCK, &awaited, nullptr);
  using pneuma::app::LogForm;
  pneuma::app::start_log(options.log_level, options.log_format == "json" ? LogForm::json : LogForm::text);

  Config& config = options.config;
  if (auto status = read_environment(config); !status.ok()) return status;
  pneuma::app::fit_to_memory(config);
  spdlog::info("descriptors={}", pneuma::app::raise_descriptor_limit());
  const bool has_page = !config.web_dir.empty() && config.web_dir != "off";
  const bool has_tls = !config.tls_certificate.empty();
  std::latch ready{1};  // the line that says so comes first
  pneuma::app::Service service(std::move(config), [&ready](const auto& its_config, auto& server, auto& metrics) {
    const auto tell = [&ready](const pneuma::app::WorldHost::Restored& worlds) {
      pneuma::app::flush_log();  // what was found of them comes before the line that says it is over
      ready.wait();
      std::printf("worlds up=%zu damaged=%zu\n", worlds.up, worlds.damaged);
      std::fflush(stdout);
    };
    return std::make_unique<pneuma::app::WorldHost>(its_config, server, metrics, tell);
  });
  const pneuma::base::Status started = service.start();
  if (started.ok()) {
    pneuma::app::flush_log();
    const std::string link = has_page ? pneuma::base::page_link(service.http_address(), has_tls) : "";
    std::puts(pneuma::base::ready_line(service.tcp_address(), service.http_address(), link).c_str());
    std::fflush(stdout);
  }
  ready.count_down();
  if (!started.ok()) return started;

  await_end(service, awaited, options.log_level);
  end_at_once_when_asked_again();
  return service.stop();
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Hosts worlds of soft bodies under pressure and streams them to clients.", "pneuma-server");
  Options options;
  if (auto folder = pneuma::app::web_folder_of_program(); !folder.empty()) options.config.web_dir = std::move(folder);
  add_flags(app, options);
  std::function<pneuma::base::Status()> token_command;
  pneuma::add_token_commands(app, token_command);
  pneuma::usage::add_generators(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ConfigError& error) {
    const auto file = app.get_config_ptr()->as<std::string>();
    std::fprintf(stderr, "pneuma-server: %s: %s\n", file.c_str(), error.what());
    return 2;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    std::fprintf(stderr, "pneuma-server: %s\n", pneuma::usage::usage_error(app, error).c_str());
    return 2;
  }
  // Behind a name there may be a proxy on this machine, from which everybody comes.
  if (!options.config.allow_hosts.empty()) options.config.limits.limits_loopback = true;
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);  // a file that may grow no more is a disk that is full
  if (token_command) {
    const pneuma::base::Status done = token_command();
    return done.ok() ? 0 : fail(done);
  }
  if (options.health) return check_health(options.config);
  if (!options.isa.empty()) {
    if (auto status = pneuma::physics::use_isa(options.isa); !status.ok()) return fail(status);
  }
  const pneuma::base::Status served = serve(std::move(options));
  // Nobody reads standard error: one more line would wait for ever, and so would the end of the log's thread.
  if (!pneuma::app::flush_log()) std::_Exit(served.ok() ? 0 : 1);
  return served.ok() ? 0 : fail(served);
}
