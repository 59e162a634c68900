// A master and an emulated chain on one clock, for tests.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "components/framework/configuration/configuration.h"
#include "hw_bridge/ethercat/emulator/emulated_chain.h"
#include "hw_bridge/ethercat/links/faulty_link.h"
#include "hw_bridge/ethercat/links/memory_link.h"
#include "hw_bridge/ethercat/master.h"

namespace poise::ethercat {

/// A shaft that the test places; keeps the torque it was told, and the greatest magnitude.
class TestLoad final : public MotorLoad {
 public:
  void SetTorque(double torque) override {
    torque_ = torque;
    greatest_ = std::max(greatest_, std::abs(torque));
  }
  double position() const override { return position_; }
  double velocity() const override { return velocity_; }

  double torque_ = 0, greatest_ = 0, position_ = 0, velocity_ = 0;
};

inline MasterConfig MakeMasterConfig(int drives) {
  MasterConfig config;
  ReadTextProto(std::string(POISE_SOURCE_DIR) + "/deploy/drives/elmo_gold.pbtxt",
                config.mutable_profile());
  for (int i = 0; i < drives; ++i) {
    DriveConfig& drive = *config.add_drive();
    drive.set_joint("joint_" + std::to_string(i));
    drive.set_rated_torque(1500);
    drive.set_rated_current(15000);
  }
  config.set_drift_frames(200);
  return config;
}

inline EmulatedChainConfig MakeChainConfig(int drives) {
  EmulatedChainConfig config;
  for (int i = 0; i < drives; ++i) {
    config.add_drive()->set_serial(static_cast<uint32_t>(100 + i));
  }
  return config;
}

/// Everything in one place; change the configurations before Build().
struct Bench {
  explicit Bench(int drives)
      : master_config(MakeMasterConfig(drives)), chain_config(MakeChainConfig(drives)) {}

  void Build() {
    std::vector<MotorLoad*> pointers;
    loads = std::vector<TestLoad>(static_cast<size_t>(chain_config.drive_size()));
    for (TestLoad& load : loads) pointers.push_back(&load);
    chain = std::make_unique<EmulatedChain>(chain_config, pointers);
    link = std::make_unique<MemoryLink>(chain.get());
    faulty = std::make_unique<FaultyLink>(link.get(), 1);
    master = std::make_unique<Master>(faulty.get(), master_config);
  }

  /// Builds and leads all to OP.
  void Start() {
    Build();
    master->Start();
  }

  /// One cycle: a frame out, its answer, and the rest of the period.
  CycleResult Cycle(Exchange exchange = Exchange::kReadWrite) {
    const int64_t start = link->Now();
    static_cast<void>(master->Send(exchange));
    const CycleResult result = master->Receive(start + master_config.cycle() / 2);
    link->AdvanceTo(start + master_config.cycle());
    return result;
  }

  /// Cycles in which every drive is led towards `goal`.
  void Drive(DriveGoal goal, int cycles) {
    controls.resize(master->num_drives());
    for (int cycle = 0; cycle < cycles; ++cycle) {
      for (size_t i = 0; i < master->num_drives(); ++i) {
        DriveOutputs outputs = master->outputs(i);
        outputs.controlword =
            controls[i].Controlword(DecodeState(master->inputs(i).statusword), goal);
        master->set_outputs(i, outputs);
      }
      Cycle();
    }
  }

  void SetTorque(int16_t target, uint16_t limit) {
    for (size_t i = 0; i < master->num_drives(); ++i) {
      DriveOutputs outputs = master->outputs(i);
      outputs.target_torque = target;
      outputs.max_torque = limit;
      master->set_outputs(i, outputs);
    }
  }

  DriveState State(size_t drive) const { return DecodeState(master->inputs(drive).statusword); }

  MasterConfig master_config;
  EmulatedChainConfig chain_config;
  std::vector<TestLoad> loads;
  std::unique_ptr<EmulatedChain> chain;
  std::unique_ptr<MemoryLink> link;
  std::unique_ptr<FaultyLink> faulty;
  std::unique_ptr<Master> master;
  std::vector<DriveControl> controls;
};

/// The message of the EthercatError, or of the ConfigError, that `action` throws; empty when it
/// throws none.
template <class Action>
std::string ErrorOf(Action action) {
  try {
    action();
  } catch (const EthercatError& error) {
    return error.what();
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

}  // namespace poise::ethercat
