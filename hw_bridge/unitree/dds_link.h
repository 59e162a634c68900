// The robot on DDS.
#pragma once

#include "hw_bridge/unitree/dds.h"
#include "hw_bridge/unitree/motion_switcher.h"
#include "hw_bridge/unitree/robot_link.h"

namespace poise::unitree {

class DdsRobotLink final : public RobotLink {
 public:
  /// Throws UnitreeError.
  explicit DdsRobotLink(const DdsLink& link);

  int64_t Now() const override { return MonotonicNow(); }
  bool Send(const LowCmd& command) override { return commands_.Write(command); }
  bool Receive(LowState* state, int64_t deadline) override;
  bool ReceiveTorsoImu(ImuState* imu) override { return torso_imu_.Take(imu); }
  std::optional<std::string> ActiveMode(int64_t deadline) override {
    return switcher_.ActiveMode(deadline);
  }
  bool Release(int64_t deadline) override { return switcher_.Release(deadline); }

 private:
  Participant participant_;
  Writer<LowCmd> commands_;
  Reader<LowState> states_;
  Reader<ImuState> torso_imu_;
  MotionSwitcherClient switcher_;
};

}  // namespace poise::unitree
