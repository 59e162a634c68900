// A drive bus that Poise does not know: registered as a module would, asked for by its name, and
// run by the bridge.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "components/framework/configuration/added_fields.h"
#include "components/framework/optional_ports.h"
#include "components/messages/robot_resource.h"
#include "hw_bridge/drive_buses.h"
#include "hw_bridge/hw_bridge.h"
#include "poise/message_traits.hpp"
#include "tests/hw_bridge/bridge_bench.h"
#include "tests/hw_bridge/rope_bus.pb.h"

namespace poise {
namespace {

constexpr int kJoints = 12;
constexpr int64_t kKneeCounts = 39114;  // 0.6 rad, off the range's end

/// What the test sees of the bus that the bridge has made.
struct Seen {
  drive_feedback_t feedback;
  drive_command_t command;
  int started = 0, stopped = 0, cycles = 0, idle = 0;
  bool start_fails = false;
} seen;

class RopeBus final : public DriveBus {
 public:
  RopeBus(const RopeBusConfig& config, const robot::RobotModel& model, double period) {
    if (config.ropes() != model.num_joints()) throw ConfigError("ropes", "must be one per joint");
    if (period > 0.01) throw std::runtime_error("ropes are too slow");
    reports_.resize(static_cast<size_t>(model.num_joints()));
    for (DriveReport& report : reports_) report.state = bridge_status_t::DRIVE_ENABLED;
  }
  void Start() override {
    ++seen.started;
    if (seen.start_fails) throw std::runtime_error("no rope");
  }
  std::string Stop() override {
    ++seen.stopped;
    return "a knot is left";
  }
  void Idle(bool) override { ++seen.idle; }
  const drive_feedback_t* Receive() override { return &seen.feedback; }
  void Send(const drive_command_t& command) override {
    seen.command = command;
    ++seen.cycles;
  }
  SensorsOfBus sensors() const override { return {.imu = true, .feet = true}; }
  std::span<const DriveReport> reports() const override { return reports_; }
  const BusHealth& health() const override { return health_; }
  int num_slaves() const override { return 3; }
  void Diagnose(bus_status_t* status) const override { status->al_status[2] = 8; }

 private:
  std::vector<DriveReport> reports_;
  BusHealth health_;
};

DriveBusType RopeBusType() {
  return {.name = "rope",
          .config = RopeBusConfig::descriptor(),
          .make = MakerOf<RopeBusConfig>(
              [](const RopeBusConfig& config, const robot::RobotModel& model, double period) {
                return std::make_unique<RopeBus>(config, model, period);
              }),
          .all_sensors = "feels_all",
          .link = {.simulated_time = "simulated_time"}};
}

class OwnBus : public BridgeBench, public testing::Test {
 protected:
  static void SetUpTestSuite() { AddDriveBus(RopeBusType()); }

  OwnBus() {
    seen = {};
    MessageTraits<drive_feedback_t>::Resize(seen.feedback, MessageCounts{kJoints, 2});
    seen.feedback.imu_acceleration[2] = 9.80665;
    seen.feedback.drive_status.assign(kJoints, drive_feedback_t::DRIVE_ENABLED);
    bridge = std::make_unique<HwBridge>(&signal);
  }
  void Open(const std::string& config) {
    BridgeBench::Configure(Context(config), kJoints);
    bridge->Open();
  }
  void Run(int cycles) {
    for (int i = 0; i < cycles; ++i) RunCycle(true);
  }
  ConfigError ErrorOf(const std::string& config) {
    try {
      BridgeBench::Configure(Context(config), kJoints);
    } catch (const ConfigError& error) {
      return error;
    }
    return ConfigError("none");
  }
};

TEST_F(OwnBus, BringsReadingsAndTakesOrders) {
  for (const size_t knee : {3, 9}) seen.feedback.position_counts[knee] = kKneeCounts;
  Open("rope { feels_all: true }");
  EXPECT_FALSE(HasInput("drive_feedback"));
  EXPECT_EQ(seen.started, 1);
  command.torque.assign(kJoints, 7.5);
  Run(100);
  EXPECT_EQ(status().state, bridge_status_t::STATE_RUNNING);
  EXPECT_EQ(seen.cycles, 100);
  const auto& motor = LoadRobot(Context(""))->motors()[0];
  const double torque_of_ampere = motor.gear_ratio * motor.torque_constant;
  const double radians = 2 * std::numbers::pi / (motor.gear_ratio * motor.encoder_counts);
  EXPECT_NEAR(seen.command.current[0], 7.5 / torque_of_ampere, 1e-9);
  EXPECT_NEAR(readings().joint_position[3], static_cast<double>(kKneeCounts) * radians, 1e-9);
  EXPECT_EQ(readings().imu_acceleration[2], 9.80665);
  ASSERT_EQ(bus_status().al_status.size(), 3u);
  EXPECT_EQ(bus_status().al_status[2], 8);
}

TEST_F(OwnBus, IsLedToRestWhateverItIs) {
  for (const size_t knee : {3, 9}) seen.feedback.position_counts[knee] = kKneeCounts;
  Open("rope { feels_all: true }");
  command.torque.assign(kJoints, 7.5);
  Run(100);
  EXPECT_EQ(bridge->Close(), "a knot is left");
  EXPECT_EQ(seen.stopped, 1);
  EXPECT_GT(seen.cycles, 100);  // the ramp
  for (size_t j = 0; j < kJoints; ++j) {
    EXPECT_EQ(seen.command.current[j], 0);
    EXPECT_EQ(seen.command.enabled[j], 0);
  }
}

TEST_F(OwnBus, ThatCannotStartIsStopped) {
  seen.start_fails = true;
  EXPECT_THROW(Open("rope {}"), std::runtime_error);
  EXPECT_EQ(seen.stopped, 1);
}

TEST_F(OwnBus, ErrorsNameItsFields) {
  EXPECT_EQ(ErrorOf("rope { ropes: 3 }").field(), "rope.ropes");
  EXPECT_EQ(ErrorOf("rope {} ethercat {}").field(), "rope");
  EXPECT_THAT(ErrorOf("rope { length: 1 }").what(), testing::HasSubstr("length"));
}

TEST_F(OwnBus, StandsInAScenariosText) {
  HwBridgeConfig config;
  ParseTextProto("hold_time: 1\nrope { ropes: 5 } # rope { ropes: 6 }", "file", &config);
  EXPECT_THAT(TextOf(config), testing::HasSubstr("rope {\n  ropes: 5\n}"));
  SetField(&config, "rope.ropes", "7");
  EXPECT_THAT(TextOf(config), testing::HasSubstr("ropes: 7"));
}

TEST_F(OwnBus, IsPartOfWhatTheBridgeTellsOfItself) {
  const ComponentType type = HwBridgeType();
  EXPECT_THAT(type.traits.drive_links,
              testing::Contains(
                  testing::Field(&DriveLink::simulated_time, "hw_bridge.rope.simulated_time")));
  for (const OptionalPort& port : OptionalPortsOf("hw_bridge")) {
    EXPECT_THAT(port.input ? port.unless : port.when,
                testing::Contains(port.input ? "hw_bridge.rope.feels_all" : "hw_bridge.rope"));
  }
}

TEST_F(OwnBus, HasANameOfItsOwn) {
  EXPECT_THROW(AddDriveBus(RopeBusType()), ConfigError);
  DriveBusType type = RopeBusType();
  type.name = "hold_time";
  EXPECT_THROW(AddDriveBus(type), ConfigError);
}

}  // namespace
}  // namespace poise
