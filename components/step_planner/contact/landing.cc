#include "components/step_planner/contact/landing.h"

#include <algorithm>

namespace poise {
namespace {

// Time constant, s, of the reference's velocity: a search begins and a lowering ends without a
// step.
constexpr double kVelocityTime = 0.05;
// Standard deviations of an observed load that are a touch, and below which it is none.
constexpr double kTouchDeviations = 3, kReleaseDeviations = 1.2;
// Share of observed_load that is contact of a foot that searches. It is slow, so that its load is
// known better, and what the foot's task presses with need not come to all of it.
constexpr double kSearchedShare = 1.0 / 3;
// Share of the press' load that counts as pressed: a sole that lies down rocks between loads.
constexpr double kPressed = 0.8;
// m that a foot rises which found no surface: clear of what it may have touched with its edge.
constexpr double kRetractHeight = 0.05;

}  // namespace

LoadLevels::LoadLevels(const LandingSpec& spec, double deviation, bool searches)
    : touch(std::max(spec.touch_load, kTouchDeviations * deviation)),
      release(std::max(spec.release_load, kReleaseDeviations * deviation)),
      press(spec.press_load) {
  if (deviation <= 0) return;
  touch = std::max(touch, (searches ? kSearchedShare : 1) * spec.observed_load);
  press = std::max(press, 2 * touch);
}

bool TouchDetector::Update(double time, double load, const LoadLevels& levels) {
  const bool touches = touching() ? !(load < levels.release) : load > levels.touch;
  return touching_.Update(time, touches, duration_);
}

void Landing::LiftOff(double z) {
  touch_.Reset(true);
  has_left_ground_ = false;
  state_ = State::kSwing;
  moves_down_ = false;
  end_height_ = z;
}

void Landing::BeginSwing(double z, double rises_until) {
  LiftOff(z);
  touch_.Reset(false);
  has_left_ground_ = true;
  move_end_ = rises_until;
}

bool Landing::BeginMove(double from, double to, double end) {
  if (state_ == State::kRetracted) return false;
  if (state_ == State::kTouching) {
    if (to < from) return false;
    has_left_ground_ = false;
  }
  state_ = State::kSwing;
  moves_down_ = to < from;
  move_end_ = end;
  end_height_ = to;
  return true;
}

void Landing::Release() {
  if (state_ != State::kSearching && state_ != State::kRetracted) return;
  state_ = State::kSwing;
  moves_down_ = false;
  has_left_ground_ = true;
}

void Landing::Measure(double time, double load, double deviation) {
  period_ = TickPeriod(time - time_);
  time_ = time;
  load_ = load;
  levels_ = LoadLevels(spec_, deviation, state_ == State::kSearching);
  const bool before = touch_.touching();
  if (touch_.Update(time, load, levels_) && !before) touched_ = time;
  if (spec_.presses && load < kPressed * spec_.press_load) touched_ = time;
}

bool Landing::confirmed() const {
  if (!touch_.touching()) return false;
  if (state_ == State::kSwing) return !has_left_ground_;
  return state_ == State::kTouching && time_ - touched_ >= spec_.settle - kTimeTolerance;
}

bool Landing::SearchBegins(bool before_touch_down, bool due) const {
  if (!before_touch_down) return false;
  return due || (moves_down_ && time_ >= move_end_ - kTimeTolerance);
}

void Landing::Enter(State state, const PointMotion& reference, const Eigen::Matrix3d& rotation) {
  state_ = state;
  reference_ = reference;
  reference_.acceleration.setZero();
  rotation_ = rotation;
}

void Landing::AdvanceState(bool before_touch_down, bool due, const Eigen::Isometry3d& sole,
                           const PointMotion& reference, const Eigen::Matrix3d& rotation) {
  const bool touching = touch_.touching();
  const bool searches = SearchBegins(before_touch_down, due);
  switch (state_) {
    case State::kSwing:
      has_left_ground_ = has_left_ground_ || !touching;
      // A tap on the way up is left behind by going on.
      if (has_left_ground_ && touching && !Rises()) {
        Enter(State::kTouching, reference, rotation);
      } else if (has_left_ground_ && searches) {
        Enter(State::kSearching, reference, rotation);
      }
      break;
    case State::kSearching: {
      // The reference leads the sole by what friction and load ask for; were the sole held up by
      // something else, it must not run away.
      const double depth = spec_.search_depth;
      if (touching) {
        state_ = State::kTouching;
      } else if (!spec_.retracts) {
        break;
      } else if (sole.translation().z() <= end_height_ - depth ||
                 reference_.position.z() <= end_height_ - 2 * depth) {
        state_ = State::kRetracted;
        retreat_.Begin(reference_, reference_.position + kRetractHeight * Eigen::Vector3d::UnitZ(),
                       time_, kRetractHeight / spec_.search_speed);
      }
      break;
    }
    case State::kTouching:
      // A press searches, too: it goes down while nothing carries.
      if (!touching && !spec_.presses) state_ = searches ? State::kSearching : State::kSwing;
      break;
    case State::kRetracted:
      break;
  }
}

void Landing::Search() {
  const double missing = std::max(1 - load_ / levels_.press, 0.0);
  const Eigen::Vector3d velocity(0, 0, -spec_.search_speed * missing);
  reference_.velocity += Share(kVelocityTime) * (velocity - reference_.velocity);
  reference_.position += period_ * reference_.velocity;
  if (spec_.retracts || reference_.position.z() > Lowest()) return;
  reference_.position.z() = Lowest();
  reference_.velocity.z() = 0;
}

void Landing::Touch(const Eigen::Isometry3d& sole) {
  Eigen::Vector3d share = Eigen::Vector3d::Constant(Share(spec_.relax_time));
  double down = 0;
  if (spec_.presses) {
    share.z() = 0;
    down = std::clamp(1 - load_ / spec_.press_load, -1.0, 1.0);
  } else {
    const double loaded =
        std::clamp((load_ - levels_.release) / (levels_.touch - levels_.release), 0.0, 1.0);
    share.z() *= loaded;
    down = 1 - loaded;
  }
  reference_.position += share.cwiseProduct(sole.translation() - reference_.position);
  double& z = reference_.position.z();
  const double next = z - period_ * spec_.search_speed * down;
  z = spec_.presses ? std::max(next, std::min(z, Lowest())) : next;
  // Not that of the reference's coming back, which would lift the foot.
  reference_.velocity -= Share(std::min(spec_.relax_time, kVelocityTime)) * reference_.velocity;
  rotation_ = Eigen::Quaterniond(rotation_)
                  .slerp(Share(spec_.relax_time), Eigen::Quaterniond(sole.linear()))
                  .toRotationMatrix();
}

bool Landing::Update(bool before_touch_down, bool due, const Eigen::Isometry3d& sole,
                     PointMotion* reference, Eigen::Matrix3d* rotation) {
  AdvanceState(before_touch_down, due, sole, *reference, *rotation);
  switch (state_) {
    case State::kSwing:
      return false;
    case State::kSearching:
      Search();
      break;
    case State::kTouching:
      Touch(sole);
      break;
    case State::kRetracted:
      reference_ = retreat_.At(time_);
      break;
  }
  *reference = reference_;
  *rotation = rotation_;
  return true;
}

void Landing::Archive(StateArchive* archive) {
  archive->Show(touch_, state_, time_, period_, load_, levels_, touched_, has_left_ground_,
                moves_down_, move_end_, end_height_, reference_, rotation_, retreat_);
}

}  // namespace poise
