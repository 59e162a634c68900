#include "components/framework/module_entry.h"
#include "components/messages/robot_resource.h"
#include "other_flags_messages/message_traits.hpp"
#include "poise/robot_state_t.hpp"
#include "sums.cc"

double Sums_static(const double* values, int size);
double Sums_shared(const double* values, int size);

namespace other_flags {

/// ROBOT_STATE -> SUMS.
class Sums final : public poise::Component {
 public:
  void Configure(const poise::ComponentContext& context, poise::Wiring* wiring) override {
    const auto model = poise::LoadRobot(context);
    wiring->AddInput(&robot_state_, "robot_state", poise::JointAndFootCounts(*model));
    wiring->AddOutput(&sums_, "sums", {});
    wiring->AddStage("sum", {&robot_state_}, {&sums_}, [this](const poise::Tick&) {
      const std::vector<double>& q = robot_state_->joint_position;
      const int size = static_cast<int>(q.size()) - 1;  // odd: not all of it is done in vectors
      sums_->plain = Sums_plain(q.data(), size);
      sums_->of_static = Sums_static(q.data(), size);
      sums_->of_shared = Sums_shared(q.data(), size);
    });
  }
  bool Archive(poise::StateArchive*) override { return true; }

 private:
  poise::Input<poise::robot_state_t> robot_state_;
  poise::Output<sums_t> sums_;
};

}  // namespace other_flags

POISE_MODULE {
  poise::AddComponent(
      {"sums",
       "a sum, by code of different compiler flags",
       [] { return std::make_unique<other_flags::Sums>(); },
       {},
       {poise::Reads<poise::robot_state_t>("robot_state"),
        poise::Writes<other_flags::sums_t>("sums")}});
}
