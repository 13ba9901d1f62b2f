#include "command/checks.h"

#include <string>

#include "command/arguments.h"
#include "command/commands.h"
#include "pneuma_client/client.h"

namespace pneuma::client {

CLI::Validator address_check() {
  return {[](const std::string& text) -> std::string {
            std::string host;
            std::string port;
            return split_address(text, host, port) ? "" : "not HOST:PORT: " + text;
          },
          "", "address"};
}

CLI::Validator seconds_check() {
  constexpr double seconds_max = 1e9;
  return {[](const std::string& text) -> std::string {
            const auto number = parse_numbers<1>(text);
            const bool good = number && (*number)[0] >= 0.0 && (*number)[0] <= seconds_max;
            return good ? "" : "must be a number of seconds from 0 to 1e9: " + text;
          },
          "", "seconds"};
}

CLI::Validator awaited_check() {
  return {[](const std::string& text) -> std::string {
            if (parse_awaited(text)) return "";
            std::string names;
            for (int i = 1; i < v1::Event::Kind_descriptor()->value_count(); ++i) {  // 0 is for unset
              names += (i == 1 ? "" : ", ") + v1::Event::Kind_descriptor()->value(i)->name();
            }
            return "no tick, and none of " + names + ": " + text;
          },
          "", "awaited"};
}

CLI::Validator positive_check() {
  return {[](const std::string& text) -> std::string {
            const auto number = parse_numbers<1>(text);
            return number && (*number)[0] > 0.0 ? "" : "must be a positive number: " + text;
          },
          "", "positive"};
}

// CLI11's own prints the largest double with all its digits.
CLI::Validator not_negative_check() {
  return {[](const std::string& text) -> std::string {
            const auto number = parse_numbers<1>(text);
            return number && (*number)[0] >= 0.0 ? "" : "must be a number that is not negative: " + text;
          },
          "", "not negative"};
}

template <std::size_t N>
CLI::Validator numbers_check() {
  return {[](const std::string& text) -> std::string {
            return parse_numbers<N>(text) ? "" : "not " + std::to_string(N) + " numbers with commas: " + text;
          },
          "", "numbers"};
}

template CLI::Validator numbers_check<3>();
template CLI::Validator numbers_check<6>();

}  // namespace pneuma::client
