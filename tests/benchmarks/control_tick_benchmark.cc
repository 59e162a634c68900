// One control tick in one process, estimator to joint command, over 10,000 states that all differ.
// `--robot FILE`, as often as there are robots: Robot files beside those of the tests.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "components/messages/conversions.h"
#include "tests/components/control_tick.h"

namespace poise {
namespace {

constexpr int kNumStates = 10000;
using Clock = std::chrono::steady_clock;

double Microseconds(Clock::time_point from, Clock::time_point to) {
  return std::chrono::duration<double, std::micro>(to - from).count();
}

class Samples {
 public:
  explicit Samples(std::string name) : name_(std::move(name)) { values_.reserve(kNumStates); }
  void Add(double value) { values_.push_back(value); }
  void Report(benchmark::State* state) {
    std::sort(values_.begin(), values_.end());
    const auto at = [&](double share) {
      return values_[static_cast<size_t>(share * static_cast<double>(values_.size() - 1))];
    };
    state->counters[name_ + "_median_us"] = at(0.5);
    state->counters[name_ + "_p99_us"] = at(0.99);
  }

 private:
  std::string name_;
  std::vector<double> values_;
};

Contacts ContactsFor(bool both) { return {true, both}; }

/// Made once for each robot; null, and the benchmark is marked, for one that cannot sway so.
const std::vector<robot_sensors_t>* Sensors(const robot::RobotModel& model, bool both,
                                            benchmark::State* state) {
  static std::map<std::pair<std::string, bool>, std::vector<robot_sensors_t>> made;
  auto [at, added] = made.try_emplace({model.name(), both});
  try {
    if (added) at->second = SwayingSensors(model, ContactsFor(both), kNumStates);
  } catch (const std::exception&) {
    at->second.clear();
  }
  if (!at->second.empty()) return &at->second;
  state->SkipWithError("the robot cannot sway as this benchmark asks of it");
  return nullptr;
}

// The whole tick, the clock read at its ends only.
void Tick(benchmark::State& state, const std::string& robot, bool both) {
  ControlTick control(robot, ContactsFor(both));
  const auto* sensors = Sensors(control.model(), both, &state);
  if (sensors == nullptr) return;
  Samples total("tick");
  int tick = 0, failed = 0, balancing = 0;
  for (auto _ : state) {
    const robot_sensors_t& input = (*sensors)[static_cast<size_t>(tick)];
    const poise::Tick now = TickAt(tick);
    const Clock::time_point start = Clock::now();
    control.Run(input, now);
    const Clock::time_point end = Clock::now();
    state.SetIterationTime(1e-6 * Microseconds(start, end));
    total.Add(Microseconds(start, end));
    failed += control.task().status != task_torque_t::STATUS_OK ? 1 : 0;
    balancing += control.balance().active_x != 0 || control.balance().active_y != 0 ? 1 : 0;
    tick = (tick + 1) % kNumStates;
  }
  if (failed > 0) state.SkipWithError("a tick had no valid torque");
  total.Report(&state);
  state.counters["balancing_share"] = static_cast<double>(balancing) / kNumStates;
}

// The same with the clock read between the stages; the shared dynamics are asked for first, so that
// no stage pays for them.
void Split(benchmark::State& state, const std::string& robot, bool both) {
  const Contacts in_contact = ContactsFor(both);
  ControlTick control(robot, in_contact);
  const auto* sensors = Sensors(control.model(), both, &state);
  if (sensors == nullptr) return;
  robot::RobotState estimated(control.model().num_joints());
  robot::RobotData data(control.model());
  Samples estimator("estimator"), kinematics("kinematics"), dynamics("dynamics"),
      contact("contact_dynamics"), planner("planner"), task("task"), monitor("monitor"),
      redistributor("redistributor");
  int tick = 0;
  for (auto _ : state) {
    const robot_sensors_t& input = (*sensors)[static_cast<size_t>(tick)];
    const poise::Tick now = TickAt(tick);
    const Clock::time_point t0 = Clock::now();
    control.Estimate(input, now);
    const Clock::time_point t1 = Clock::now();
    ReadState(control.state(), &estimated);
    // Dynamics on data of its own, to know its part of the update below.
    robot::ComputeKinematics(control.model(), estimated, &data);
    robot::ComputeFeet(control.model(), &data);
    const Clock::time_point t2 = Clock::now();
    robot::ComputeDynamics(control.model(), estimated, &data);
    const Clock::time_point t3 = Clock::now();
    control.whole_body()->Update(estimated, in_contact);
    const Clock::time_point t4 = Clock::now();
    control.Plan(now);
    const Clock::time_point t5 = Clock::now();
    control.Task(now);
    const Clock::time_point t6 = Clock::now();
    control.Monitor(now);
    const Clock::time_point t7 = Clock::now();
    control.Redistribute(now);
    const Clock::time_point t8 = Clock::now();
    state.SetIterationTime(1e-6 * (Microseconds(t0, t1) + Microseconds(t3, t8)));
    estimator.Add(Microseconds(t0, t1));
    kinematics.Add(Microseconds(t1, t2));
    dynamics.Add(Microseconds(t2, t3));
    contact.Add(std::max(0.0, Microseconds(t3, t4) - Microseconds(t1, t3)));
    planner.Add(Microseconds(t4, t5));
    task.Add(Microseconds(t5, t6));
    monitor.Add(Microseconds(t6, t7));
    redistributor.Add(Microseconds(t7, t8));
    tick = (tick + 1) % kNumStates;
  }
  for (Samples* samples :
       {&estimator, &kinematics, &dynamics, &contact, &planner, &task, &monitor, &redistributor}) {
    samples->Report(&state);
  }
}

void Register(const std::string& name, const std::string& robot) {
  for (const bool split : {false, true}) {
    for (const bool both : {true, false}) {
      const std::string title =
          std::string(split ? "Split/" : "Tick/") + name + (both ? "_double" : "_single");
      benchmark::RegisterBenchmark(
          title.c_str(),
          [=](benchmark::State& state) { (split ? Split : Tick)(state, robot, both); })
          ->Iterations(kNumStates)
          ->UseManualTime()
          ->Unit(benchmark::kMicrosecond);
    }
  }
}

}  // namespace
}  // namespace poise

int main(int argc, char** argv) {
  poise::Register("dyros", poise::robot::RobotPath(poise::robot::TestRobot::kDyros));
  poise::Register("mantis", poise::robot::RobotPath(poise::robot::TestRobot::kMantis));
  poise::Register("heron", POISE_SOURCE_DIR "/deploy/robots/heron/heron.pbtxt");
  int left = 1;
  for (int i = 1; i < argc; ++i) {
    if (std::string_view(argv[i]) == "--robot" && i + 1 < argc) {
      const std::filesystem::path path = argv[++i];
      poise::Register(path.stem().string(), path.string());
    } else {
      argv[left++] = argv[i];
    }
  }
  argc = left;
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
}
