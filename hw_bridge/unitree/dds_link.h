// The robot on DDS.
#pragma once

#include "components/framework/clock.h"
#include "hw_bridge/unitree/dds.h"
#include "hw_bridge/unitree/motion_switcher.h"
#include "hw_bridge/unitree/robot_link.h"

namespace poise::unitree {

class DdsRobotLink final : public RobotLink {
 public:
  /// Throws UnitreeError.
  explicit DdsRobotLink(const DdsLink& link);
  ~DdsRobotLink() override;

  int64_t Now() const override { return NowNanoseconds(); }
  bool Send(const LowCmd& command) override { return commands_.Write(command); }
  bool Receive(LowState* state, int64_t deadline) override;
  bool ReceiveTorsoImu(ImuState* imu) override { return torso_imu_.Take(imu); }
  std::optional<std::string> ActiveMode(int64_t deadline) override;
  bool Release(int64_t deadline) override { return Call(kReleaseMode, deadline).has_value(); }

 private:
  /// Data of the motion switcher's answer with status 0, asked for until there is one: who is new
  /// to a domain is not heard at first.
  std::optional<std::string> Call(int64_t api, int64_t deadline);

  Participant participant_;
  Writer<LowCmd> commands_;
  Reader<LowState> states_;
  Reader<ImuState> torso_imu_;
  Writer<Request> requests_;
  Reader<Response> responses_;
  Response response_{};
  int64_t last_id_;
};

}  // namespace poise::unitree
