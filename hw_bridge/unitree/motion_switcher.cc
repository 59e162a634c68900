#include "hw_bridge/unitree/motion_switcher.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

namespace poise::unitree {
namespace {

constexpr int32_t kDepth = 16;            // requests and answers under way
constexpr int64_t kRepeat = 250'000'000;  // ns, until a request is sent again
constexpr int32_t kUnknownApi = 3203;     // as the makers' servers answer

}  // namespace

std::optional<std::string> ModeOf(std::string_view answer) {
  const auto json = nlohmann::json::parse(answer, nullptr, false);
  if (!json.is_object()) return std::nullopt;
  const auto name = json.find("name");
  if (name == json.end() || !name->is_string()) return std::nullopt;
  return name->get<std::string>();
}

MotionSwitcherClient::MotionSwitcherClient(const Participant& participant)
    : writer_(participant, kSwitcherRequestTopic, kDepth),
      reader_(participant, kSwitcherResponseTopic, kDepth),
      last_id_(MonotonicNow()) {}

MotionSwitcherClient::~MotionSwitcherClient() {
  dds_sample_free(&response_, &DescriptorOf<Response>(), DDS_FREE_CONTENTS);
}

std::optional<std::string> MotionSwitcherClient::Call(int64_t api, int64_t deadline) {
  const int64_t first = last_id_ + 1;
  std::string parameter = "{}";
  while (MonotonicNow() < deadline) {
    Request request{};
    request.header.identity.id = ++last_id_;
    request.header.identity.api_id = api;
    request.parameter = parameter.data();
    writer_.Write(request);
    const int64_t again = std::min(deadline, MonotonicNow() + kRepeat);
    while (MonotonicNow() < again) {
      if (!reader_.Await(again)) continue;
      if (!reader_.Take(&response_)) continue;
      const auto& header = response_.header;
      const bool ours = header.identity.id >= first && header.identity.id <= last_id_ &&
                        header.identity.api_id == api;
      if (ours && header.status.code == 0) {
        return response_.data != nullptr ? std::string(response_.data) : std::string();
      }
    }
  }
  return std::nullopt;
}

std::optional<std::string> MotionSwitcherClient::ActiveMode(int64_t deadline) {
  const std::optional<std::string> answer = Call(kCheckMode, deadline);
  return answer ? ModeOf(*answer) : std::nullopt;
}

bool MotionSwitcherClient::Release(int64_t deadline) {
  return Call(kReleaseMode, deadline).has_value();
}

MotionSwitcherServer::MotionSwitcherServer(const Participant& participant, std::string mode)
    : reader_(participant, kSwitcherRequestTopic, kDepth),
      writer_(participant, kSwitcherResponseTopic, kDepth),
      mode_(std::move(mode)) {}

MotionSwitcherServer::~MotionSwitcherServer() {
  dds_sample_free(&request_, &DescriptorOf<Request>(), DDS_FREE_CONTENTS);
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
