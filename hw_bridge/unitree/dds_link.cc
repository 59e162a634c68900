#include "hw_bridge/unitree/dds_link.h"

namespace poise::unitree {

DdsRobotLink::DdsRobotLink(const DdsLink& link)
    : participant_(link),
      commands_(participant_, kCommandTopic),
      states_(participant_, kStateTopic, kMostStates),
      torso_imu_(participant_, kTorsoImuTopic),
      switcher_(participant_) {}

bool DdsRobotLink::Receive(LowState* state, int64_t deadline) {
  while (!states_.Take(state)) {
    if (!states_.Await(deadline)) return false;
  }
  return true;
}

}  // namespace poise::unitree
