// The configuration file of pneuma-server.
#pragma once

#include <istream>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace pneuma {

/// TOML or INI as CLI11 reads it, its keys the long flags of `app`, which must outlive this. What CLI11 would take for
/// something else (a quote that is not closed) or not explain (a key that is no flag, a section) is an error that says
/// which line.
class ConfigFile : public CLI::ConfigTOML {
 public:
  explicit ConfigFile(const CLI::App& app) : app_(app) {}
  std::vector<CLI::ConfigItem> from_config(std::istream& input) const override;

 private:
  void check(const std::string& text) const;

  const CLI::App& app_;
};

}  // namespace pneuma
