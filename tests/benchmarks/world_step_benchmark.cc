// A step of the simulated robot in each engine: standing on both feet with friction and rotors,
// held by a spring and a damper at each joint. `--robot FILE`, as often as there are robots: Robot
// files beside the paper's.
#include <benchmark/benchmark.h>

#include <string>
#include <vector>

#include "sim_mujoco/mujoco_world.h"
#include "sim_ode/ode_world.h"
#include "tests/sim/simulation_fixture.h"

namespace poise {
namespace {

void Step(benchmark::State& state, const robot::RobotModel& model, const WorldFactory& worlds) {
  SimConfig config;
  config.set_step(1e-3);
  Simulation simulation(model, config, worlds, kTick, 1);
  const PostureHolder holder(simulation);
  int steps = 0;
  for (auto _ : state) {
    if (steps++ % 2 == 0) holder.Apply(&simulation);
    simulation.Step();
  }
  if (simulation.fallen()) state.SkipWithError(std::string(simulation.end_reason()).c_str());
}

void Register(const robot::RobotModel& model) {
  const auto add = [&](const std::string& engine, const WorldFactory& worlds) {
    benchmark::RegisterBenchmark(
        (engine + "/" + model.name() + "/" + std::to_string(model.num_joints())).c_str(),
        [&model, worlds](benchmark::State& state) { Step(state, model, worlds); })
        ->Unit(benchmark::kMicrosecond)
        ->Iterations(5000);
  };
  add("ode", OdeWorlds(OdeConfig()));
  add("mujoco", MujocoWorlds(MujocoConfig()));
}

}  // namespace
}  // namespace poise

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  std::vector<poise::robot::RobotModel> models = {poise::PaperRobot()};
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::string(argv[i]) != "--robot") break;
    models.push_back(poise::robot::LoadRobotFiles(argv[i + 1]));
  }
  for (const auto& model : models) poise::Register(model);
  benchmark::RunSpecifiedBenchmarks();
}
