// A component under test with its neighbours faked, the robots standing, and a forward simulation
// that shares nothing with the controller: the equations of motion with the contacts' constraint,
// solved as one dense system.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "components/framework/component.h"
#include "components/framework/operator_acts.h"
#include "components/robot/dynamics.h"
#include "components/robot/robot_model.h"
#include "poise/robot_state_t.hpp"
#include "poise/support_plan_t.hpp"
#include "tests/robot/robot_test_support.h"

namespace poise {

using Contacts = std::array<bool, 2>;

inline constexpr int64_t kTickMicroseconds = 2000;
Tick TickAt(int64_t index);

/// A plan that holds the robot where it is at `data`.
support_plan_t HoldAt(const robot::RobotModel& model, const robot::RobotData& data,
                      const Contacts& in_contact);

/// What a run gives to its components.
class ControlContext {
 public:
  explicit ControlContext(robot::TestRobot robot) : ControlContext(robot::RobotPath(robot)) {}
  /// `robot_path`: a Robot file; its URDF lies beside it.
  explicit ControlContext(const std::string& robot_path);
  /// Configures `component`; throws what it throws.
  void Configure(Component* component, const std::string& config, Wiring* wiring);
  SharedObjects* shared() { return &shared_; }

 private:
  std::map<std::string, std::string> resources_;
  SharedObjects shared_;
};

/// One component and its ports by name.
template <class T>
class Harness {
 public:
  Harness(ControlContext* context, const std::string& config) {
    context->Configure(&component_, config, &wiring_);
  }
  template <class M>
  void Bind(const std::string& port, const M* message) {
    for (InputPort* input : wiring_.inputs()) {
      if (input->name() == port) input->Bind(message);
    }
  }
  /// All stages in order, as the inline runner does.
  void Run(const Tick& tick) {
    for (OutputPort* output : wiring_.outputs()) output->Stamp(1, tick.index, tick.utime);
    for (const Stage& stage : wiring_.stages()) stage.run(tick);
  }
  T& component() { return component_; }
  /// Its operator's input, address 0.
  ActInput& acts() {
    for (InputPort* input : wiring_.inputs()) {
      if (auto* const acts = dynamic_cast<ActInput*>(input); acts != nullptr) {
        acts->SetAddress(0);
        return *acts;
      }
    }
    throw std::logic_error("no operator's input");
  }
  void RunStage(size_t index, const Tick& tick) { wiring_.stages()[index].run(tick); }
  /// The component's state, as bytes.
  std::vector<uint8_t> Save() {
    StateArchive measure;
    EXPECT_TRUE(component_.Archive(&measure));
    std::vector<uint8_t> bytes(measure.size());
    StateArchive save = StateArchive::Saving(bytes);
    EXPECT_TRUE(component_.Archive(&save) && save.ok());
    return bytes;
  }
  void Restore(const std::vector<uint8_t>& bytes) {
    StateArchive restore = StateArchive::Restoring(bytes);
    EXPECT_TRUE(component_.Archive(&restore) && restore.ok());
    EXPECT_EQ(restore.size(), bytes.size());
  }
  /// The first output of this type.
  template <class M>
  const M& output() const {
    const auto& outputs = wiring_.outputs();
    const auto found = std::ranges::find_if(outputs, [](const OutputPort* output) {
      return output->type_name() == std::string_view(M::getTypeName());
    });
    return *static_cast<const M*>((*found)->message());
  }

 private:
  T component_;
  Wiring wiring_;
};

/// Knees bent, soles level and side by side on z = 0, COM above their middle, at rest.
robot::RobotState StandingState(const robot::RobotModel& model);
/// Around `state`: base and joints by up to `position` (m, rad), velocities by up to `velocity`
/// (m/s, rad/s).
robot::RobotState Disturbed(const robot::RobotState& state, double position, double velocity,
                            std::mt19937* random);

robot_state_t StateMessage(const robot::RobotModel& model, const robot::RobotState& state);

/// The robot of `robot`, with all its dynamics at a state and its contacts' rows in sole axes.
struct Dynamics {
  Dynamics(const robot::RobotModel& model, const robot::RobotState& state,
           const Contacts& in_contact);
  /// q̈ and contact wrenches (robot on environment, sole axes) that joint torques give, by
  /// [A J_cᵀ; J_c 0] [q̈; F] = [Sᵀ Γ − b − g; −J̇_c q̇].
  void Forward(const Eigen::VectorXd& torque, Eigen::VectorXd* acceleration,
               Eigen::VectorXd* wrench) const;

  robot::RobotData data;
  Eigen::MatrixXd contact_jacobian;
  Eigen::VectorXd contact_bias;
};

Eigen::VectorXd ToEigen(const std::vector<double>& values);

/// Configurations with the paper's gains and limits.
std::string TaskControllerText();
std::string MonitorConfig(bool balancing, double half_length = 0.13, double half_width = 0.07);
std::string RedistributorText(const std::string& extra = "");

}  // namespace poise
