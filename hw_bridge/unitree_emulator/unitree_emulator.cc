#include "hw_bridge/unitree_emulator/unitree_emulator.h"

#include <algorithm>
#include <cmath>

#include "components/framework/clock.h"
#include "components/messages/robot_resource.h"
#include "hw_bridge/drive/units.h"
#include "poise/message_traits.hpp"

namespace poise {

std::string_view unitree_emulator_proto_schema();  // generated
namespace {

// The maker's controller that is active until the motion switcher releases it.
constexpr const char* kMakerMode = "ai";
constexpr int32_t kDepth = 64;  // commands under way: a process that was left out catches up

}  // namespace

struct UnitreeEmulator::Ends {
  explicit Ends(const UnitreeEmulatorConfig& config)
      : participant(config.link()),
        states(participant, unitree::kStateTopic),
        torso_imu(participant, unitree::kTorsoImuTopic),
        commands(participant, unitree::kCommandTopic, kDepth),
        switcher(participant, kMakerMode) {}

  unitree::Participant participant;
  unitree::Writer<unitree::LowState> states;
  unitree::Writer<unitree::ImuState> torso_imu;
  unitree::Reader<unitree::LowCmd> commands;
  unitree::MotionSwitcherServer switcher;
};

UnitreeEmulator::UnitreeEmulator() = default;
UnitreeEmulator::~UnitreeEmulator() = default;

void UnitreeEmulator::Configure(const ComponentContext& context, Wiring* wiring) {
  config_ = context.config<UnitreeEmulatorConfig>();
  const std::shared_ptr<const robot::RobotModel> model = LoadRobot(context);
  period_ = static_cast<uint32_t>(std::max(1LL, std::llround(context.tick_period * 1e3)));
  try {
    robot_ = std::make_unique<unitree::EmulatedRobot>(config_, *model, context.tick_period);
  } catch (const unitree::UnitreeError& error) {
    throw ConfigError(error.what());
  }
  robot_->SetMakerActive(true);
  const MessageCounts counts = JointAndFootCounts(*model);
  MessageTraits<drive_feedback_t>::Resize(last_feedback_, counts);
  for (int j = 0; j < model->num_joints(); ++j) {
    const auto i = static_cast<size_t>(j);
    last_feedback_.position_counts[i] =
        EncoderCounts(model->motors()[i], model->stance().joint_position[j]);
  }
  last_feedback_.imu_orientation[0] = 1;
  wiring->AddInput(&drive_feedback_, "drive_feedback", counts);
  wiring->AddInput(&bridge_command_, "bridge_command", {model->num_joints()});
  wiring->AddOutput(&sensor_feedback_, "sensor_feedback", counts);
  wiring->AddOutput(&drive_command_, "drive_command", {model->num_joints()});
  wiring->AddStage("sense", {&drive_feedback_}, {&sensor_feedback_},
                   [this](const Tick& tick) { Sense(tick); });
  wiring->AddStage("act", {&bridge_command_}, {&drive_command_},
                   [this](const Tick& tick) { Act(tick); });
}

void UnitreeEmulator::Open() { ends_ = std::make_unique<Ends>(config_); }

void UnitreeEmulator::Publish() {
  time_ += period_;
  const unitree::LowState* state =
      robot_->State(last_feedback_, time_, config_.simulated_time() ? cycle_ : 0);
  state_sent_ = state != nullptr;
  if (!ends_ || !state_sent_) return;
  ends_->torso_imu.Write(robot_->torso_imu());  // first: who has the state takes it
  ends_->states.Write(*state);
}

void UnitreeEmulator::TakeCommands() {
  if (!ends_) return;
  ends_->switcher.Serve();
  robot_->SetMakerActive(!ends_->switcher.mode().empty());
  while (ends_->commands.Take(&command_)) robot_->Take(command_);
}

/// Before the first tick and after the last the robot stays where it is, and answers whoever asks.
void UnitreeEmulator::Idle() {
  if (!ends_) return;
  TakeCommands();
  robot_->Act(&*drive_command_);
  if (cycle_ > 0) ++cycle_;
  Publish();
}

std::string UnitreeEmulator::Close() {
  ends_.reset();
  return {};
}

void UnitreeEmulator::Sense(const Tick& tick) {
  robot_->SetTime(tick.time);
  if (!drive_feedback_.present()) {
    sensor_feedback_.Withhold();
    return;
  }
  // Before the first tick the robot stood as its file says, not as the scenario has it begin.
  if (cycle_ == 0) robot_->Place();
  last_feedback_ = *drive_feedback_;
  cycle_ = static_cast<uint32_t>(tick.index + 1);
  Publish();
  *sensor_feedback_ = last_feedback_;
}

void UnitreeEmulator::Act(const Tick&) {
  // In simulated time the command that answers this tick's state is on its way.
  if (ends_ && config_.simulated_time() && state_sent_) {
    const int64_t deadline = NowNanoseconds() + int64_t{config_.command_wait()} * 1'000'000;
    while (ends_->commands.Await(deadline)) {
      if (!ends_->commands.Take(&command_)) continue;
      if (command_.reserve[0] < cycle_) continue;  // of an earlier one
      robot_->Take(command_);
      break;
    }
  }
  TakeCommands();
  robot_->Act(&*drive_command_);
}

ComponentType UnitreeEmulatorType() {
  return {"unitree_emulator",
          "a Unitree robot's side of DDS on the simulated robot's motors, with faults",
          [] { return std::make_unique<UnitreeEmulator>(); },
          {.drive_links = {{.group = "unitree_emulator",
                            .drives = true,
                            .simulated_time = "unitree_emulator.simulated_time",
                            .tag = "unitree_emulator.link.tag"}}},
          {Reads<drive_feedback_t>("drive_feedback"), Reads<drive_command_t>("bridge_command"),
           Writes<drive_feedback_t>("sensor_feedback"), Writes<drive_command_t>("drive_command")},
          UnitreeEmulatorConfig::descriptor(),
          unitree_emulator_proto_schema};
}

}  // namespace poise
