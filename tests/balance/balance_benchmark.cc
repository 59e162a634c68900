// What a tick spends on the balance mathematics, by stage, over states that differ from call to
// call.
#include <benchmark/benchmark.h>

#include "components/balance/balance_control.h"
#include "components/balance/distribution_ratio.h"
#include "components/balance/redistribution.h"
#include "tests/balance/balance_test_support.h"

namespace poise::balance {
namespace {

// Few enough that inputs are in cache, as they are when the tick has just computed them.
constexpr size_t kStates = 32;

/// Inputs of one tick as the components hand them over.
struct Tick {
  robot::RobotData data;
  Eigen::MatrixXd contact_jacobian;
  Eigen::VectorXd contact_bias;
  StackedTask task, height;
  ContactGeometry geometry;
  Eigen::VectorXd acceleration;
};

std::vector<Tick> MakeTicks(const std::shared_ptr<const robot::RobotModel>& model,
                            const std::array<bool, 2>& in_contact) {
  StateSampler sampler(model, 7);
  WholeBody body(model);
  std::vector<Tick> ticks;
  while (ticks.size() < kStates) {
    if (!body.Update(sampler.Draw(), in_contact)) continue;
    Tick tick{body.data(),     {}, {}, PaperTask(body, in_contact), ComHeight(body),
              body.geometry(), {}};
    body.ContactJacobian(in_contact, &tick.contact_jacobian);
    tick.contact_bias = PaperContact(body, in_contact).gamma.cast<double>();
    tick.acceleration = sampler.Vector(tick.task.jacobian.rows(), 3);
    ticks.push_back(std::move(tick));
  }
  return ticks;
}

enum Stage { kContact, kTask, kHeight, kBalance, kRatio, kAll };

/// Runs the stages from `first` to `last`; what comes before was computed untimed for each state.
void Run(benchmark::State& state, std::shared_ptr<const robot::RobotModel> model, bool two_feet,
         Stage stage) {
  const std::array<bool, 2> in_contact = two_feet ? kDouble : kRight;
  const std::vector<Tick> ticks = MakeTicks(model, in_contact);
  const int k = model->num_joints(), m = two_feet ? 12 : 6, t = two_feet ? 6 : 12;
  struct Work {
    ContactDynamics contact;
    TaskDynamics task, height;
    Eigen::VectorXd torque, wrench;
    BalanceResult result;
  };
  BalanceControl balance(k, 1);
  ContactLimits limits;
  limits.half_length = 1e-3;  // balancing always acts
  limits.half_width = 1e-3;
  std::vector<Work> works;
  works.reserve(kStates);
  for (const Tick& tick : ticks) {
    Work& w =
        works.emplace_back(MakeContactDynamics(*model), TaskDynamics(k, t), TaskDynamics(k, 1),
                           Eigen::VectorXd(k), Eigen::VectorXd(m), BalanceResult{});
    w.contact.Compute(tick.data.mass_matrix, tick.data.bias, tick.data.gravity,
                      tick.contact_jacobian, tick.contact_bias);
    w.task.Compute(w.contact, tick.task.jacobian, tick.task.bias_acceleration);
    w.height.Compute(w.contact, tick.height.jacobian, tick.height.bias_acceleration);
    w.task.TaskTorque(tick.acceleration, w.torque);
    Eigen::VectorXd torque = w.torque;
    balance.Compute(w.contact, w.height, tick.geometry, limits, true, torque, &w.result);
    w.contact.ExpectedWrench(torque, w.wrench);
  }
  Eigen::VectorXd torque(k), shift(k), change(12);
  const auto run = [&](const Tick& tick, Work& w, Stage only) {
    const auto on = [only](Stage s) { return only == s || only == kAll; };
    if (on(kContact)) {
      w.contact.Compute(tick.data.mass_matrix, tick.data.bias, tick.data.gravity,
                        tick.contact_jacobian, tick.contact_bias);
    }
    if (on(kTask)) {
      w.task.Compute(w.contact, tick.task.jacobian, tick.task.bias_acceleration);
      w.task.TaskTorque(tick.acceleration, w.torque);
    }
    if (on(kHeight))
      w.height.Compute(w.contact, tick.height.jacobian, tick.height.bias_acceleration);
    if (on(kBalance)) {
      torque = w.torque;
      balance.Compute(w.contact, w.height, tick.geometry, limits, true, torque, &w.result);
      w.contact.ExpectedWrench(torque, w.wrench);
      benchmark::DoNotOptimize(w.result);
    }
    if (on(kRatio) && two_feet) {
      std::array<Eigen::Isometry3d, 2> foot{tick.geometry.sole[0], tick.geometry.sole[1]};
      for (auto& f : foot) f = w.result.frame_o.inverse(Eigen::Isometry) * f;
      ContactLimits sole{0.9, 0.9, 0.12, 0.05, {}};
      const RatioInterval interval = FeasibleRatio(w.result.resultant, foot, sole, 0.02, 0.98);
      const double eta = SelectRatio(interval, w.result.resultant, foot, sole, 0.02, 0.98);
      const auto share = DistributeResultant(w.result.resultant, foot, eta);
      change.head<6>() = share[0] - w.wrench.head<6>();
      change.tail<6>() = share[1] - w.wrench.tail<6>();
      benchmark::DoNotOptimize(RedistributionTorque(w.contact.contact_jacobian(), change, shift));
    }
    benchmark::DoNotOptimize(torque.data());
    benchmark::ClobberMemory();
  };
  size_t i = 0;
  for (auto _ : state) {
    run(ticks[i], works[i], stage);
    i = (i + 1) % kStates;
  }
}

void Register(const char* name, std::shared_ptr<const robot::RobotModel> (*model)()) {
  constexpr std::array<const char*, 6> kNames{"ContactDynamics",
                                              "TaskDynamics+TaskTorque",
                                              "ComHeight",
                                              "BalanceControl+ExpectedWrench",
                                              "Ratio+Redistribution",
                                              "All"};
  for (const bool two_feet : {true, false}) {
    for (int stage = kContact; stage <= kAll; ++stage) {
      if (stage == kRatio && !two_feet) continue;
      benchmark::RegisterBenchmark((std::string(name) + (two_feet ? "/double/" : "/single/") +
                                    kNames[static_cast<size_t>(stage)])
                                       .c_str(),
                                   [=](benchmark::State& state) {
                                     Run(state, model(), two_feet, static_cast<Stage>(stage));
                                   });
    }
  }
}

}  // namespace
}  // namespace poise::balance

int main(int argc, char** argv) {
  poise::balance::Register("biped", poise::balance::Biped);
  poise::balance::Register("humanoid", poise::balance::Humanoid);
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
