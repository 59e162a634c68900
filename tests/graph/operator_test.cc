// A person pushes a run and turns its gains: answered, logged, and repeated to the bit.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "components/framework/runners/inline_runner.h"
#include "fmt/format.h"
#include "logging/log_messages.h"
#include "logging/run_record.h"
#include "operate/message_traits.hpp"
#include "tests/graph/poise_program.h"
#include "tools/scenario/registry.h"

namespace poise {
namespace {

using ::testing::HasSubstr;

class OperatorTest : public testing::Test {
 protected:
  /// A run in lockstep that goes on until Stop.
  void Start(const std::vector<std::string>& flags = {}) {
    std::vector<std::string> arguments = {"run",     StandScenario(), "--duration", "600",
                                          "--quiet", "--force",       "--out",      run_};
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    program_ = std::make_unique<PoiseProgram>(arguments);
    ASSERT_TRUE(WaitForLog(run_, kUnderWay));
  }
  void Stop() {
    kill(program_->pid(), SIGINT);
    program_->Wait();
  }
  ProgramResult Poise(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--run", run_});
    return RunPoise(arguments);
  }

  RunFolder folder_;
  std::string run_ = folder_ / "run";
  std::unique_ptr<PoiseProgram> program_;
};

/// The messages of a log, bytes by channel and tick; of external channels in their order.
struct Messages {
  explicit Messages(const std::string& path) : log(path) {
    logging::LogEvent event;
    while (log.reader().Next(&event)) {
      const MessageType* const type = log.TypeOf(event);
      if (type == nullptr || !type->has_header) continue;
      const std::vector<uint8_t> data(event.data.begin(), event.data.end());
      const int64_t tick = ReadInt64(data.data() + type->run_id_offset + 8);
      if (event.channel == "OPERATOR_ACT" || event.channel == "OPERATOR_ANSWER") {
        external[std::string(event.channel)].push_back(data);
      } else {
        by_tick[std::string(event.channel)][tick] = data;
      }
    }
  }
  logging::LogMessages log;
  std::map<std::string, std::map<int64_t, std::vector<uint8_t>>> by_tick;
  std::map<std::string, std::vector<std::vector<uint8_t>>> external;
};

template <class T>
T Decoded(const std::vector<uint8_t>& data) {
  T message{};
  EXPECT_TRUE(DecodeChecked(data.data(), static_cast<int64_t>(data.size()), &message));
  return message;
}

TEST_F(OperatorTest, APushAndASettingAreRepeatedToTheBit) {
  Start();
  // The scenario's own push, until tick 100, is over: a tick is some 10 kB.
  ASSERT_TRUE(WaitForLog(run_, 2'000'000));
  const ProgramResult push =
      Poise({"push", "--force", "0,-30,0", "--duration", "0.1", "--point", "0,0,0.1"});
  EXPECT_EQ(push.exit_code, 0) << push.output;
  EXPECT_THAT(push.output, HasSubstr("push of 30 N for 0.1 s: from tick "));
  const ProgramResult before = Poise({"set", "--list"});
  EXPECT_EQ(before.exit_code, 0) << before.output;
  EXPECT_THAT(before.output, HasSubstr("task_controller.com.kp"));
  EXPECT_THAT(before.output, HasSubstr("redistributor.eta_min"));
  const ProgramResult set =
      Poise({"set", "task_controller.orientation.kp=150", "redistributor.eta_min=0.1"});
  EXPECT_EQ(set.exit_code, 0) << set.output;
  // Refused, with no effect and why.
  for (const auto& [arguments, why] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"step"}, "does not walk"},
           {{"walk", "--velocity", "0.1,0"}, "its scenario needs base: \"base/walking\""},
           {{"step", "--together"}, "does not step"},
           {{"step", "--next-phase"}, "nothing follows this phase"}}) {
    const ProgramResult refused = Poise(arguments);
    EXPECT_EQ(refused.exit_code, 1) << refused.output;
    EXPECT_THAT(refused.output, HasSubstr(why));
  }
  // A gain is gone through in 0.5 s of the run, which a busy machine makes longer.
  EXPECT_TRUE(WaitUntil([&] {
    return Poise({"set", "--list"}).output.find("orientation.kp                     150 ") !=
           std::string::npos;
  }));
  // Wrong before anything is sent.
  for (const auto& [arguments, why] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"set", "task_controller.orientation.kp=1e9"}, "is outside"},
           {{"set", "task_controller.com.kq=1"}, "did you mean task_controller.com.k"},
           {{"set", "task_controller.com.kp"},
            "is no FIELD=VALUE, as in task_controller.com.kp=200"},
           {{"push", "--force", "1,2"}, "--force: needs 3 numbers"},
           {{"push", "--force", "nan,0,0"}, "must be finite"},
           {{"push", "--force", "1,0,0", "--body", "tail"}, "no moving link 'tail'"},
           {{"push", "--force", "0,99999,0"}, "10 times the robot's weight"},
           {{"step", "--foot", "third"}, "no foot 'third'"},
           {{"walk", "--velocity", "9,0"}, "between -1 and 1"},
           {{"walk", "--velocity", "0,0", "--stop"}, "--stop alone"}}) {
    const ProgramResult wrong = Poise(arguments);
    EXPECT_EQ(wrong.exit_code, 2) << wrong.output;
    EXPECT_THAT(wrong.output, HasSubstr(why));
  }
  Stop();

  const ProgramResult replay = RunPoise({"replay", run_});
  EXPECT_EQ(replay.exit_code, 0) << replay.output;
  EXPECT_THAT(replay.output, HasSubstr("JOINT_COMMAND"));
  EXPECT_EQ(replay.output.find("DIFFERENT"), std::string::npos) << replay.output;

  // The force that the truth shows is the one asked for, for as many ticks; the scenario's own push
  // went the other way.
  Messages log(run_ + "/run.lcm");
  int pushed = 0;
  for (const auto& [tick, data] : log.by_tick["GROUND_TRUTH"]) {
    const auto truth = Decoded<ground_truth_t>(data);
    if (!(truth.push_force[1] < 0)) continue;
    EXPECT_EQ(truth.push_force[1], -30) << tick;
    EXPECT_EQ(truth.push_force[0], 0);
    ++pushed;
  }
  EXPECT_EQ(pushed, std::lround(0.1 / log.log.spec().tick_period()));

  // One process gives the same bits, given the same acts.
  std::map<int64_t, int64_t> tick_of;  // by id, of those that took effect
  for (const auto& data : log.external["OPERATOR_ANSWER"]) {
    const auto answer = Decoded<operate::answer_t>(data);
    if (answer.verdict == operate::answer_t::VERDICT_DONE &&
        answer.kind != operate::act_t::KIND_ASK) {
      tick_of[answer.id] = answer.tick;
    }
  }
  EXPECT_EQ(tick_of.size(), 3u);
  InlineRunner runner(log.log.spec(), Components());
  int64_t compared = 0, different = 0;
  runner.set_tap([&](int channel, const OutputPort& output, const Tick& tick) {
    const auto& ticks = log.by_tick[log.log.spec().graph().channel(channel).name()];
    const auto logged = ticks.find(tick.index);
    if (logged == ticks.end()) return;
    std::vector<uint8_t> bytes(static_cast<size_t>(output.encoded_size()));
    output.Encode(bytes.data(), static_cast<int>(bytes.size()));
    ++compared;
    different += bytes != logged->second ? 1 : 0;
  });
  const int64_t ticks = static_cast<int64_t>(log.by_tick["JOINT_COMMAND"].size());
  for (int64_t tick = 0; tick < ticks; ++tick) {
    for (const auto& data : log.external["OPERATOR_ACT"]) {
      const auto act = Decoded<operate::act_t>(data);
      if (tick_of.contains(act.id) && tick_of[act.id] == tick) {
        EXPECT_EQ(act.tick, tick);  // in lockstep none is put off
        EXPECT_TRUE(runner.Inject("OPERATOR_ACT", data));
      }
    }
    runner.Step();
  }
  EXPECT_GT(compared, 10 * ticks);
  EXPECT_EQ(different, 0);
}

TEST_F(OperatorTest, WithMessagesLostOnPurposeAnActIsStillTakenOnceAndRepeated) {
  Start({"--drop", "0.2"});
  for (int i = 0; i < 4; ++i) {
    const ProgramResult push = Poise({"push", "--force", "10,0,0", "--duration", "0.02"});
    EXPECT_EQ(push.exit_code, 0) << push.output;
  }
  // The last push is over, too: a tick is some 10 kB.
  ASSERT_TRUE(WaitForLog(run_, std::filesystem::file_size(run_ + "/run.lcm") + 1'000'000));
  Stop();
  Messages log(run_ + "/run.lcm");
  int pushed = 0;
  for (const auto& [tick, data] : log.by_tick["GROUND_TRUTH"]) {
    pushed += Decoded<ground_truth_t>(data).push_force[0] != 0 ? 1 : 0;
  }
  EXPECT_EQ(pushed, 4 * std::lround(0.02 / log.log.spec().tick_period()));
  const ProgramResult replay = RunPoise({"replay", run_, "--component", "sim"});
  EXPECT_EQ(replay.exit_code, 0) << replay.output;
}

// Without walking; the feet are side by side already, so that nothing moves.
TEST_F(OperatorTest, FeetTogetherIsTakenWhereTheRobotStepsWhenPushed) {
  Start({"--set", "step_planner.recovery.enabled=true"});
  const ProgramResult together = Poise({"step", "--together"});
  EXPECT_EQ(together.exit_code, 0) << together.output;
  EXPECT_THAT(together.output, HasSubstr("feet together: from tick "));
  const ProgramResult step = Poise({"step"});
  EXPECT_EQ(step.exit_code, 1) << step.output;
  const ProgramResult both = Poise({"step", "--together", "--foot", "left"});
  EXPECT_EQ(both.exit_code, 2) << both.output;
  Stop();
  const ProgramResult replay = RunPoise({"replay", run_});
  EXPECT_EQ(replay.exit_code, 0) << replay.output;
}

TEST_F(OperatorTest, WhoWalksIsStoppedAndLedOn) {
  const std::vector<std::string> still = {"--set", "step_planner.walk.command="};
  std::vector<std::string> arguments = {"run",     "walk",    "--duration", "600",
                                        "--quiet", "--force", "--out",      run_};
  arguments.insert(arguments.end(), still.begin(), still.end());
  program_ = std::make_unique<PoiseProgram>(arguments);
  ASSERT_TRUE(WaitForLog(run_, kUnderWay));
  for (const std::vector<std::string>& act : std::vector<std::vector<std::string>>{
           {"walk", "--velocity", "0.3,0", "--turn", "0.3"}, {"walk", "--stop"}}) {
    const ProgramResult taken = Poise(act);
    EXPECT_EQ(taken.exit_code, 0) << taken.output;
    // Some seconds: a tick is some 10 kB.
    ASSERT_TRUE(WaitForLog(run_, act.size() > 2 ? 25'000'000 : 120'000'000));
  }
  const ProgramResult step = Poise({"step", "--foot", "left"});
  EXPECT_EQ(step.exit_code, 0) << step.output;
  Stop();
  const ProgramResult replay = RunPoise({"replay", run_});
  EXPECT_EQ(replay.exit_code, 0) << replay.output;
  for (const nlohmann::json& check : ReadSummary(run_)["checks"]) {
    if (check["name"] == "fallen" || check["name"] == "bridge_not_running_ticks") {
      EXPECT_EQ(check["measured"], 0) << check;
    }
  }
}

TEST_F(OperatorTest, ARunInOneProcessSaysThatItHearsNobody) {
  Start({"--inline", "--realtime"});
  const ProgramResult push = Poise({"push", "--force", "1,0,0"});
  EXPECT_EQ(push.exit_code, 2) << push.output;
  EXPECT_THAT(push.output, HasSubstr("inside one process"));
  Stop();
}

}  // namespace
}  // namespace poise
