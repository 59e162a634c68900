// A component fed from a log gives what it gave in the run.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <regex>

#include "components/framework/bus/udp_bus.h"
#include "components/framework/clock.h"
#include "components/framework/run.h"
#include "fmt/format.h"
#include "logging/log_reader.h"
#include "logging/run_log_writer.h"
#include "logging/run_record.h"
#include "tests/graph/poise_program.h"
#include "tests/test_seed.h"

namespace poise {
namespace {

class ReplayTest : public testing::Test {
 protected:
  void Run(const std::vector<std::string>& flags = {}) {
    std::vector<std::string> arguments = {"run", StandScenario(), "--out", run_};
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    RunPoise(arguments);
  }
  /// `poise replay` of the run.
  ProgramResult Replay(const std::vector<std::string>& flags = {}, const std::string& run = "") {
    std::vector<std::string> arguments = {"replay", run.empty() ? run_ : run};
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    return RunPoise(arguments);
  }
  /// The run's log with the events that `keep` keeps, each as it changes them.
  template <class Change>
  std::string Changed(Change change) {
    const std::string path = folder_ / "changed.lcm";
    logging::LogReader reader(run_ + "/run.lcm");
    logging::EventLogWriter writer(path);
    logging::LogEvent event;
    while (reader.Next(&event)) {
      std::vector<uint8_t> data(event.data.begin(), event.data.end());
      if (change(event, &data)) writer.Write(event.channel, event.utime, data);
    }
    writer.Close();
    return path;
  }
  /// The run's log without three ticks of a channel, 10 to 12.
  std::string Without(std::string_view channel) {
    return Changed([channel](const logging::LogEvent& event, std::vector<uint8_t>*) {
      return event.channel != channel || event.utime < 20'000 || event.utime > 24'000;
    });
  }

  RunFolder folder_;
  std::string run_ = folder_ / "run";
};

#define EXPECT_HAS(result, text) \
  EXPECT_NE((result).output.find(text), std::string::npos) << (result).output

TEST_F(ReplayTest, EveryComponentGivesTheLoggedBits) {
  Run();  // as processes
  const ProgramResult result = Replay();
  EXPECT_EQ(result.exit_code, 0) << result.output;
  for (const char* component : {"sim", "hw_bridge", "state_estimator", "step_planner",
                                "task_controller", "contact_wrench_monitor", "redistributor"}) {
    EXPECT_HAS(result, std::string(component) + ": 200 ticks");
  }
  EXPECT_HAS(result, "JOINT_COMMAND: 200 messages, the same bits");
}

TEST_F(ReplayTest, ConfigurationsComeFromTheLog) {
  Run({"--inline", "--set", "task_controller.com.kp=190", "--seed", "5"});
  EXPECT_EQ(Replay({"--component", "task_controller", "--component", "sim"}).exit_code, 0);
  const ProgramResult result =
      Replay({"--component", "task_controller", "--set", "task_controller.com.kp=225"});
  EXPECT_EQ(result.exit_code, 1) << result.output;
  EXPECT_HAS(result, "task_controller: 200 ticks");
  EXPECT_HAS(result, "DIFFERENT");
  EXPECT_HAS(result, "first torque[");
}

// Beside the truth, which a simulation's log has.
TEST_F(ReplayTest, AnEstimatorsSettingIsTriedOnALog) {
  RunPoise({"run", "push_double_support", "--inline", "--set", "duration=0.6", "--out", run_});
  const auto errors = [](const std::string& run) {
    std::map<std::string, nlohmann::json> measured;
    const nlohmann::json summary = ReadSummary(run);
    for (const nlohmann::json& check : summary["checks"]) {
      measured[check["name"]] = check["measured"];
    }
    return measured;
  };
  const auto ran = errors(run_);
  EXPECT_LT(ran.at("estimator_position_rms").get<double>(), 0.2);
  EXPECT_GT(ran.at("estimator_nees_share").get<double>(), 0.9);
  // The robot has gears that wind up by up to 0.6 mrad on legs of 0.8 m.
  const std::string out = folder_ / "rigid_gears";
  const ProgramResult result =
      Replay({"--component", "state_estimator", "--set",
              "state_estimator.invariant_ekf.gear_stiffness=0", "--out", out});
  EXPECT_EQ(result.exit_code, 1) << result.output;
  EXPECT_GT(errors(out).at("estimator_position_rms"), ran.at("estimator_position_rms"));
}

TEST_F(ReplayTest, WhatWasReplayedIsARunsFolder) {
  Run({"--inline"});
  const std::string same = folder_ / "same", out = folder_ / "replayed";
  const ProgramResult equal = Replay({"--component", "redistributor", "--out", same});
  EXPECT_EQ(equal.exit_code, 0) << equal.output;
  EXPECT_EQ(RunPoise({"compare", run_, same}).exit_code, 0);
  EXPECT_EQ(ReadSummary(same)["checks"], ReadSummary(run_)["checks"]);

  const std::vector<std::string> change = {
      "--component", "task_controller", "--set", "task_controller.com.kp=190", "--out", out};
  const ProgramResult result = Replay(change);
  EXPECT_EQ(result.exit_code, 1) << result.output;
  // What the comparison has counted is what the logs differ in, and all of it is the component's.
  std::smatch counted, compared;
  const std::string text = RunPoise({"compare", run_, out}).output;
  ASSERT_TRUE(std::regex_search(result.output, counted,
                                std::regex("TASK_TORQUE: (\\d+) of 200 messages differ")))
      << result.output;
  ASSERT_TRUE(std::regex_search(text, compared, std::regex("compared; (\\d+) differ"))) << text;
  EXPECT_EQ(counted[1], compared[1]);
  EXPECT_NE(text.find("TASK_TORQUE.torque["), std::string::npos) << text;
  // Its record says with which configuration: that gives the same bits again.
  EXPECT_EQ(Replay({"--component", "task_controller"}, out).exit_code, 0);
  EXPECT_EQ(RunPoise({"log", "check", out}).exit_code, 0);
  const nlohmann::json summary = ReadSummary(out);
  EXPECT_EQ(summary["mode"], "replay");
  EXPECT_EQ(summary["changes"].back()["set"], "task_controller.com.kp=190");
  EXPECT_TRUE(std::filesystem::exists(out + "/report.html"));

  EXPECT_EQ(Replay(change).exit_code, 2);  // there is one
  EXPECT_EQ(Replay({"--out", run_, "--force"}).exit_code, 2);
  EXPECT_EQ(RunPoise({"log", "check", run_}).exit_code, 0);
}

// The channel is FOOTSTEPS, which only a planner that steps writes.
TEST_F(ReplayTest, ASettingMayBringOrTakeAChannel) {
  const std::string steps = folder_ / "steps", setting = "step_planner.walk.enabled=";
  Run({"--inline"});
  RunPoise({"run", StandScenario(), "--inline", "--set", setting + "true", "--out", steps});
  const ProgramResult more = Replay({"--component", "step_planner", "--set", setting + "true"});
  EXPECT_NE(more.exit_code, -1) << more.output;
  EXPECT_HAS(more, "step_planner: 200 ticks");
  EXPECT_HAS(more, "FOOTSTEPS: nothing to compare with");
  const ProgramResult less =
      Replay({"--component", "step_planner", "--set", setting + "false"}, steps);
  EXPECT_NE(less.exit_code, -1) << less.output;
  EXPECT_HAS(less, "step_planner: 200 ticks");
  EXPECT_EQ(less.output.find("FOOTSTEPS"), std::string::npos) << less.output;
}

TEST_F(ReplayTest, OneChangedBitShowsWithItsFieldAndTick) {
  Run({"--inline"});
  double change = 0;
  const std::string log = Changed([&](const logging::LogEvent& event, std::vector<uint8_t>* data) {
    joint_command_t command;
    if (event.channel != "JOINT_COMMAND" ||
        !DecodeChecked(data->data(), static_cast<int64_t>(data->size()), &command) ||
        command.tick != 123) {
      return true;
    }
    change = command.torque[7];
    command.torque[7] = std::nextafter(command.torque[7], 1e9);
    change = command.torque[7] - change;
    command.encode(data->data(), 0, static_cast<int>(data->size()));
    return true;
  });
  ASSERT_GT(change, 0);
  const ProgramResult result = Replay({"--component", "redistributor"}, log);
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_HAS(result,
             "JOINT_COMMAND: 1 of 200 messages differ, first torque[left_hip_roll] at tick 123");
  EXPECT_HAS(
      result,
      fmt::format("torque: 1 ticks, from 123 on; largest {:.3g}: torque[left_hip_roll] at tick",
                  change));
  // The bridge reads it, and its own output changes by it.
  EXPECT_EQ(Replay({"--component", "hw_bridge"}, log).exit_code, 1);
  EXPECT_EQ(Replay({"--component", "state_estimator"}, log).exit_code, 0);
}

TEST_F(ReplayTest, InRealTimeATickWithoutOutputWasNotRun) {
  Run({"--inline", "--realtime"});
  // The task controller keeps nothing from tick to tick here.
  const std::string log = Without("TASK_TORQUE");
  const ProgramResult late = Replay({"--component", "task_controller"}, log);
  EXPECT_EQ(late.exit_code, 0) << late.output;
  EXPECT_HAS(late, "too late for 3 ticks, and 0 of its inputs");
  const ProgramResult reader = Replay({"--component", "contact_wrench_monitor"}, log);
  EXPECT_HAS(reader, "too late for 3 ticks, and 0 of its inputs");
}

TEST_F(ReplayTest, InRealTimeTheBridgeGoesOnWithoutACommand) {
  Run({"--inline", "--realtime"});
  const std::string log = Without("JOINT_COMMAND");
  const ProgramResult result = Replay({"--component", "hw_bridge"}, log);
  EXPECT_EQ(result.exit_code, 1) << result.output;
  EXPECT_HAS(result, "too late for 0 ticks, and 3 of its inputs");
  EXPECT_HAS(result, "ROBOT_SENSORS");
}

TEST_F(ReplayTest, NamesWhatTheLogLacks) {
  Run({"--inline"});
  const std::string log = Without("ROBOT_STATE");
  const ProgramResult result = Replay({"--component", "redistributor"}, log);
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_HAS(result, "redistributor cannot be replayed");
  EXPECT_HAS(result, "ROBOT_STATE of tick 10 to 12");
  EXPECT_EQ(Replay({"--component", "hw_bridge"}, log).exit_code, 0);

  const std::string cut = folder_ / "cut.lcm";
  ASSERT_EQ(RunPoise({"log", "cut", run_, "--first-tick", "50", "--out", cut}).exit_code, 0);
  const ProgramResult of_cut = Replay({"--component", "state_estimator"}, cut);
  EXPECT_EQ(of_cut.exit_code, 1);
  EXPECT_HAS(of_cut, "cut from a longer log");
}

TEST_F(ReplayTest, EmergencyStopActsInItsTickWhereverItWasRecorded) {
  PoiseProgram program({"run", StandScenario(), "--out", run_, "--duration", "4"});
  ASSERT_TRUE(WaitForLog(run_, 200'000));
  std::mt19937 random(static_cast<unsigned>(NowNanoseconds()));
  std::this_thread::sleep_for(std::chrono::milliseconds(random() % 100));
  ASSERT_EQ(RunPoise({"estop", run_}).exit_code, 0);
  program.Wait();  // the robot without torque falls
  const ProgramResult result = Replay({"--component", "hw_bridge"});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_EQ(result.output.find("external messages"), std::string::npos) << result.output;

  // As if the recorder had heard it earlier or later.
  std::vector<std::pair<std::string, std::vector<uint8_t>>> stops;
  std::vector<std::pair<std::string, std::vector<uint8_t>>> others;
  size_t place = 0;
  logging::LogReader reader(run_ + "/run.lcm");
  logging::LogEvent event;
  while (reader.Next(&event)) {
    const bool stop = event.channel == "EMERGENCY_STOP";
    if (stop && stops.empty()) place = others.size();
    (stop ? stops : others)
        .emplace_back(event.channel, std::vector<uint8_t>(event.data.begin(), event.data.end()));
  }
  ASSERT_FALSE(stops.empty());
  for (const int64_t shift : {-600, -60, 60, 600}) {  // events, some ten a tick
    const std::string path = folder_ / fmt::format("shifted{}.lcm", shift);
    logging::EventLogWriter writer(path);
    const auto at = static_cast<size_t>(
        std::clamp<int64_t>(static_cast<int64_t>(place) + shift, 1, std::ssize(others)));
    for (size_t i = 0; i <= others.size(); ++i) {
      if (i == at) {
        for (const auto& [channel, data] : stops) writer.Write(channel, 0, data);
      }
      if (i < others.size()) writer.Write(others[i].first, 0, others[i].second);
    }
    writer.Close();
    const ProgramResult shifted = Replay({"--component", "hw_bridge"}, path);
    EXPECT_EQ(shifted.exit_code, 0) << shift << "\n" << shifted.output;
  }
}

TEST_F(ReplayTest, DamagedRunInfoIsTakenFromTheFolder) {
  Run({"--inline"});
  const auto damage = [](const logging::LogEvent& event, std::vector<uint8_t>* data) {
    if (event.channel == "RUN_INFO") data->resize(data->size() - 100);
    return true;
  };
  const std::string log = Changed(damage);
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"replay", log},
        {"report", log, "--no-html"},
        {"log", "cut", log, "--from", "0.1", "--out", folder_ / "cut.lcm"}}) {
    const ProgramResult refused = RunPoise(arguments);
    EXPECT_EQ(refused.exit_code, 1) << refused.output;
    EXPECT_HAS(refused, "put the run's run_spec.pbtxt and scenario.pbtxt beside the log");
  }
  const ProgramResult csv = RunPoise({"log", "export", log, "--csv", folder_ / "csv"});
  EXPECT_HAS(csv, " messages of ");

  std::filesystem::rename(log, run_ + "/run.lcm");
  const ProgramResult replay = Replay();
  EXPECT_EQ(replay.exit_code, 0) << replay.output;
  EXPECT_HAS(replay, "warning: ");
  EXPECT_HAS(replay, "taken from run_spec.pbtxt beside the log");
  const ProgramResult report = RunPoise({"report", run_, "--no-html"});
  EXPECT_EQ(report.exit_code, 0) << report.output;
  EXPECT_HAS(report, "taken from run_spec.pbtxt beside the log");
  const ProgramResult check = RunPoise({"log", "check", run_});
  EXPECT_EQ(check.exit_code, 1);
  EXPECT_HAS(check, "NOT WHOLE");
  std::filesystem::remove(run_ + "/scenario.pbtxt");
  const ProgramResult no_scenario = RunPoise({"report", run_, "--no-html"});
  EXPECT_EQ(no_scenario.exit_code, 1);
  EXPECT_HAS(no_scenario, "scenario.pbtxt is not beside it");
}

TEST_F(ReplayTest, AlteredBytesAreFoundAndALogWithoutSumsIsStillRead) {
  Run({"--inline"});
  const ProgramResult whole = RunPoise({"log", "check", run_});
  EXPECT_HAS(whole, "whole, and as it was written");
  std::string bytes = ReadAll(run_ + "/run.lcm");
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  std::ofstream(run_ + "/run.lcm", std::ios::binary) << bytes;
  const ProgramResult altered = RunPoise({"log", "check", run_});
  EXPECT_EQ(altered.exit_code, 1);
  EXPECT_HAS(altered, "are not those that were written");
  const ProgramResult report = RunPoise({"report", run_, "--no-html"});
  EXPECT_HAS(report, "are not those that were written");
  std::filesystem::remove(run_ + "/run.lcm.crc32");
  const ProgramResult unknown = RunPoise({"log", "check", run_});
  EXPECT_HAS(unknown, "contents not checked");
}

TEST_F(ReplayTest, InterruptedRunReplaysUpToItsEnd) {
  PoiseProgram program({"run", StandScenario(), "--out", run_, "--duration", "600"});
  ASSERT_TRUE(WaitForLog(run_, 200'000));
  kill(program.pid(), SIGINT);
  program.Wait();
  const ProgramResult result = Replay();
  EXPECT_EQ(result.exit_code, 0) << result.output;
}

TEST_F(ReplayTest, WrongUseIsAnErrorOfUse) {
  Run({"--inline"});
  for (const std::vector<std::string>& flags :
       {std::vector<std::string>{"--component", "redistributer"},
        {"--set", "task_controller.com.kq=1"},
        {"--set", "task_controller.com.kp=many"},
        {"--set", "duration=3"},
        {"--set", "nonsense"},
        {"--speed", "2"},
        {"--to-bus", "--speed", "0"},
        {"--url", "udpm://239.255.76.67:7667?ttl=0"},
        {"--to-bus", "--url", "udpm:nowhere"},
        {"--to-bus", "--out", folder_ / "bus"},
        {"--to-bus", "--component", "redistributor"}}) {
    const ProgramResult result = Replay(flags);
    EXPECT_EQ(result.exit_code, 2) << testing::PrintToString(flags) << result.output;
    EXPECT_EQ(std::count(result.output.begin(), result.output.end(), '\n'), 1) << result.output;
  }
}

TEST_F(ReplayTest, PlaysTheLogOnItsPublicUrlInOrder) {
  Run();  // as processes: the run has ports
  logging::LogReader reader(run_ + "/run.lcm");
  RunSpec spec;
  logging::ReadRunInfo(&reader, "log", &spec);
  BusReceiver receiver(MirrorUrl(spec));
  {
    PoiseProgram program({"replay", run_, "--to-bus"});
    std::map<std::string, int64_t> last;  // tick by channel
    BusReceiver::Packet packet;
    const auto take = [&] {
      while (receiver.Receive(&packet)) {
        const MessageType* type = FindMessageType(ReadInt64(packet.data));
        if (type == nullptr) continue;  // liblcm's self test
        const int64_t tick = ReadInt64(packet.data + type->run_id_offset + 8);
        const std::string channel(packet.channel);
        EXPECT_TRUE(!last.contains(channel) || last[channel] <= tick) << channel;
        last[channel] = tick;
      }
      return last["GROUND_TRUTH"] == 199 && last["JOINT_COMMAND"] == 199;
    };
    EXPECT_TRUE(WaitUntil(take));
    const ProgramResult result = program.Wait();
    EXPECT_EQ(result.exit_code, 0) << result.output;
    EXPECT_HAS(result, "0.398 s of the run");
  }
  // Slowly: Ctrl-C ends it.
  PoiseProgram slow({"replay", run_, "--to-bus", "--speed", "0.001"});
  BusReceiver::Packet packet;
  EXPECT_TRUE(WaitUntil([&] { return receiver.Receive(&packet); }));
  kill(slow.pid(), SIGINT);
  const ProgramResult result = slow.Wait();
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_HAS(result, "interrupted");
}

TEST_F(ReplayTest, APackedLogIsMadeAgainByteForByte) {
  Run({"--inline", "--duration", "0.5"});
  const std::string log = run_ + "/run.lcm", packed = run_ + "/run.packed";
  const std::string bytes = ReadAll(log);
  const std::string info = RunPoise({"log", "info", run_}).output;
  const ProgramResult pack = RunPoise({"log", "pack", run_});
  ASSERT_EQ(pack.exit_code, 0) << pack.output;
  EXPECT_FALSE(std::filesystem::exists(log));
  EXPECT_LT(20 * std::filesystem::file_size(packed), bytes.size());
  // Whoever reads the run gets its log; one that is packed again is the same.
  const ProgramResult again = RunPoise({"log", "info", run_});
  EXPECT_EQ(again.exit_code, 0);
  EXPECT_NE(again.output.find(info), std::string::npos) << again.output;
  EXPECT_EQ(ReadAll(log), bytes);
  const std::string small = ReadAll(packed);
  std::filesystem::remove(packed);
  ASSERT_EQ(RunPoise({"log", "pack", run_, "--keep"}).exit_code, 0);
  EXPECT_EQ(ReadAll(packed), small);
  EXPECT_EQ(ReadAll(log), bytes);
}

TEST_F(ReplayTest, OnlyALogThatComesOutTheSameIsPacked) {
  Run({"--inline", "--duration", "0.2"});
  // One bit of one message, as another build's arithmetic would have it.
  int64_t torque = 0;
  const std::string changed = Changed([&](const logging::LogEvent& event, auto* data) {
    if (event.channel == "JOINT_COMMAND" && ++torque == 30) data->at(100) ^= 1;
    return true;
  });
  ProgramResult result = RunPoise({"log", "pack", changed});
  EXPECT_EQ(result.exit_code, 1) << result.output;
  EXPECT_HAS(result, "make other messages");
  EXPECT_TRUE(std::filesystem::exists(changed));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "changed.packed"));
  std::filesystem::remove(changed);
  torque = 0;
  const std::string cut = Changed([&](const logging::LogEvent& event, auto*) {
    return event.channel != "JOINT_COMMAND" || ++torque != 50;
  });
  EXPECT_EQ(RunPoise({"log", "pack", cut}).exit_code, 1);
  // A packed log that is damaged, anywhere, gives an error or the log.
  ASSERT_EQ(RunPoise({"log", "pack", run_}).exit_code, 0);
  const std::string packed = run_ + "/run.packed", log = run_ + "/run.lcm";
  const std::string bytes = ReadAll(packed);
  std::mt19937 random(TestSeed(1));
  for (int trial = 0; trial < 12; ++trial) {
    std::string damaged = bytes;
    if (trial % 2 == 0)
      damaged.resize(random() % damaged.size());
    else
      damaged[random() % damaged.size()] ^= static_cast<char>(1 + random() % 255);
    std::ofstream(packed, std::ios::binary) << damaged;
    std::filesystem::remove(log);
    result = RunPoise({"log", "info", run_});
    EXPECT_GE(result.exit_code, 0) << "trial " << trial;
    if (std::filesystem::exists(log)) continue;
    EXPECT_EQ(result.exit_code, 1) << result.output;
    EXPECT_HAS(result, "poise: ");
  }
}

}  // namespace
}  // namespace poise
