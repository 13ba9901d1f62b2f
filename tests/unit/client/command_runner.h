// Runs the `pneuma` command against a scripted server, and reads what it prints.
#pragma once

#include <string>
#include <vector>

#include <google/protobuf/struct.pb.h>

#include "support/program.h"
#include "unit/client/fake_server.h"

namespace pneuma::client {

support::Finished run(const FakeServer& server, std::vector<std::string> arguments, const std::string& input = {});

/// An object from a line of output; a failure of the test where it is none.
google::protobuf::Struct json(const std::string& line);

std::vector<std::string> lines(const std::string& text);

}  // namespace pneuma::client
