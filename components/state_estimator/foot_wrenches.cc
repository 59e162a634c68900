#include "components/state_estimator/foot_wrenches.h"

#include <algorithm>

namespace poise {
namespace {

using robot::Foot;
using robot::kFeet;

// Share of the weight by which sensor and observer must differ. A push that turns the joints'
// friction over makes the observer wrong by up to an eighth of it (7.2); no loop is hurt by less.
constexpr double kLeastShare = 0.15;
// Ticks between two observations while all feet have good sensors, to compare them with.
constexpr int kCheckEvery = 4;

}  // namespace

FootWrenches::FootWrenches(std::shared_ptr<const robot::RobotModel> model)
    : observer_(model), least_force_(kLeastShare * model->total_mass() * robot::kGravity) {
  noise_.head<3>().setConstant(model->force_noise());
  noise_.tail<3>().setConstant(model->moment_noise());
  wrench_.fill(robot::Vector6d::Zero());
  deviation_.fill(noise_);
}

void FootWrenches::Update(int64_t tick, double dt, const BaseSensors& sensors,
                          const robot::FootArray<FootReading>& reading,
                          const ObserverCorrection& correction) {
  observer_.Track(sensors, dt);
  since_ += dt;
  for (const Foot f : kFeet) check_[f].Read(reading[f].state, reading[f].wrench, dt);
  const bool needed = !std::ranges::all_of(check_, &FootSensorCheck::good);
  observed_ = (needed || (observer_.torque_known() && tick % kCheckEvery == 0)) &&
              observer_.Observe(correction, needed);
  if (observed_) {
    if (observer_.torque_known()) Compare();
    since_ = 0;
  }
  for (const Foot f : kFeet) {
    if (check_[f].good()) {
      wrench_[f] = reading[f].wrench;
      deviation_[f] = noise_;
    } else {
      const auto at = 6 * static_cast<Eigen::Index>(f);
      wrench_[f] = observer_.wrenches().segment<6>(at);
      deviation_[f] =
          observer_.settled_covariance().diagonal().segment<6>(at).cwiseMax(0).cwiseSqrt();
    }
  }
}

void FootWrenches::Compare() {
  // While something pushes the robot, the observer has the legs alone to go by.
  if (observer_.pushed()) return;
  for (const Foot f : kFeet) {
    const auto at = 6 * static_cast<Eigen::Index>(f);
    check_[f].Compare(observer_.wrenches().segment<6>(at),
                      observer_.covariance().block<6, 6>(at, at), noise_, least_force_, since_);
  }
}

void FootWrenches::Archive(StateArchive* archive) {
  observer_.Archive(archive);
  for (FootSensorCheck& check : check_) check.Archive(archive);
  archive->Show(since_);
}

}  // namespace poise
