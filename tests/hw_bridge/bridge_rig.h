// The whole bridge on an emulated chain in memory, with every byte that goes to the drives in view.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "components/robot_files/robot_files.h"
#include "hw_bridge/ethercat/emulator/emulated_chain.h"
#include "hw_bridge/ethercat/ethercat_drive_bus.h"
#include "hw_bridge/ethercat/links/faulty_link.h"
#include "hw_bridge/ethercat/links/memory_link.h"
#include "tests/hw_bridge/bridge_bench.h"

namespace poise {

inline constexpr int kDrives = 12;
inline constexpr int64_t kPeriod = 2'000'000;  // ns
inline constexpr double kGear = 50;
inline constexpr double kGravity = 9.80665;
/// Joint torque, N·m, of one per mille: 50 × 1.5 N·m / 1000.
inline constexpr double kStep = 0.075;

/// A shaft that the test places; keeps the torque it was told.
struct Shaft final : ethercat::MotorLoad {
  void SetTorque(double value) override { torque = value; }
  double position() const override { return angle; }
  double velocity() const override { return 0; }
  double torque = 0, angle = 0;
};

/// What each drive was told in the last process data frame, from its bytes: 6040, 6060, 6071, 6072,
/// 607A, 60FF in 15 bytes.
class WireSpy {
 public:
  void Look(std::span<const uint8_t> frame) {
    ethercat::FrameReader reader(frame);
    const auto first = reader.Next();
    if (!first || first->command != ethercat::Command::kLwr) return;
    std::copy_n(first->data.begin(), std::min(bytes_.size(), first->data.size()), bytes_.begin());
    ++frames_;
    for (size_t i = 0; i < kDrives; ++i) {
      torque_seen_ = torque_seen_ || torque(i) != 0 || limit(i) != 0;
    }
  }
  uint16_t controlword(size_t i) const { return ethercat::Get<uint16_t>(bytes_, 15 * i); }
  int16_t torque(size_t i) const { return ethercat::Get<int16_t>(bytes_, 15 * i + 3); }
  uint16_t limit(size_t i) const { return ethercat::Get<uint16_t>(bytes_, 15 * i + 5); }
  bool torque_seen() const { return torque_seen_; }
  int64_t frames() const { return frames_; }
  bool AllQuiet() const {
    for (size_t i = 0; i < kDrives; ++i) {
      if (torque(i) != 0 || limit(i) != 0 || controlword(i) == ethercat::kControlEnable) {
        return false;
      }
    }
    return true;
  }

 private:
  std::array<uint8_t, 15 * kDrives> bytes_{};
  bool torque_seen_ = false;
  int64_t frames_ = 0;
};

class BridgeRig : public BridgeBench {
 public:
  explicit BridgeRig(const std::string& config = "") : config_(config) {
    for (int i = 0; i < kDrives; ++i) chain_config.add_drive();
    MessageTraits<drive_feedback_t>::Resize(sensors, MessageCounts{kDrives, 2});
    sensors.imu_acceleration[2] = kGravity;
    MessageTraits<joint_command_t>::Resize(command, MessageCounts{kDrives, 2});
  }

  /// With chain_config as it is then; the drives are in OP, disabled.
  void Open() {
    std::vector<ethercat::MotorLoad*> loads;
    for (Shaft& shaft : shafts) loads.push_back(&shaft);
    loads.resize(static_cast<size_t>(chain_config.drive_size()));
    for (const size_t knee : {3, 9}) Place(knee, 0.6);  // off their range's end
    chain = std::make_unique<ethercat::EmulatedChain>(chain_config, loads);
    link = std::make_unique<ethercat::MemoryLink>(chain.get());
    faulty = std::make_unique<ethercat::FaultyLink>(link.get(), 1);
    bridge = std::make_unique<HwBridge>(
        &signal, std::vector{ethercat::EthercatBusType([this](const ethercat::LinkConfig&) {
          return std::make_unique<Tap>(faulty.get(), &wire);
        })});
    Configure(Context("ethercat { link { udp {} } " + bus + " master { " + master +
                      " drift_frames: 200 profile {" + ReadDeployed("drives/elmo_gold.pbtxt") +
                      "} } } " + config_),
              kDrives);
    bridge->Open();
  }

  /// One cycle. `speed`: every joint turns on, rad/s.
  void Step(bool with_command = true, double speed = 0, double lateness = 0) {
    for (size_t j = 0; j < kDrives; ++j) Place(j, shafts[j].angle / kGear + speed * 0.002);
    const int64_t start = link->Now();
    FindInput("drive_feedback")->Bind(&sensors);
    RunCycle(with_command, lateness);
    link->AdvanceTo(start + kPeriod);
  }
  void Run(int cycles, double speed = 0) {
    for (int i = 0; i < cycles; ++i) Step(true, speed);
  }
  /// Leads to RUNNING with `torque`, N·m, on every joint.
  void Start(double torque = 7.5) {
    Open();
    command.torque.assign(kDrives, torque);
    for (int i = 0; i < 100 && status().state != bridge_status_t::STATE_RUNNING; ++i) Step();
    Run(3);
  }
  /// Steps until `condition` holds; cycles that were needed after the first: 0, the very next frame
  /// shows it; -1: it never did.
  template <class Condition>
  int CyclesUntil(Condition condition, bool with_command = true, double speed = 0,
                  double lateness = 0) {
    return Count([&] { Step(with_command, speed, lateness); }, condition);
  }

  void Place(size_t joint, double angle) { shafts[joint].angle = angle * kGear; }
  ethercat::EmulatedSlave& slave(size_t i) { return chain->slave(i); }

  std::string bus = "attend: false";  // fields of hw_bridge.ethercat
  std::string master;                 // and of its master
  ethercat::EmulatedChainConfig chain_config;
  std::array<Shaft, kDrives + 1> shafts;  // one more than joints, for a drive too many
  std::unique_ptr<ethercat::EmulatedChain> chain;
  std::unique_ptr<ethercat::MemoryLink> link;
  std::unique_ptr<ethercat::FaultyLink> faulty;
  WireSpy wire;
  drive_feedback_t sensors;

 private:
  class Tap final : public ethercat::Link {
   public:
    Tap(ethercat::Link* link, WireSpy* spy) : link_(link), spy_(spy) {}
    int64_t Now() const override { return link_->Now(); }
    bool Send(std::span<const uint8_t> frame) override {
      spy_->Look(frame);
      return link_->Send(frame);
    }
    size_t Receive(std::span<uint8_t> frame, int64_t deadline) override {
      return link_->Receive(frame, deadline);
    }

   private:
    ethercat::Link* link_;
    WireSpy* spy_;
  };

  std::string config_;
};

}  // namespace poise
