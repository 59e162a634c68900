// A module whose component fails on purpose. POISE_TEST_FAULT says how and when:
//   hang:TICK    its stage loops for ever, at -1 its Configure
//   crash:TICK   SIGSEGV
//   throw:TICK   an exception
//   exit:TICK    exit(0)
//   nan:TICK     an output that is not finite
//   slip:SPEED   SIGSEGV as soon as the base moves faster, m/s
// With POISE_TEST_FAULT_ONCE only where that file is not there yet; the fault makes it.
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <memory>
#include <stdexcept>

#include "components/framework/component_type.h"
#include "components/framework/module_entry.h"
#include "components/messages/robot_resource.h"
#include "poise/external_push_t.hpp"
#include "poise/message_traits.hpp"
#include "poise/robot_state_t.hpp"

namespace {

class Faulty : public poise::Component {
 public:
  void Configure(const poise::ComponentContext& context, poise::Wiring* wiring) override {
    const auto model = poise::LoadRobot(context);
    const char* const fault = std::getenv("POISE_TEST_FAULT");
    if (fault != nullptr) std::sscanf(fault, "%7[a-z]:%lf", kind_, &at_);
    if (std::string_view(kind_) == "hang" && at_ < 0) Hang();
    wiring->AddInput(&robot_state_, "robot_state", poise::JointAndFootCounts(*model));
    wiring->AddOutput(&watched_, "watched", {});
    wiring->AddStage("watch", {&robot_state_}, {&watched_},
                     [this](const poise::Tick& tick) { Watch(tick.index); });
  }

 private:
  void Watch(int64_t tick) {
    const std::string_view kind = kind_;
    const double* const v = robot_state_->base_linear_velocity;
    const bool slips = kind == "slip" && std::hypot(v[0], v[1]) > at_;
    const bool due = slips || (kind != "slip" && static_cast<double>(tick) == at_);
    if (!due || kind.empty()) return;
    if (const char* const once = std::getenv("POISE_TEST_FAULT_ONCE"); once != nullptr) {
      if (access(once, F_OK) == 0) return;
      std::fclose(std::fopen(once, "w"));
    }
    if (kind == "throw") throw std::runtime_error("no reason");
    if (kind == "exit") std::exit(0);
    if (kind == "nan") {
      watched_->force[0] = std::numeric_limits<double>::quiet_NaN();
      return;
    }
    if (kind != "hang") std::raise(SIGSEGV);
    Hang();
  }

  static void Hang() {
    for (std::atomic<bool> go{true}; go.load();) continue;
  }

  poise::Input<poise::robot_state_t> robot_state_;
  poise::Output<poise::external_push_t> watched_;  // all zero, for a replay to compare
  char kind_[8] = {};
  double at_ = -1;
};

}  // namespace

POISE_MODULE {
  poise::AddComponent({"faulty",
                       "fails on purpose",
                       [] { return std::make_unique<Faulty>(); },
                       {},
                       {poise::Reads<poise::robot_state_t>("robot_state"),
                        poise::Writes<poise::external_push_t>("watched")}});
}
