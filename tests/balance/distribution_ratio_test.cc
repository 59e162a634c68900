// The interval of η against brute force over a grid of η, each foot checked in its own sole frame.
#include "components/balance/distribution_ratio.h"

#include <gtest/gtest.h>

#include <random>

#include "components/balance/contact_transition.h"
#include "components/balance/minimum_jerk.h"
#include "tests/test_seed.h"

namespace poise::balance {
namespace {

constexpr int kGrid = 4000;
constexpr double kEtaMin = 0.02, kEtaMax = 0.98;
const ContactLimits kSole{0.9, 0.9, 0.12, 0.05, {}};

class Random {
 public:
  explicit Random(unsigned seed) : engine_(TestSeed(seed)) {}
  double operator()(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }

 private:
  std::mt19937_64 engine_;
};

/// A resultant whose CoP lies mostly between the feet, sometimes outside.
Vector6d RandomResultant(Random& random) {
  Vector6d w;
  w(2) = -random(50, 800);
  w(0) = random(-0.5, 0.5) * w(2);
  w(1) = random(-0.5, 0.5) * w(2);
  w(3) = random(-0.2, 0.2) * w(2);
  w(4) = random(-0.15, 0.15) * w(2);
  w(5) = random(-0.3, 0.3) * w(2);
  return w;
}

/// Conditions (29)–(33) of both feet, straight from their wrenches; the smallest margin.
double LeastMargin(const Vector6d& resultant, const std::array<Eigen::Isometry3d, 2>& foot,
                   double eta) {
  double least = HUGE_VAL;
  for (const Vector6d& w : DistributeResultant(resultant, foot, eta)) {
    const ContactMargins m = CheckContact(w, kSole);
    least = std::min({least, m.normal, m.friction, m.yaw, m.roll, m.pitch});
  }
  return least;
}

struct Tally {
  int feasible = 0, infeasible = 0;
};

void CompareWithBruteForce(const Vector6d& resultant, const std::array<Eigen::Isometry3d, 2>& foot,
                           const RatioInterval& interval, Tally* tally) {
  const double step = (kEtaMax - kEtaMin) / kGrid;
  double first = 2, last = -1;
  for (int i = 0; i <= kGrid; ++i) {
    const double eta = kEtaMin + step * i;
    if (LeastMargin(resultant, foot, eta) <= 0) continue;
    first = std::min(first, eta);
    last = std::max(last, eta);
  }
  if (last < 0) {
    // Nothing on the grid: at most an interval narrower than the grid's step.
    ++tally->infeasible;
    EXPECT_TRUE(!interval.feasible || interval.max - interval.min < step * 1.0001);
    return;
  }
  ++tally->feasible;
  ASSERT_TRUE(interval.feasible) << interval.limiting_condition;
  EXPECT_LE(interval.min, first);
  EXPECT_GE(interval.max, last);
  EXPECT_GT(interval.min, first - step * 1.0001);
  EXPECT_LT(interval.max, last + step * 1.0001);
}

std::array<Eigen::Isometry3d, 2> LevelFeet(double distance) {
  std::array<Eigen::Isometry3d, 2> foot{Eigen::Isometry3d::Identity(),
                                        Eigen::Isometry3d::Identity()};
  foot[0].translation() << 0, -distance / 2, 0;
  foot[1].translation() << 0, distance / 2, 0;
  return foot;
}

TEST(FeasibleRatio, AgreesWithBruteForceOnParallelFeet) {
  Random random(1);
  Tally tally;
  for (int i = 0; i < 1000; ++i) {
    auto foot = LevelFeet(random(0.15, 0.4));
    // Any position of parallel feet, as the appendix has it: O need not lie midway.
    for (auto& f : foot)
      f.translation() += Eigen::Vector3d(random(-0.1, 0.1), random(-0.05, 0.05), random(-0.1, 0.1));
    const Vector6d resultant = RandomResultant(random);
    const RatioInterval interval = FeasibleRatio(
        resultant, std::array<Eigen::Vector3d, 2>{foot[0].translation(), foot[1].translation()},
        kSole, kEtaMin, kEtaMax);
    CompareWithBruteForce(resultant, foot, interval, &tally);
    const RatioInterval same = FeasibleRatio(resultant, foot, kSole, kEtaMin, kEtaMax);
    EXPECT_EQ(interval.feasible, same.feasible);
    EXPECT_EQ(interval.min, same.min);
    EXPECT_EQ(interval.max, same.max);
  }
  EXPECT_GT(tally.feasible, 200);
  EXPECT_GT(tally.infeasible, 200);
}

TEST(FeasibleRatio, AgreesWithBruteForceOnTiltedFeet) {
  Random random(2);
  Tally tally;
  for (int i = 0; i < 1000; ++i) {
    auto foot = LevelFeet(random(0.15, 0.4));
    for (auto& f : foot) {
      f.translation().z() = random(-0.1, 0.1);
      f.linear() = (Eigen::AngleAxisd(random(-0.5, 0.5), Eigen::Vector3d::UnitZ()) *
                    Eigen::AngleAxisd(random(-0.2, 0.2), Eigen::Vector3d::UnitY()) *
                    Eigen::AngleAxisd(random(-0.2, 0.2), Eigen::Vector3d::UnitX()))
                       .toRotationMatrix();
    }
    const Vector6d resultant = RandomResultant(random);
    CompareWithBruteForce(resultant, foot, FeasibleRatio(resultant, foot, kSole, kEtaMin, kEtaMax),
                          &tally);
  }
  EXPECT_GT(tally.feasible, 150);
  EXPECT_GT(tally.infeasible, 200);
}

TEST(FeasibleRatio, ConstantMomentsHoldForEveryRatioOrNone) {
  // Side by side without horizontal force: M_y and M_z do not depend on η.
  const auto foot = LevelFeet(0.2);
  Vector6d resultant;
  resultant << 0, 0, -500, 0, 0.119 * 500, 0;
  RatioInterval interval = FeasibleRatio(resultant, foot, kSole, kEtaMin, kEtaMax);
  ASSERT_TRUE(interval.feasible);
  // |M_x| < 0.05·500 with a = 0.2·F_z, b = −0.1·F_z: η within a quarter of the middle.
  EXPECT_NEAR(interval.min, 0.25, 1e-12);
  EXPECT_NEAR(interval.max, 0.75, 1e-12);
  EXPECT_NEAR(interval.optimal, 0.5, 1e-12);
  resultant(4) = 0.121 * 500;  // beyond the toes: no η helps
  interval = FeasibleRatio(resultant, foot, kSole, kEtaMin, kEtaMax);
  EXPECT_FALSE(interval.feasible);
  EXPECT_STREQ(interval.limiting_condition, "pitch");
}

TEST(FeasibleRatio, NamesWhatLeavesNoRatio) {
  const auto foot = LevelFeet(0.2);
  const auto limiting = [&](const Vector6d& w) {
    const RatioInterval interval = FeasibleRatio(w, foot, kSole, kEtaMin, kEtaMax);
    EXPECT_FALSE(interval.feasible);
    return std::string(interval.limiting_condition == nullptr ? "" : interval.limiting_condition);
  };
  Vector6d w;
  w << 0, 0, 10, 0, 0, 0;
  EXPECT_EQ(limiting(w), "normal");
  w << 0, 0, 0, 0, 0, 0;
  EXPECT_EQ(limiting(w), "normal");
  w << 600, 0, -500, 0, 0, 0;
  EXPECT_EQ(limiting(w), "friction");
  w << 0, 0, -500, 0.2 * -500, 0, 0;  // CoP 0.2 m to the left, feet end at 0.15 m
  EXPECT_EQ(limiting(w), "roll");
  w << 0, 0, -500, 0, 0, 460;
  EXPECT_EQ(limiting(w), "yaw");
  for (int i = 0; i < 6; ++i) {
    w << 0, 0, -500, 0, 0, 0;
    w(i) = std::nan("");
    EXPECT_NE(limiting(w), "");
    const RatioInterval interval = FeasibleRatio(w, foot, kSole, kEtaMin, kEtaMax);
    const double eta = SelectRatio(interval, w, foot, kSole, kEtaMin, kEtaMax);
    EXPECT_GE(eta, kEtaMin);
    EXPECT_LE(eta, kEtaMax);
  }
  w << 0, 0, -500, 0, 0, 0;
  EXPECT_FALSE(FeasibleRatio(w, foot, kSole, std::nan(""), kEtaMax).feasible);
  EXPECT_FALSE(FeasibleRatio(w, foot, kSole, kEtaMin, std::nan("")).feasible);
  EXPECT_FALSE(FeasibleRatio(w, foot, kSole, 0.6, 0.4).feasible);
  auto broken = foot;
  broken[1].translation().x() = std::nan("");
  EXPECT_FALSE(FeasibleRatio(w, broken, kSole, kEtaMin, kEtaMax).feasible);
}

TEST(SelectRatio, OptimumLeavesNoRollMomentOnEitherFoot) {
  Random random(3);
  for (int i = 0; i < 1000; ++i) {
    auto foot = LevelFeet(random(0.15, 0.4));
    for (auto& f : foot) f.translation().z() += random(-0.1, 0.1);
    const Vector6d resultant = RandomResultant(random);
    const RatioInterval interval = FeasibleRatio(resultant, foot, kSole, kEtaMin, kEtaMax);
    for (const Vector6d& share : DistributeResultant(resultant, foot, interval.optimal)) {
      EXPECT_NEAR(share(3), 0, 1e-9 * (1 + std::abs(interval.optimal)) * resultant.norm());
    }
    if (!interval.feasible) continue;
    const double eta = SelectRatio(interval, resultant, foot, kSole, kEtaMin, kEtaMax);
    EXPECT_GE(eta, interval.min);
    EXPECT_LE(eta, interval.max);
    EXPECT_EQ(eta, std::clamp(interval.optimal, interval.min, interval.max));
  }
}

TEST(SelectRatio, InfeasibleMinimisesTheLargestViolation) {
  Random random(4);
  int checked = 0;
  for (int i = 0; i < 2000; ++i) {
    auto foot = LevelFeet(random(0.15, 0.4));
    for (auto& f : foot)
      f.translation() += Eigen::Vector3d(random(-0.1, 0.1), 0, random(-0.1, 0.1));
    const Vector6d resultant = RandomResultant(random);
    const RatioInterval interval = FeasibleRatio(resultant, foot, kSole, kEtaMin, kEtaMax);
    if (interval.feasible || std::string(interval.limiting_condition) == "friction") continue;
    ++checked;
    // Violation per unit of load share, from the right foot's wrench.
    const auto violation = [&](double eta) {
      const Vector6d w = DistributeResultant(resultant, foot, eta)[0] / eta;
      return std::max({std::abs(w(3)) - kSole.half_width * std::abs(w(2)),
                       std::abs(w(4)) - kSole.half_length * std::abs(w(2)),
                       std::abs(w(5)) - kSole.yaw_friction * std::abs(w(2))});
    };
    double least = HUGE_VAL;
    for (int j = 0; j <= kGrid; ++j)
      least = std::min(least, violation(kEtaMin + (kEtaMax - kEtaMin) * j / kGrid));
    // N·m: a millimetre of centre of pressure.
    EXPECT_LE(violation(SelectRatio(interval, resultant, foot, kSole, kEtaMin, kEtaMax)),
              least + 1e-3 * resultant.head<3>().norm() + 1e-9);
  }
  EXPECT_GT(checked, 300);
}

// The push of 7.2 from behind: beyond the toes every ratio lacks the same, and the best of them is
// the noise's.
TEST(SelectRatio, InfeasibleDoesNotJumpWithNoise) {
  Random random(6);
  for (int i = 0; i < 1000; ++i) {
    auto foot = LevelFeet(0.21);
    for (auto& f : foot) f.translation().x() += random(-1e-4, 1e-4);
    Vector6d resultant;
    resultant << random(-60, -58), 0, -540, random(-1, 1), 0.13 * 540, random(-0.1, 0.1);
    const RatioInterval interval = FeasibleRatio(resultant, foot, kSole, kEtaMin, kEtaMax);
    ASSERT_STREQ(interval.limiting_condition, "pitch");
    // CoP in the middle, to 2 mm of the soles' 0.21 m.
    EXPECT_NEAR(SelectRatio(interval, resultant, foot, kSole, kEtaMin, kEtaMax), 0.5, 0.01);
  }
}

TEST(DistributeResultant, SharesAddUpToTheResultant) {
  Random random(5);
  for (int i = 0; i < 1000; ++i) {
    auto foot = LevelFeet(0.2);
    for (auto& f : foot) {
      f.translation() += Eigen::Vector3d(random(-1, 1), random(-1, 1), random(-1, 1));
      f.linear() = Eigen::Quaterniond(random(-1, 1), random(-1, 1), random(-1, 1), random(0.1, 1))
                       .normalized()
                       .toRotationMatrix();
    }
    const Vector6d resultant = RandomResultant(random);
    const double eta = random(-1, 2);
    const auto share = DistributeResultant(resultant, foot, eta);
    Vector6d sum = Vector6d::Zero();
    for (size_t j = 0; j < 2; ++j) {
      const Eigen::Vector3d force = foot[j].linear() * share[j].head<3>();
      sum.head<3>() += force;
      sum.tail<3>() += foot[j].linear() * share[j].tail<3>() + foot[j].translation().cross(force);
    }
    EXPECT_LT((sum - resultant).norm(), 1e-11 * (1 + resultant.norm()));
    // (61): the right foot's part of the whole force.
    EXPECT_LT((foot[0].linear() * share[0].head<3>() - eta * resultant.head<3>()).norm(), 1e-10);
  }
}

TEST(ContactTransition, RampsEndExactlyAndNeverTurnBack) {
  EXPECT_EQ(SmoothStep(-1), 0);
  EXPECT_EQ(SmoothStep(0), 0);
  EXPECT_EQ(SmoothStep(0.5), 0.5);
  EXPECT_EQ(SmoothStep(1), 1);
  EXPECT_EQ(SmoothStep(7), 1);
  EXPECT_EQ(SmoothStep(std::nan("")), 0);
  // Slope and curvature vanish at both ends: the step departs from them as s³.
  EXPECT_NEAR(SmoothStep(1e-3), 1e-8, 2e-11);
  EXPECT_NEAR(1 - SmoothStep(1 - 1e-3), 1e-8, 2e-11);
  for (const Foot foot : kFeet) {
    const double empty = foot == Foot::kRight ? 0 : 1;
    EXPECT_EQ(TransitionRatio(0.37, foot, true, 0), 0.37);
    EXPECT_EQ(TransitionRatio(0.37, foot, true, 1), empty);
    EXPECT_EQ(TransitionRatio(0.37, foot, false, 0), empty);
    EXPECT_EQ(TransitionRatio(0.37, foot, false, 1), 0.37);
    const double direction = empty - 0.37;
    for (int i = 0; i < 1000; ++i) {
      const double s = i / 1000.0, t = (i + 1) / 1000.0;
      EXPECT_GE(
          (TransitionRatio(0.37, foot, true, t) - TransitionRatio(0.37, foot, true, s)) * direction,
          0);
      EXPECT_LE((TransitionRatio(0.37, foot, false, t) - TransitionRatio(0.37, foot, false, s)) *
                    direction,
                0);
    }
  }
}

TEST(ContactTransition, AtTheEndTheFootCarriesNothing) {
  Random random(6);
  const auto foot = LevelFeet(0.21);
  const Vector6d resultant = RandomResultant(random);
  for (const Foot empty : kFeet) {
    const double ratio = TransitionRatio(0.4, empty, true, 1);
    EXPECT_EQ(DistributeResultant(resultant, foot, ratio)[empty].norm(), 0);
  }
}

}  // namespace
}  // namespace poise::balance
