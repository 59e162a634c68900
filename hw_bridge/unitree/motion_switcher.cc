#include "hw_bridge/unitree/motion_switcher.h"

#include <nlohmann/json.hpp>
#include <utility>

namespace poise::unitree {
namespace {

constexpr int32_t kUnknownApi = 3203;  // as the makers' servers answer

}  // namespace

std::optional<std::string> ModeOf(std::string_view answer) {
  const auto json = nlohmann::json::parse(answer, nullptr, false);
  if (!json.is_object()) return std::nullopt;
  const auto name = json.find("name");
  if (name == json.end() || !name->is_string()) return std::nullopt;
  return name->get<std::string>();
}

MotionSwitcherServer::MotionSwitcherServer(const Participant& participant, std::string mode)
    : reader_(participant, kSwitcherRequestTopic, kSwitcherDepth),
      writer_(participant, kSwitcherResponseTopic, kSwitcherDepth),
      mode_(std::move(mode)) {}

MotionSwitcherServer::~MotionSwitcherServer() {
  dds_sample_free(&request_, kDescriptor<Request>, DDS_FREE_CONTENTS);
}

void MotionSwitcherServer::Serve() {
  while (reader_.Take(&request_)) {
    Response response{};
    response.header.identity = request_.header.identity;
    std::string data;
    switch (request_.header.identity.api_id) {
      case kReleaseMode:
        mode_.clear();
        break;
      case kCheckMode:
        data = nlohmann::json{{"form", "0"}, {"name", mode_}}.dump(
            -1, ' ', false, nlohmann::json::error_handler_t::replace);
        break;
      default:
        response.header.status.code = kUnknownApi;
    }
    response.data = data.data();
    writer_.Write(response);
  }
}

}  // namespace poise::unitree
