#include "hw_bridge/unitree/dds_link.h"

#include <algorithm>

namespace poise::unitree {
namespace {

constexpr int64_t kRepeat = 250'000'000;  // ns, until a request is sent again

}  // namespace

DdsRobotLink::DdsRobotLink(const DdsLink& link)
    : participant_(link),
      commands_(participant_, kCommandTopic),
      states_(participant_, kStateTopic, kMostStates),
      torso_imu_(participant_, kTorsoImuTopic),
      requests_(participant_, kSwitcherRequestTopic, kSwitcherDepth),
      responses_(participant_, kSwitcherResponseTopic, kSwitcherDepth),
      last_id_(NowNanoseconds()) {}

DdsRobotLink::~DdsRobotLink() {
  dds_sample_free(&response_, kDescriptor<Response>, DDS_FREE_CONTENTS);
}

bool DdsRobotLink::Receive(LowState* state, int64_t deadline) {
  while (!states_.Take(state)) {
    if (!states_.Await(deadline)) return false;
  }
  return true;
}

std::optional<std::string> DdsRobotLink::Call(int64_t api, int64_t deadline) {
  const int64_t first = last_id_ + 1;
  std::string parameter = "{}";
  while (NowNanoseconds() < deadline) {
    Request request{};
    request.header.identity.id = ++last_id_;
    request.header.identity.api_id = api;
    request.parameter = parameter.data();
    requests_.Write(request);
    const int64_t again = std::min(deadline, NowNanoseconds() + kRepeat);
    while (NowNanoseconds() < again) {
      if (!responses_.Await(again)) continue;
      if (!responses_.Take(&response_)) continue;
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

std::optional<std::string> DdsRobotLink::ActiveMode(int64_t deadline) {
  const std::optional<std::string> answer = Call(kCheckMode, deadline);
  return answer ? ModeOf(*answer) : std::nullopt;
}

}  // namespace poise::unitree
