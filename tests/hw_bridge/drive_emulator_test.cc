// Bridge and emulated drives over a real socket, tick by tick as the runner leads them.
#include "hw_bridge/drive_emulator/drive_emulator.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>

#include <atomic>
#include <cmath>
#include <fstream>
#include <mutex>
#include <sstream>
#include <thread>

#include "components/robot_files/robot_files.h"
#include "hw_bridge/hw_bridge.h"

namespace poise {
namespace {

using testing::HasSubstr;

constexpr int kJoints = 12;
constexpr int64_t kRun = 9;
constexpr double kPeriod = 0.002;

std::string ReadDeployed(const std::string& name) {
  std::ifstream file(std::string(POISE_SOURCE_DIR "/deploy/") + name);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

const robot::RobotModel& Model() {
  static const robot::RobotModel model = robot::LoadRobotFiles(
      std::string(POISE_SOURCE_DIR) + "/deploy/robots/dyros/dyros_legs.pbtxt");
  return model;
}

/// A component and its wiring.
template <class T>
struct Configured {
  void Configure(const std::string& config) {
    resources = {{"robot", ReadDeployed("robots/dyros/dyros_legs.pbtxt")},
                 {"urdf", ReadDeployed("robots/dyros/dyros_legs.urdf")}};
    ComponentContext context;
    context.name = "component";
    context.config_text = config;
    context.tick_period = kPeriod;
    context.resources = &resources;
    context.shared = &shared;
    component.Configure(context, &wiring);
  }
  void Bind(const std::string& name, const void* message) {
    for (InputPort* input : wiring.inputs()) {
      if (input->name() == name) input->Bind(message);
    }
  }
  template <class Message>
  const Message* Output(const std::string& name) const {
    for (OutputPort* output : wiring.outputs()) {
      if (output->name() == name) return static_cast<const Message*>(output->message());
    }
    return nullptr;
  }
  void Run(size_t stage, int64_t tick) {
    for (OutputPort* output : wiring.stages()[stage].outputs) {
      output->Stamp(kRun, tick, 2000 * tick);
    }
    wiring.stages()[stage].run({.index = tick,
                                .utime = 2000 * tick,
                                .time = kPeriod * static_cast<double>(tick),
                                .lateness = 0});
  }

  std::map<std::string, std::string> resources;
  SharedObjects shared;
  T component;
  Wiring wiring;
};

/// Both processes of an EtherCAT run: the emulator is served in a thread of its own.
class Pair {
 public:
  Pair(const std::string& bridge_config, const std::string& emulator_config,
       const std::string& wiring) {
    ethercat::UdpConfig any;
    any.set_port(0);
    const uint16_t port = ethercat::UdpLink(any, ethercat::SocketLink::Side::kSlaves).local_port();
    const std::string link = fmt::format("link {{ udp {{ port: {} }} }}", port);
    std::string drives = wiring;
    for (size_t at = 0; (at = drives.find("wiring", at)) != std::string::npos;) {
      drives.replace(at, 6, "drive");
    }
    // Before the first tick a watchdog counts wall time, of which a busy machine takes what it
    // likes.
    bridge.Configure(
        fmt::format("ethercat {{ {} simulated_time: true master {{ drift_frames: 100 watchdog: "
                    "5000 profile {{ {} "
                    "}} {} }} }} {}",
                    link, ReadDeployed("drives/elmo_gold.pbtxt"), drives, bridge_config));
    emulator.Configure(fmt::format("{} simulated_time: true {} {}", link, emulator_config, wiring));
    emulator.component.Open();
    device_ = emulator.component.devices()[0];
    server_ = std::thread([this] { Serve(); });
    MessageTraits<drive_feedback_t>::Resize(feedback, MessageCounts{kJoints, 2});
    feedback.imu_acceleration[2] = 9.80665;
    MessageTraits<joint_command_t>::Resize(command, MessageCounts{kJoints, 2});
    command.run_id = kRun;
    // In the middle of every joint's range: 0.3 rad at the knees.
    for (const size_t knee : {3, 9}) feedback.position_counts[knee] = 19557;
  }
  ~Pair() {
    stop_ = true;
    server_.join();
  }

  void Tick() {
    feedback.tick = command.tick = tick_;
    if (follows) feedback.current = drives().current;
    command.utime = 2000 * tick_;
    emulator.Bind("drive_feedback", &feedback);
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      emulator.Run(0, tick_);
    }
    bridge.Bind("drive_feedback", emulator.Output<drive_feedback_t>("sensor_feedback"));
    bridge.Run(0, tick_);
    bridge.Bind("joint_command", &command);
    bridge.Run(1, tick_);
    emulator.Bind("bridge_command", bridge.Output<drive_command_t>("drive_command"));
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      emulator.Run(1, tick_);
    }
    ++tick_;
  }
  const drive_command_t& drives() { return *emulator.Output<drive_command_t>("drive_command"); }
  const bridge_status_t& status() { return *bridge.Output<bridge_status_t>("bridge_status"); }
  const robot_sensors_t& sensors() { return *bridge.Output<robot_sensors_t>("robot_sensors"); }

  Configured<HwBridge> bridge;
  Configured<DriveEmulator> emulator;
  drive_feedback_t feedback;
  joint_command_t command;
  bool follows = true;  // the motors' currents, the drives of the tick before

 private:
  void Serve() {
    while (!stop_) {
      pollfd descriptor{device_->fd(), POLLIN, 0};
      poll(&descriptor, 1, 1);
      const std::lock_guard<std::mutex> lock(mutex_);
      device_->Serve();
    }
  }

  Device* device_ = nullptr;
  std::mutex mutex_;
  std::atomic<bool> stop_ = false;
  std::thread server_;
  int64_t tick_ = 0;
};

TEST(DriveEmulator, GivesInEachTickTheTorqueOfItsFrames) {
  // One drive turns the other way; its counter wraps around while its joint passes zero.
  std::string wiring;
  for (int j = kJoints - 1; j >= 0; --j) {
    wiring +=
        fmt::format("wiring {{ joint: \"{}\"{} }} ", Model().joints()[static_cast<size_t>(j)].name,
                    j == 2 ? " reversed: true zero_counts: 2147483648" : "");
  }
  Pair pair("enable_at_start: true", "", wiring);
  pair.bridge.component.Open();
  for (int i = 0; i < 30; ++i) {
    pair.bridge.component.Idle();
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  for (int tick = 0; tick < 100; ++tick) {
    pair.feedback.position_counts[2] = 40 * (50 - tick);
    for (size_t j = 0; j < kJoints; ++j) {
      pair.command.torque[j] = 10 * std::sin(0.1 * tick + static_cast<double>(j));
    }
    pair.Tick();
    ASSERT_EQ(pair.status().state, bridge_status_t::STATE_RUNNING) << tick;
    ASSERT_EQ(pair.status().drive_state[0], bridge_status_t::DRIVE_ENABLED);
    // Counts come through 32 bits, sign and zero; rad of 50 × 8192 counts a turn.
    ASSERT_NEAR(pair.sensors().joint_position[2], 40 * (50 - tick) * 2 * M_PI / (50 * 8192), 1e-12);
    // The drives tell no velocity: 40 counts a tick of 2 ms.
    const double velocity = tick > 0 ? -40 * 2 * M_PI / (50 * 8192) / 0.002 : 0;
    ASSERT_NEAR(pair.sensors().joint_velocity[2], velocity, 1e-9) << tick;
    for (size_t j = 0; j < kJoints; ++j) {
      // Per mille of 15 A; 5 N·m/A.
      ASSERT_EQ(pair.drives().enabled[j], 1);
      ASSERT_NEAR(pair.drives().current[j], 0.015 * std::round(pair.command.torque[j] / 0.075),
                  1e-9);
    }
  }
  EXPECT_EQ(pair.status().frames_lost, 0);
  EXPECT_EQ(pair.status().al_status, 8);
  // The way down takes real time again, in the other thread.
  std::string problem = "not closed";
  problem = [&] {
    pair.emulator.component.Idle();
    return pair.bridge.component.Close();
  }();
  EXPECT_EQ(problem, "");
  EXPECT_EQ(pair.emulator.component.chain().slave(0).al_state(), ethercat::AlState::kInit);
}

// A drive shows the current that the robot's sensors show, as late and as small as they do: what a
// simulation says of delay and lag holds behind the drives as well.
TEST(DriveEmulator, ShowsTheCurrentThatTheSensorsShow) {
  std::string wiring;
  for (size_t j = 0; j < kJoints; ++j) {
    wiring += fmt::format("wiring {{ joint: \"{}\"{} }} ", Model().joints()[j].name,
                          j == 4 ? " reversed: true" : "");
  }
  Pair pair("enable_at_start: true torque_error: 1000", "", wiring);
  pair.follows = false;
  pair.bridge.component.Open();
  for (int tick = 0; tick < 50; ++tick) {
    for (size_t j = 0; j < kJoints; ++j) {
      pair.command.torque[j] = 10 * std::sin(0.3 * tick + static_cast<double>(j));
      pair.feedback.current[j] = 0.02 * tick - 0.1 * static_cast<double>(j);
    }
    pair.Tick();
    ASSERT_EQ(pair.status().state, bridge_status_t::STATE_RUNNING) << tick;
    for (size_t j = 0; j < kJoints; ++j) {
      // 5 N·m/A; rounded to a per mille of 15 A.
      ASSERT_NEAR(pair.sensors().joint_torque[j], 5 * pair.feedback.current[j], 0.0376) << j;
    }
  }
  pair.emulator.component.Idle();
  EXPECT_EQ(pair.bridge.component.Close(), "");
}

struct TroubleCase {
  const char* trouble;
  int ticks;  // from the trouble's to the stop
  int8_t reason;
  const char* joint;  // whose drive the reason names; nullptr: none
};
class EmulatedTrouble : public testing::TestWithParam<TroubleCase> {};

TEST_P(EmulatedTrouble, ComesAtItsTimeAndStopsByItsReason) {
  Pair pair("enable_at_start: true", fmt::format("trouble {{ {} from: 0.05 }}", GetParam().trouble),
            "");
  pair.bridge.component.Open();
  int tick = 0;
  for (; tick < 100 && pair.status().state <= bridge_status_t::STATE_RUNNING; ++tick) pair.Tick();
  EXPECT_EQ(tick - 1, 25 + GetParam().ticks);
  EXPECT_EQ(pair.status().reason, GetParam().reason);
  const int joint = pair.status().reason_joint;
  if (GetParam().joint == nullptr) {
    EXPECT_EQ(joint, -1);
    return;
  }
  ASSERT_GE(joint, 0);
  EXPECT_EQ(Model().joints()[static_cast<size_t>(joint)].name, GetParam().joint);
  pair.Tick();
  EXPECT_EQ(pair.drives().enabled[static_cast<size_t>(joint)], 0);
}

using S = bridge_status_t;
INSTANTIATE_TEST_SUITE_P(
    Kinds, EmulatedTrouble,
    testing::Values(
        TroubleCase{"kind: STO joint: \"left_knee_pitch\"", 0, S::REASON_DRIVE_STO,
                    "left_knee_pitch"},
        TroubleCase{"kind: DRIVE_FAULT joint: \"right_ankle_roll\"", 0, S::REASON_DRIVE_FAULT,
                    "right_ankle_roll"},
        TroubleCase{"kind: SILENT_SLAVE joint: \"left_hip_yaw\"", 4, S::REASON_BUS_INPUTS, nullptr},
        TroubleCase{"kind: CUT_CABLE joint: \"left_hip_yaw\"", 4, S::REASON_BUS_INPUTS, nullptr},
        TroubleCase{"kind: FRAMES frames { lost_out: 1 }", 4, S::REASON_BUS_LINK, nullptr},
        TroubleCase{"kind: FRAMES frames { lost_back: 1 }", 4, S::REASON_BUS_LINK, nullptr}));

TEST(DriveEmulator, RefusesAConfigurationByField) {
  const auto field = [](const std::string& config) -> std::string {
    try {
      Configured<DriveEmulator> emulator;
      emulator.Configure(config);
    } catch (const ConfigError& error) {
      EXPECT_THAT(error.what(), HasSubstr("must"));
      return error.field();
    }
    return "";
  };
  EXPECT_EQ(field("link { udp {} }"), "");
  EXPECT_EQ(field(""), "link");
  EXPECT_EQ(field("link { udp { port: 70000 } }"), "link.udp.port");
  EXPECT_EQ(field("link { udp {} } wiring { joint: \"tail\" }"), "wiring[0].joint");
  EXPECT_EQ(field("link { udp {} } change { joint: \"tail\" }"), "change[0].joint");
  EXPECT_EQ(field("link { udp {} } trouble { kind: STO joint: \"tail\" }"), "trouble[0].joint");
  EXPECT_EQ(field("link { udp {} } trouble { frames { late: 2 } }"), "trouble[0].frames.late");
}

}  // namespace
}  // namespace poise
