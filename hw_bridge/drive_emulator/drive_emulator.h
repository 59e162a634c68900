// DriveEmulator: a chain of EtherCAT drives on the motors of the simulated robot.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "components/framework/component_type.h"
#include "components/robot/robot_model.h"
#include "hw_bridge/drive_emulator/drive_emulator.pb.h"
#include "hw_bridge/ethercat/emulator/emulated_chain.h"
#include "hw_bridge/ethercat/links/faulty_link.h"
#include "hw_bridge/ethercat/links/memory_link.h"
#include "hw_bridge/ethercat/links/socket_link.h"

namespace poise {

/// Stage "sense": drive_feedback (of the simulated robot) → sensor_feedback, the same for the
/// sensors that are no drives; the drives then show its counts. Stage "act": bridge_command says
/// that all frames of the cycle are sent; what the drives made of them → drive_command. Frames are
/// answered whenever they come.
class DriveEmulator final : public Component, private Device {
 public:
  /// Resources "robot", "urdf"; configuration DriveEmulatorConfig.
  void Configure(const ComponentContext& context, Wiring* wiring) override;
  void Open() override;
  void Idle() override;
  /// Serves until the master has led the chain to INIT or has fallen silent.
  std::string Close() override;
  std::vector<Device*> devices() override { return {this}; }

  ethercat::EmulatedChain& chain() { return *chain_; }

 private:
  /// A motor shaft of the simulated robot.
  class Shaft final : public ethercat::MotorLoad {
   public:
    Shaft(const robot::MotorModel& motor, bool reversed, int64_t zero_counts)
        : motor_(motor), sign_(reversed ? -1 : 1), zero_(zero_counts) {}
    /// Counts at the motor shaft, zero at the joint's zero, `seconds` after the last.
    void SetCounts(int64_t counts, double seconds);
    /// A, as the robot's sensors show it, positive as the joint is.
    void SetMeasuredCurrent(double current) {
      measured_ = sign_ * motor_.torque_constant * current;
    }
    /// A, that gives the drive's torque, positive as the joint is.
    double current() const { return sign_ * torque_ / motor_.torque_constant; }

    void SetTorque(double torque) override { torque_ = torque; }
    double position() const override { return position_; }
    double velocity() const override { return velocity_; }
    double MeasuredTorque(double given) const override { return measured_.value_or(given); }

   private:
    robot::MotorModel motor_;
    int sign_;
    int64_t zero_;
    double torque_ = 0, position_ = 0, velocity_ = 0;
    std::optional<double> measured_;  // N·m; none before the robot is there
    bool known_ = false;
  };
  struct Trouble {
    DriveTrouble config;
    size_t slave = 0;
    bool active = false;
  };

  int fd() const override { return socket_ ? socket_->fd() : -1; }
  void Serve() override;

  void Sense(const Tick& tick);
  void Act(const Tick& tick);
  void StartSimulatedTime();
  void Apply(Trouble* trouble, bool active);
  /// ns of the drives' time. In simulated time, which waits for a process that the scheduler has
  /// left out, it does not run away from a silent master before the first tick either.
  int64_t Now();
  void Answer(int64_t now);
  /// Serves, after a frame or at the deadline (the socket's clock).
  void Await(int64_t deadline);

  Input<drive_feedback_t> drive_feedback_;
  Input<drive_command_t> bridge_command_;
  Output<drive_feedback_t> sensor_feedback_;
  Output<drive_command_t> drive_command_;

  DriveEmulatorConfig config_;
  std::unique_ptr<ethercat::SocketLink> socket_;
  std::vector<std::unique_ptr<Shaft>> shafts_;  // by place in the chain
  std::vector<size_t> joint_;                   // of each place
  std::unique_ptr<ethercat::EmulatedChain> chain_;
  std::unique_ptr<ethercat::MemoryLink> memory_;
  std::unique_ptr<ethercat::FaultyLink> faulty_;
  std::vector<Trouble> troubles_;
  std::array<uint8_t, ethercat::kMaxFrame> frame_{};

  int64_t period_ = 0;  // ns
  double period_seconds_ = 0;
  int64_t clock_offset_ = 0;     // ns, the drives' time less the socket's clock
  int64_t last_frame_ = 0;       // ns, drives' time
  bool ticking_ = false;         // time follows the ticks
  int64_t first_tick_time_ = 0;  // ns, of tick 0
  int64_t tick_time_ = 0;        // ns, while ticking
};

ComponentType DriveEmulatorType();

}  // namespace poise
