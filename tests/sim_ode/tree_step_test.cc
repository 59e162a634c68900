// TreeStep against ODE's dWorldStep: the same equations, so the same step to rounding where the
// bounds of friction are ODE's.
#include "sim_ode/tree_step.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "sim_ode/ode_world.h"
#include "tests/sim/simulation_fixture.h"

namespace poise {
namespace {

using Eigen::Vector3d;
using robot::RobotModel;
using robot::RobotState;

constexpr double kStep = 1e-3;
constexpr int kContacts = 8;
constexpr int kLeastOfAKind = 1000;  // contacts that are compared

OdeConfig Solver(OdeConfig::Solver solver) {
  OdeConfig config;
  config.set_solver(solver);
  return config;
}

class Draws {
 public:
  explicit Draws(uint64_t seed) : random_(seed) {}
  double operator()(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  Vector3d Vector(double size) {
    return Vector3d::NullaryExpr([&] { return (*this)(-size, size); });
  }

 private:
  std::mt19937_64 random_;
};

struct Outcome {
  double velocity = 0, force = 0;  // largest difference, of the largest value
  int open = 0, sliding = 0, sticking = 0, contacts = 0;
  // N by which forces along the ground exceed μ times the normal forces, in the steps in which
  // TreeStep set its bounds anew, and the number of those.
  double beyond = 0, beyond_of_ode = 0;
  int set_anew = 0;
};

// N by which the force along the ground exceeds what any pyramid of μ allows.
double Beyond(const TerrainContact& contact, const Vector3d& force) {
  const double normal = force.dot(contact.normal);
  const double along = (force - normal * contact.normal).norm();
  return std::max(0.0, along - std::sqrt(2.0) * contact.material.friction * normal);
}

// Both worlds from one drawn state, `steps` steps with drawn joint rows, forces and contacts.
void Compare(const RobotModel& model, Draws* draw, int steps, OdeWorld* tree, OdeWorld* dense,
             Outcome* outcome) {
  RobotState state(model.num_joints());
  const double kind = (*draw)(0, 1);
  const double speed = kind < 0.4 ? 0.001 : kind < 0.7 ? 0.05 : 3;
  state.base_position = {0, 0, 1};
  state.base_orientation =
      Eigen::Quaterniond(Eigen::AngleAxisd((*draw)(-0.4, 0.4), draw->Vector(1).normalized()));
  state.base_linear_velocity = draw->Vector(speed);
  state.base_angular_velocity = draw->Vector(speed);
  for (int j = 0; j < model.num_joints(); ++j) {
    state.joint_position[j] = (*draw)(-1, 1);
    state.joint_velocity[j] = (*draw)(-speed, speed);
  }
  tree->SetState(state);
  dense->SetState(state);
  const double regime = (*draw)(0, 1);
  const bool flat = (*draw)(0, 1) < 0.7;
  for (int step = 0; step < steps; ++step) {
    for (int j = 0; j < model.num_joints(); ++j) {
      // Free, an armature, a stiff gear or stop, a viscous joint: all orders of compliance.
      const JointRow row{(*draw)(0, 1) < 0.8, (*draw)(-speed, speed), std::pow(10, (*draw)(-7, 1)),
                         (*draw)(-20, 20) * speed};
      tree->SetJoint(j, row);
      dense->SetJoint(j, row);
    }
    Vector3d force = draw->Vector(100);
    if (speed < 0.01) force.z() -= 300;  // stands
    const Vector3d point = tree->com_position(0) + draw->Vector(0.3);
    tree->AddForce(0, force, point);
    dense->AddForce(0, force, point);
    std::vector<TerrainContact> contacts;
    for (size_t f = 0; f < 2; ++f) {
      const int body = model.feet()[f].body;
      const Eigen::Isometry3d sole = tree->pose(body) * model.feet()[f].sole;
      Vector3d normal = flat ? sole.linear().col(2).eval() : draw->Vector(1).normalized();
      for (int c = 0; c < 4; ++c) {
        if ((*draw)(0, 1) < 0.2) continue;  // not at the ground
        const Vector3d corner((c & 1 ? -0.12 : 0.12), (c & 2 ? -0.06 : 0.06), 0);
        TerrainContact contact;
        contact.body = body;
        contact.position = sole * corner;
        contact.normal = normal;
        contact.depth = (*draw)(-1e-6, 1e-5);
        contact.velocity = (*draw)(0, 1) < 0.2 ? (*draw)(-0.1, 0.1) : 0;
        contact.material.friction = regime < 0.1 ? 0 : regime < 0.5 ? 0.2 : 0.9;
        if (regime > 0.8) contact.material = {0.9, 5000, 300};
        contacts.push_back(contact);
        tree->AddContact(contact);
        dense->AddContact(contact);
      }
    }
    ASSERT_TRUE(tree->Step()) << tree->message();
    ASSERT_TRUE(dense->Step()) << dense->message();
    if (tree->friction_rounds() > 1) {
      ++outcome->set_anew;
      for (size_t c = 0; c < contacts.size(); ++c) {
        outcome->beyond += Beyond(contacts[c], tree->contact_force(static_cast<int>(c)));
        outcome->beyond_of_ode += Beyond(contacts[c], dense->contact_force(static_cast<int>(c)));
      }
      return;  // two motions from here on
    }
    double largest = 0.1, difference = 0;
    for (int b = 0; b < static_cast<int>(model.bodies().size()); ++b) {
      largest =
          std::max({largest, dense->com_velocity(b).norm(), dense->angular_velocity(b).norm()});
      difference =
          std::max({difference, (tree->com_velocity(b) - dense->com_velocity(b)).norm(),
                    (tree->angular_velocity(b) - dense->angular_velocity(b)).norm(),
                    (tree->pose(b).matrix() - dense->pose(b).matrix()).norm() / kStep * 1e-3});
    }
    outcome->velocity = std::max(outcome->velocity, difference / largest);
    double largest_force = 1, force_difference = 0;
    for (size_t c = 0; c < contacts.size(); ++c) {
      const auto i = static_cast<int>(c);
      const Vector3d on = dense->contact_force(i);
      largest_force = std::max(largest_force, on.norm());
      force_difference = std::max({force_difference, (tree->contact_force(i) - on).norm(),
                                   (tree->contact_moment(i) - dense->contact_moment(i)).norm()});
      ++outcome->contacts;
      const double normal = on.dot(contacts[c].normal);
      const double along = (on - normal * contacts[c].normal).norm();
      if (normal <= 1e-9) {
        ++outcome->open;
      } else if (along >= contacts[c].material.friction * normal * 0.7) {
        ++outcome->sliding;
      } else {
        ++outcome->sticking;
      }
    }
    outcome->force = std::max(outcome->force, force_difference / largest_force);
  }
}

void CompareRobots(const RobotModel& model, int draws) {
  OdeWorld tree(Solver(OdeConfig::TREE), model, kContacts, kStep);
  OdeWorld dense(Solver(OdeConfig::DENSE), model, kContacts, kStep);
  Draws draw(7);
  Outcome outcome;
  for (int i = 0; i < draws && !testing::Test::HasFatalFailure(); ++i) {
    Compare(model, &draw, 4, &tree, &dense, &outcome);
  }
  EXPECT_LT(outcome.velocity, 1e-9);
  EXPECT_LT(outcome.force, 1e-6);
  EXPECT_EQ(tree.given_up_steps(), 0);
  // ODE's friction goes beyond the ground's, where friction shifts the load; TreeStep's does not.
  EXPECT_GT(outcome.set_anew, draws / 20);
  EXPECT_LT(outcome.beyond, 0.1 * outcome.beyond_of_ode);
  EXPECT_GT(outcome.open, kLeastOfAKind);
  EXPECT_GT(outcome.sliding, kLeastOfAKind);
  EXPECT_GT(outcome.sticking, kLeastOfAKind);
  GTEST_LOG_(INFO) << outcome.contacts << " contacts: " << outcome.open << " open, "
                   << outcome.sliding << " sliding, " << outcome.sticking
                   << " sticking; bounds of friction set anew " << outcome.set_anew
                   << " times, beyond them " << outcome.beyond << " N, by ODE "
                   << outcome.beyond_of_ode << " N; largest relative difference of velocities "
                   << outcome.velocity << ", of forces " << outcome.force;
}

TEST(TreeStep, IsOdesOwnStep) { CompareRobots(PaperRobot(), 30000); }

}  // namespace
}  // namespace poise
