// One step of ODE's equations for a tree of bodies with contacts, without ODE's dense system.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "components/balance/step/box_lcp.h"

namespace poise {

/// dWorldStep solves one dense system over all rows of all constraints: six a joint, three a
/// contact point. Here each joint's six rows go out at their place in the tree, from the leaves to
/// the base, as in the articulated body algorithm with a joint that yields by `cfm` in every
/// direction; the rows of the contacts remain, and BoxLcp solves those. What is solved are ODE's
/// equations, with M the mass matrix of the free bodies, J all rows:
///   M (v' - v) / h = f + Jᵀ λ,   J v' + cfm λ = c.
/// c, cfm and bounds are those of ODE's hinges (motor row unbounded) and contacts. ODE's friction
/// (dContactApprox1) comes in two stages: the normal forces without friction set its bounds. Under
/// a leg that is thrown ahead friction shifts the load, and a sole would slip at a fraction of its
/// friction. So where bounds that are met are off by more than a twentieth of the load, they are
/// set anew by the normal forces that friction left, until they are not.
///
/// Nothing is allocated after the constructor.
class TreeStep {
 public:
  struct Body {
    // Set once. Vectors in the body's axes from its COM unless said otherwise.
    int parent = -1;          ///< a lower index; -1: the base, which has no joint
    double mass = 0;          ///< kg
    Eigen::Matrix3d inertia;  ///< kg·m², about the COM
    Eigen::Vector3d anchor;   ///< m, of the joint to the parent
    Eigen::Vector3d axis;     ///< unit, of that joint
    Eigen::Vector3d parent_anchor, parent_axis;  ///< the same in the parent's axes, from its COM

    // Set before each step; world axes.
    Eigen::Vector3d position;  ///< m, of the COM
    Eigen::Matrix3d rotation;
    Eigen::Vector3d linear, angular;  ///< m/s of the COM, rad/s; Solve moves them on
    Eigen::Vector3d force, torque;    ///< N, N·m about the COM, gyroscopic torque apart
    bool motor = false;  ///< the row axis · (ω - ω_parent) + motor_cfm λ = motor_velocity
    double motor_velocity = 0, motor_cfm = 0;
  };

  struct Contact {
    int body = 0;
    Eigen::Vector3d position;                   ///< m, world
    std::array<Eigen::Vector3d, 3> directions;  ///< unit: normal, two along the ground
    double velocity = 0;                        ///< m/s, wanted along the normal
    double cfm = 0;                             ///< m/(N·s), of the normal row
    double friction = 0;                        ///< 0: one row, else three
  };

  /// `erp`, `cfm`: of the joints' rows that hold them together; `cfm` also of friction rows.
  TreeStep(std::vector<Body> bodies, int max_contacts, double step, double erp, double cfm);

  Body& body(size_t index) { return bodies_[index]; }

  /// Sets the velocities at the step's end. False, with nothing changed, when the contact forces
  /// were not found.
  bool Solve(std::span<const Contact> contacts);

  /// Times that the bounds of friction were set in the last Solve; 1: they are ODE's own.
  int friction_rounds() const { return friction_rounds_; }
  /// N on the body, of the contacts of the last Solve.
  const Eigen::Vector3d& force(size_t contact) const { return forces_[contact]; }

  /// What the last step's contacts did is no guess for the next.
  void Forget();

 private:
  using Vector6d = Eigen::Matrix<double, 6, 1>;
  using Matrix6d = Eigen::Matrix<double, 6, 6>;

  // Velocities are those of a body's anchor and its ω, over the step; impulses and their moments
  // are about the anchor.
  struct Node {
    Eigen::Vector3d arm;           // anchor from the COM
    Eigen::Vector3d axis, p, q;    // the joint's frame
    Eigen::Vector3d from_parent;   // from the parent's anchor
    Vector6d drive;                // what the joint's rows want of the velocities' change
    Matrix6d inertia;              // kg, of the subtree; after elimination as the parent feels it
    Vector6d impulse, outside;     // of the subtree; of the body alone
    std::array<Vector6d, 6> lose;  // by row: what goes lost of an impulse of 1 in its direction
    Vector6d motor_column;         // inertia times the axis, before the motor's row went out
    double motor_gain = 0;         // 1 / (1 / e + axisᵀ inertia axis)
    double motor_impulse = 0;
    Vector6d passed;         // what the parent feels of impulse
    Vector6d change;         // of the velocity
    bool on_path = false;    // between a contact and the base
    Matrix6d follow, yield;  // change = follow · parent's + yield · impulse
    Matrix6d response;       // change of the velocity by an impulse of 1
  };

  void Prepare();
  void Eliminate(size_t i);
  void PassImpulse(size_t i);
  void Accelerate(bool paths_only);
  void FindResponses(std::span<const Contact> contacts);
  Matrix6d CrossResponse(size_t a, size_t b) const;
  bool SolveContacts(std::span<const Contact> contacts);
  /// Sets the bounds of friction by the normal impulses, solves all rows, and takes the normal
  /// impulses from them; the `round`-th time in this step. Returns by which share of the load the
  /// bounds that are met were off; empty: not solved.
  std::optional<double> SolveFriction(std::span<const Contact> contacts, Eigen::Index rows,
                                      int round);

  std::vector<Body> bodies_;
  double step_, pull_, cfm_;  // pull_: erp / step; cfm_: over the step
  std::vector<Node> nodes_;
  Eigen::LLT<Matrix6d> base_;
  int friction_rounds_ = 0;
  std::vector<int> contact_bodies_;
  std::vector<int> normal_;  // by row, the contact's normal row; -1: it is one
  Eigen::Matrix<double, Eigen::Dynamic, 6> rows_;
  Eigen::Matrix<double, Eigen::Dynamic, 6> moved_;
  Eigen::MatrixXd system_, normal_system_;
  Eigen::VectorXd wanted_, lower_, upper_, impulses_, normal_wanted_, normal_impulses_, zero_,
      infinite_;
  balance::BoxLcp normals_, all_;
  std::vector<Eigen::Vector3d> forces_;
};

}  // namespace poise
