#include "requests.h"

#include <cstdlib>
#include <cstring>
#include <string>

#include <google/protobuf/util/json_util.h>

#include "pneuma.h"
#include "pneuma_client/client.h"

namespace pneuma::c {

using base::Status;

base::Result<v1::ClientMessage> parse_request(const char* json) {
  if (json == nullptr) return base::invalid("is NULL", "request");
  v1::ClientMessage request;
  const auto read = google::protobuf::util::JsonStringToMessage(json, &request);
  if (!read.ok()) return base::invalid(std::string(read.message()), "request");
  if (request.request_case() == v1::ClientMessage::REQUEST_NOT_SET) {
    return base::invalid("asks for nothing; {\"get_stats\": {}} would ask for the world's numbers", "request");
  }
  return request;
}

Status tell_reply(v1::ServerMessage reply, char** text) {
  if (reply.has_error()) return client::to_status(reply.error());
  if (text == nullptr) return {};
  reply.clear_request_id();
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  std::string json;
  if (!google::protobuf::util::MessageToJsonString(reply, &json, options).ok()) {
    return {base::StatusCode::internal, "the reply has no JSON"};
  }
  *text = strdup(json.c_str());
  return *text == nullptr ? Status(base::StatusCode::unavailable, "no memory for the reply") : Status();
}

}  // namespace pneuma::c

extern "C" void pneuma_text_free(char* text) {
  std::free(text);  // NOLINT(cppcoreguidelines-no-malloc): strdup's
}
