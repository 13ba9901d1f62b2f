#include "unit/client/command_runner.h"

#include <sstream>

#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

namespace pneuma::client {

support::Finished run(const FakeServer& server, std::vector<std::string> arguments, const std::string& input) {
  arguments.insert(arguments.begin(), {"--server", server.address()});
  return support::run_program("pneuma", arguments, input);
}

google::protobuf::Struct json(const std::string& line) {
  google::protobuf::Struct object;
  EXPECT_TRUE(google::protobuf::util::JsonStringToMessage(line, &object).ok()) << line;
  return object;
}

std::vector<std::string> lines(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> all;
  for (std::string line; std::getline(in, line);) all.push_back(line);
  return all;
}

}  // namespace pneuma::client
