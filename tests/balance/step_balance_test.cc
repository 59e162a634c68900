#include "components/balance/step/step_balance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "components/balance/contact_conditions.h"
#include "components/balance/support_polygon.h"
#include "components/balance/task_dynamics.h"
#include "tests/balance/balance_test_support.h"

namespace poise::balance {
namespace {

constexpr double kFriction = 0.8, kLeastLoad = 30;
constexpr std::array<std::array<bool, 2>, 3> kContacts{kDouble, kRight, kLeft};

// How far `wrench` (ground on sole) is from any that forces at the corners can give, each within
// the pyramid of faces friction/√2: nonnegative least squares by coordinate descent, N and N·m.
double FarFromCornerForces(const ConvexPolygon& sole, double friction, const Vector6d& wrench) {
  std::vector<Vector6d> ray;
  const double mu = friction / std::sqrt(2.0);
  for (const Eigen::Vector2d& corner : sole.corners()) {
    for (const double x : {mu, -mu}) {
      for (const double y : {mu, -mu}) {
        const Eigen::Vector3d force(x, y, 1), at(corner.x(), corner.y(), 0);
        Vector6d own;
        own << force, at.cross(force);
        ray.push_back(own);
      }
    }
  }
  // Moments count as at 0.1 m.
  const Vector6d unit = (Vector6d() << 1, 1, 1, 10, 10, 10).finished();
  std::vector<double> share(ray.size(), 0);
  Vector6d left = unit.cwiseProduct(wrench);
  for (Vector6d& own : ray) own = unit.cwiseProduct(own);
  for (int round = 0; round < 20000; ++round) {
    for (size_t i = 0; i < ray.size(); ++i) {
      const double next = std::max(0.0, share[i] + ray[i].dot(left) / ray[i].squaredNorm());
      left -= (next - share[i]) * ray[i];
      share[i] = next;
    }
  }
  return left.norm();
}

struct Case {
  Case(const std::shared_ptr<const robot::RobotModel>& model, const robot::RobotState& state,
       const std::array<bool, 2>& in_contact)
      : body(model), balance(model->num_joints(), 7) {
    ok = body.Update(state, in_contact);
    bounds.in_contact = in_contact;
    bounds.sole = body.geometry().sole;
    ok = ok && FrameO(bounds.sole, in_contact, &bounds.frame_o);
    std::array<ConvexPolygon, 2> sole;
    for (size_t f = 0; f < 2; ++f) {
      sole[f] = Rectangle({0.08, 0.04});
      bounds.foot[f] = {sole[f], kFriction, kLeastLoad};
    }
    bounds.region = SupportPolygon(bounds.frame_o, body.geometry(), sole);
    effort = Eigen::VectorXd::Constant(model->num_joints(), 1e5);
    none.resize(0, model->num_velocities());
    no_weight.resize(0);
  }
  bool Compute(Eigen::VectorXd* torque, Movers movers = Movers::kAllJoints) {
    return balance.Compute(body.contact(), bounds, {none, no_weight}, effort, movers, *torque,
                           &result);
  }
  Eigen::VectorXd Acceleration(const Eigen::VectorXd& torque) const {
    Eigen::VectorXd acceleration(torque.size() + 6);
    body.contact().Acceleration(torque, acceleration);
    return acceleration;
  }

  WholeBody body;
  StepBalance balance;
  StepBounds bounds;
  StepBalance::Result result;
  Eigen::VectorXd effort, no_weight;
  Eigen::MatrixXd none;
  bool ok = false;
};

TEST(StepBalance, TheWrenchesAreThoseThatForcesAtTheSolesCornersCanGive) {
  int changed = 0;
  for (const auto& model : {Biped(), Humanoid()}) {
    StateSampler sampler(model, 71);
    for (int trial = 0; trial < 30; ++trial) {
      const std::array<bool, 2>& in_contact = kContacts[static_cast<size_t>(trial) % 3];
      Case c(model, sampler.Draw(), in_contact);
      if (!c.ok) continue;
      Eigen::VectorXd torque = sampler.Vector(model->num_joints(), 100);
      ASSERT_TRUE(c.Compute(&torque));
      changed += c.result.changed ? 1 : 0;
      Eigen::VectorXd wrench(c.body.contact().num_contact_rows());
      c.body.contact().ExpectedWrench(torque, wrench);
      Eigen::Index row = 0;
      Vector6d resultant = Vector6d::Zero();
      for (size_t f = 0; f < 2; ++f) {
        if (!in_contact[f]) continue;
        const Vector6d own = wrench.segment<6>(row);
        row += 6;
        EXPECT_LT((own - c.result.wrench[f]).norm(), 1e-6 * (1 + own.norm()));
        EXPECT_LT(own[2], -kLeastLoad + 1e-4);
        EXPECT_LT(FarFromCornerForces(c.bounds.foot[f].sole, kFriction, -own),
                  1e-3 * (1 + own.norm()));
        resultant += WrenchTransform(c.bounds.frame_o, c.bounds.sole[f]) * own;
      }
      EXPECT_GT(SignedDistance(c.bounds.region, CenterOfPressure(resultant)), -1e-6);
    }
  }
  EXPECT_GT(changed, 50);
}

// What keeps (29) to (33) with a moment that (31) allows for any robot spins a sole of some
// centimetres: the bound is that of forces at its corners, in both directions.
TEST(StepBalance, TheMomentAboutTheVerticalIsBoundAsSharplyAsTheCornersAllow) {
  const auto model = Biped();
  StateSampler sampler(model, 72);
  int bound = 0;
  for (int trial = 0; trial < 12; ++trial) {
    Case c(model, sampler.Draw(), kRight);
    if (!c.ok) continue;
    Eigen::VectorXd torque = sampler.Vector(model->num_joints(), 300);
    ASSERT_TRUE(c.Compute(&torque));
    Vector6d own = -c.result.wrench[0];
    if (!c.result.changed || FarFromCornerForces(c.bounds.foot[0].sole, kFriction, own) > 0.1) {
      continue;
    }
    // At least one bound is tight: somewhat less friction cannot give the wrench, or the centre of
    // pressure is on the edge.
    const double far = FarFromCornerForces(c.bounds.foot[0].sole, 0.95 * kFriction, own);
    const double edge = SignedDistance(c.bounds.foot[0].sole, CenterOfPressure(own));
    EXPECT_TRUE(far > 1e-3 || edge < 1e-6 || own[2] < kLeastLoad + 1e-3) << far << " " << edge;
    ++bound;
  }
  EXPECT_GT(bound, 6);
}

TEST(StepBalance, ATorqueThatKeepsAllBoundsStaysAsItIs) {
  const auto model = Humanoid();
  StateSampler sampler(model, 73);
  for (const auto& in_contact : kContacts) {
    Case c(model, sampler.Draw(), in_contact);
    ASSERT_TRUE(c.ok);
    Eigen::VectorXd torque = sampler.Vector(model->num_joints(), 100);
    ASSERT_TRUE(c.Compute(&torque));
    const Eigen::VectorXd once = torque;
    // Inside by more than what the solution is off by.
    for (SoleBounds& foot : c.bounds.foot) {
      foot.friction *= 1.01;
      foot.least_load *= 0.99;
      foot.sole = Rectangle({0.081, 0.041});
    }
    for (Eigen::Vector2d& corner : c.bounds.region.mutable_corners()) corner *= 1.01;
    ASSERT_TRUE(c.Compute(&torque));
    EXPECT_FALSE(c.result.changed);
    EXPECT_EQ(torque, once);
  }
}

// Gauss: the change of the acceleration, measured by the mass matrix, is the least of all that keep
// the bounds. Others that keep them are found by holding some motion or other.
TEST(StepBalance, TheChangeIsTheLeastByGaussPrinciple) {
  for (const auto& model : {Biped(), Humanoid()}) {
    StateSampler sampler(model, 74);
    int compared = 0;
    for (int trial = 0; trial < 10; ++trial) {
      Case c(model, sampler.Draw(), trial % 2 == 0 ? kRight : kLeft);
      if (!c.ok) continue;
      const Eigen::VectorXd start = sampler.Vector(model->num_joints(), 100);
      const Eigen::VectorXd before = c.Acceleration(start);
      const auto cost = [&](const Eigen::VectorXd& torque) {
        const Eigen::VectorXd change = c.Acceleration(torque) - before;
        return change.dot(c.body.data().mass_matrix * change);
      };
      Eigen::VectorXd best = start;
      ASSERT_TRUE(c.Compute(&best));
      for (int other = 0; other < 5; ++other) {
        const Eigen::MatrixXd rows = Eigen::MatrixXd::NullaryExpr(
            3, model->num_velocities(), [&] { return sampler.Uniform(-1, 1); });
        const Eigen::VectorXd weight = Eigen::VectorXd::Constant(3, sampler.Uniform(1, 100));
        Eigen::VectorXd torque = start;
        ASSERT_TRUE(c.balance.Compute(c.body.contact(), c.bounds, {rows, weight}, c.effort,
                                      Movers::kAllJoints, torque, &c.result));
        EXPECT_GT(cost(torque), cost(best) * (1 - 1e-6));
        // And what is held changes less than where it is not.
        const Eigen::VectorXd held = c.Acceleration(torque) - before;
        const Eigen::VectorXd free = c.Acceleration(best) - before;
        EXPECT_LT((rows * held).norm(), (rows * free).norm() * (1 + 1e-6));
        ++compared;
      }
    }
    EXPECT_GT(compared, 20);
  }
}

TEST(StepBalance, WithTheLegsAloneAllOtherJointsKeepTheirAccelerations) {
  const auto model = Humanoid();
  StateSampler sampler(model, 75);
  for (const auto& in_contact : kContacts) {
    Case c(model, sampler.Draw(), in_contact);
    ASSERT_TRUE(c.ok);
    Eigen::VectorXd torque = sampler.Vector(model->num_joints(), 100);
    const Eigen::VectorXd before = c.Acceleration(torque);
    ASSERT_TRUE(c.Compute(&torque, Movers::kLegs));
    ASSERT_TRUE(c.result.changed);
    Eigen::VectorXd change = c.Acceleration(torque) - before;
    for (const int j : c.body.contact().legs()) change[6 + j] = 0;
    EXPECT_LT(change.tail(model->num_joints()).norm(), 1e-6 * (1 + before.norm()));
  }
}

TEST(StepBalance, WithTheLegsAloneWeakArmsChangeNothing) {
  const auto model = Humanoid();
  StateSampler sampler(model, 77);
  for (const auto& in_contact : kContacts) {
    Case c(model, sampler.Draw(), in_contact);
    ASSERT_TRUE(c.ok);
    const Eigen::VectorXd wanted = sampler.Vector(model->num_joints(), 100);
    Eigen::VectorXd strong = wanted, weak = wanted;
    ASSERT_TRUE(c.Compute(&strong, Movers::kLegs));
    c.effort.setConstant(1e-3);
    for (const int j : c.body.contact().legs()) c.effort[j] = 1e5;
    ASSERT_TRUE(c.Compute(&weak, Movers::kLegs));
    EXPECT_EQ((weak - strong).norm(), 0);
  }
}

TEST(StepBalance, TorquesStayWithinTheJointsLimits) {
  const auto model = Biped();
  StateSampler sampler(model, 76);
  int limited = 0;
  for (int trial = 0; trial < 20; ++trial) {
    Case c(model, sampler.Draw(), kContacts[static_cast<size_t>(trial) % 3]);
    if (!c.ok) continue;
    Eigen::VectorXd torque = sampler.Vector(model->num_joints(), 100);
    Eigen::VectorXd free = torque;
    ASSERT_TRUE(c.Compute(&free));
    c.effort.setConstant(0.9 * free.cwiseAbs().maxCoeff());
    ASSERT_TRUE(c.Compute(&torque));
    ASSERT_TRUE(torque.allFinite());
    limited += torque.cwiseAbs().maxCoeff() < c.effort[0] * (1 + 1e-4) ? 1 : 0;
  }
  EXPECT_GT(limited, 12);  // in some states no torque keeps all bounds
}

TEST(StepBalance, WhatItCannotReadLeavesTheTorque) {
  const auto model = Biped();
  StateSampler sampler(model, 77);
  Case c(model, sampler.Draw(), kRight);
  ASSERT_TRUE(c.ok);
  Eigen::VectorXd torque = Eigen::VectorXd::Constant(model->num_joints(), NAN);
  EXPECT_FALSE(c.Compute(&torque));
  c.bounds.in_contact = kDouble;
  torque.setConstant(1);
  EXPECT_FALSE(c.Compute(&torque));
  EXPECT_EQ(torque, Eigen::VectorXd::Constant(model->num_joints(), 1));
}

}  // namespace
}  // namespace poise::balance
