// Processes killed, links cut and robots fallen silent at random moments of runs over DDS, with
// every command that reaches the robot in view. POISE_DDS_FAULTS sets how many.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <random>
#include <thread>

#include "components/framework/clock.h"
#include "components/robot_files/robot_files.h"
#include "hw_bridge/unitree/crc.h"
#include "hw_bridge/unitree/dds.h"
#include "hw_bridge/unitree/motor_slots.h"
#include "tests/graph/poise_program.h"
#include "tests/test_seed.h"

namespace poise {
namespace {

enum Fault { kController, kBridge, kRobotSilent, kCommandsLost, kLinkCut, kNumFaults };
constexpr const char* kNames[] = {"controller killed or stopped", "bridge killed", "robot silent",
                                  "commands lost", "link cut"};

int NumFaults() {
  const char* const wanted = std::getenv("POISE_DDS_FAULTS");
  return wanted != nullptr ? std::atoi(wanted) : kNumFaults;
}

/// Listens to what the bridge tells the robot. A torque is what a motor makes of tau, stiffness and
/// damping at the last state that was heard.
class CommandSpy {
 public:
  CommandSpy(const robot::RobotModel& model, const std::string& tag) : model_(model) {
    link_.set_tag(tag);
    slots_ = unitree::MotorSlots(model, unitree::UnitreeBusConfig::BY_ROBOT, {});
    thread_ = std::thread([this] { Listen(); });
  }
  ~CommandSpy() { End(); }
  void End() {
    end_ = true;
    if (thread_.joinable()) thread_.join();
  }

  int64_t commands = 0, states = 0, damaged = 0, not_finite = 0, strangers = 0;
  // The largest of tau, of all three, and of what the motors say that they gave, of the limit.
  double torque_share = 0, whole_share = 0, given_share = 0;
  std::string worst;  // of whole_share

 private:
  void Listen() {
    const unitree::Participant participant(link_);
    unitree::Reader<unitree::LowCmd> commands_in(participant, unitree::kCommandTopic, 1024);
    unitree::Reader<unitree::LowState> states_in(participant, unitree::kStateTopic, 1024);
    unitree::LowCmd command{};
    unitree::LowState next{};
    int64_t command_sent = 0, next_sent = 0;
    bool waits = false;  // a state, for a command that was sent after it
    while (!end_) {
      commands_in.Await(NowNanoseconds() + 20'000'000);
      // However late this process is: each command beside the last state before it.
      while (commands_in.Take(&command, &command_sent)) {
        while (waits || states_in.Take(&next, &next_sent)) {
          waits = next_sent > command_sent;
          if (waits) break;
          state_ = next;
          LookAtState();
        }
        Look(command);
      }
    }
  }
  void LookAtState() {
    ++states;
    for (size_t joint = 0; joint < slots_.size(); ++joint) {
      const auto given = static_cast<double>(state_.motor_state[slots_[joint]].tau_est);
      given_share = std::max(given_share, std::abs(given) / LimitOf(joint));
    }
  }
  void Look(const unitree::LowCmd& command) {
    ++commands;
    damaged += command.crc != unitree::CrcOf(command) ? 1 : 0;
    for (size_t slot = 0; slot < unitree::kNumSlots; ++slot) {
      const unitree::MotorCmd& motor = command.motor_cmd[slot];
      const auto found = std::find(slots_.begin(), slots_.end(), slot);
      if (found == slots_.end()) {
        strangers += motor.mode != 0 || motor.tau != 0 ? 1 : 0;
        continue;
      }
      const auto joint = static_cast<size_t>(found - slots_.begin());
      const double limit = LimitOf(joint);
      const unitree::MotorState& state = state_.motor_state[slot];
      const auto tau = static_cast<double>(motor.tau);
      const double whole = tau +
                           static_cast<double>(motor.kp) * static_cast<double>(motor.q - state.q) +
                           static_cast<double>(motor.kd) * static_cast<double>(motor.dq - state.dq);
      not_finite += std::isfinite(whole) ? 0 : 1;
      torque_share = std::max(torque_share, std::abs(tau) / limit);
      if (states == 0 || std::abs(whole) <= whole_share * limit) continue;
      whole_share = std::abs(whole) / limit;
      worst = fmt::format(
          "command {} after state {}: {} of {} N·m: tau {}, kp {}, kd {}, q {} of {}, dq {} of {}",
          commands, states, whole, limit, motor.tau, motor.kp, motor.kd, motor.q, state.q, motor.dq,
          state.dq);
    }
  }
  double LimitOf(size_t joint) const {
    const robot::MotorModel& motor = model_.motors()[joint];
    return std::min(model_.joints()[joint].effort, motor.torque_per_ampere() * motor.peak_current);
  }

  const robot::RobotModel& model_;
  unitree::DdsLink link_;
  std::vector<size_t> slots_;
  unitree::LowState state_{};
  std::atomic<bool> end_ = false;
  std::thread thread_;
};

struct Trial {
  Fault fault;
  double from, length;  // s; a length of 0: for good
  bool realtime;
  uint64_t seed;
};

class UnitreeFault : public testing::Test {
 protected:
  static constexpr double kDuration = 1.5;  // s

  static Trial Draw(int number) {
    std::mt19937_64 random(TestSeed(static_cast<uint64_t>(17 + number)));
    const auto uniform = [&random](double from, double to) {
      return std::uniform_real_distribution<double>(from, to)(random);
    };
    Trial trial{};
    trial.fault = static_cast<Fault>(number % kNumFaults);
    trial.from = uniform(0.1, 0.9);
    // From a cycle to long after everybody has given up, and every fourth for good.
    trial.length = std::exp(uniform(std::log(0.002), std::log(0.3)));
    if (number / kNumFaults % 4 == 3) trial.length = 0;
    // Processes take each other's place in real time alone.
    trial.realtime =
        trial.fault == kController || trial.fault == kBridge || number / kNumFaults % 2 == 1;
    trial.seed = random() % 1'000'000;
    return trial;
  }

  void SetTrouble(const std::string& field, const std::string& value) {
    arguments_.insert(arguments_.end(), {"--set", fmt::format("unitree_emulator.trouble[{}].{}={}",
                                                              trouble_, field, value)});
  }
  void AddTrouble(const char* kind, const Trial& trial) {
    SetTrouble("kind", kind);
    SetTrouble("from", fmt::format("{:.4f}", trial.from));
    if (trial.length > 0) SetTrouble("until", fmt::format("{:.4f}", trial.from + trial.length));
    ++trouble_;
  }

  /// The bridge's own word for why it stopped; empty: it did not.
  static std::string Stop(const nlohmann::json& summary) {
    for (const auto& event : summary["events"]) {
      const std::string detail = event["detail"];
      if (event["name"] != "bridge_state" || detail.find(" to ") == std::string::npos) continue;
      const size_t colon = detail.find(": ");
      const std::string state = detail.substr(detail.find(" to ") + 4);
      if (state.starts_with("stopp") || state.starts_with("emergency")) {
        fmt::print("  {:.3f} s: {}\n", event["time"].get<double>(), detail);
        return colon == std::string::npos ? "" : detail.substr(colon + 2);
      }
    }
    return "";
  }

  void Run(int number) {
    const Trial trial = Draw(number);
    const std::string run = folder_ / fmt::format("run{}", number);
    const std::string tag = fmt::format("fault-{}-{}", getpid(), number);
    trouble_ = 0;
    arguments_ = {"run",        StandScenario(),
                  "--drives",   "unitree",
                  "--out",      run,
                  "--seed",     std::to_string(trial.seed),
                  "--set",      "hw_bridge.unitree.link.tag=" + tag,
                  "--set",      "unitree_emulator.link.tag=" + tag,
                  "--set",      "hw_bridge.unitree.state_timeout=50",
                  "--set",      "unitree_emulator.command_wait=200",
                  "--duration", std::to_string(kDuration)};
    if (trial.realtime) arguments_.emplace_back("--realtime");
    if (trial.fault == kController) {
      arguments_.insert(arguments_.end(),
                        {"--kill", "1", "--kill-seed", std::to_string(trial.seed)});
    }
    if (trial.fault == kRobotSilent || trial.fault == kLinkCut) AddTrouble("NO_STATE", trial);
    if (trial.fault == kCommandsLost || trial.fault == kLinkCut) AddTrouble("NO_COMMAND", trial);

    CommandSpy spy(model_, tag);
    PoiseProgram program(arguments_);
    if (trial.fault == kBridge) {
      ASSERT_TRUE(WaitForLog(run, kUnderWay)) << program.Wait().output;
      // From while the robot still hangs to after it stands.
      std::this_thread::sleep_for(std::chrono::duration<double>(4.5 * trial.from));
      const pid_t bridge = ComponentProcess(run, "hw_bridge");
      ASSERT_GT(bridge, 0);
      kill(bridge, SIGKILL);
    }
    const ProgramResult result = program.Wait();
    spy.End();
    EXPECT_TRUE(ProcessesWith(run).empty());
    Judge(trial, run, result, spy);
    std::filesystem::remove_all(run);
  }

  void Judge(const Trial& trial, const std::string& run, const ProgramResult& result,
             const CommandSpy& spy) {
    const std::string what =
        fmt::format("{}{}, {:.3f} s for {:.0f} ms", kNames[trial.fault],
                    trial.realtime ? "" : " (lockstep)", trial.from, 1e3 * trial.length);
    EXPECT_GT(spy.commands, 100) << what;
    EXPECT_EQ(spy.damaged, 0) << what;
    EXPECT_EQ(spy.not_finite, 0) << what;
    EXPECT_EQ(spy.strangers, 0) << what;
    EXPECT_LE(spy.torque_share, 1 + 1e-6) << what;
    // Between the state that the bridge acted on and the one heard last a joint moves a little.
    EXPECT_LE(spy.whole_share, 1.05) << what << "\n" << spy.worst;
    EXPECT_LE(spy.given_share, 1.05) << what;
    EXPECT_GT(spy.states, 100) << what;
    greatest_share_ = std::max(greatest_share_, spy.whole_share);
    greatest_given_ = std::max(greatest_given_, spy.given_share);
    commands_ += spy.commands;

    std::string outcome;
    if (trial.fault == kBridge) {
      outcome = "the run ends and names hw_bridge";
      EXPECT_NE(result.output.find("hw_bridge"), std::string::npos) << result.output;
      EXPECT_EQ(result.exit_code, 1) << result.output;
    } else {
      const nlohmann::json summary = ReadSummary(run);
      const std::string stop = Stop(summary);
      bool fell = false;
      for (const auto& event : summary["events"]) fell = fell || event["name"] == "fall";
      outcome = stop.empty() ? "stands" : "stopped: " + stop;
      if (fell && stop.empty()) outcome = "FELL";
      EXPECT_TRUE(!fell || !stop.empty()) << what << "\n" << result.output;
      falls_ += fell && stop.empty() ? 1 : 0;
    }
    ++outcomes_[fmt::format("{}{}: {}", kNames[trial.fault], trial.realtime ? "" : " (lockstep)",
                            outcome)];
  }

  robot::RobotModel model_ =
      robot::LoadRobotFiles(POISE_SOURCE_DIR "/deploy/robots/dyros/dyros_legs.pbtxt");
  RunFolder folder_;
  std::vector<std::string> arguments_;
  int trouble_ = 0, falls_ = 0;
  int64_t commands_ = 0;
  double greatest_share_ = 0, greatest_given_ = 0;
  std::map<std::string, int> outcomes_;
};

TEST_F(UnitreeFault, EndsStandingOrInANamedStopAndBreaksNoLimit) {
  for (int i = 0; i < NumFaults(); ++i) {
    ASSERT_NO_FATAL_FAILURE(Run(i));
    if (NumFaults() > kNumFaults) fmt::print(stderr, "\r{} faults", i + 1);
  }
  fmt::print(
      "\nDDS: {} faults, {} falls, {} commands heard; torque at most {:.1f} % of a limit told, "
      "{:.1f} % given\n",
      NumFaults(), falls_, commands_, 100 * greatest_share_, 100 * greatest_given_);
  for (const auto& [outcome, count] : outcomes_) fmt::print("  {:4d} {}\n", count, outcome);
}

}  // namespace
}  // namespace poise
