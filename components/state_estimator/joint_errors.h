// JointErrors: by how much a leg's joint torques are wrong, learnt while its foot hangs free; and
// FreeFoot, which says when it does.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "components/framework/state_archive.h"

namespace poise {

/// A free foot carries nothing: what its leg's rows say it carries is their error. Its average is
/// taken off as far as the row's error is still the same: shares of friction, motor torque and the
/// model's demand, each normal and independent, of which as much is known as these have in common
/// with what they were; and less as time goes by.
class JointErrors {
 public:
  /// N·m: (friction, motor torque, what the motion asks for by the model).
  using Torques = std::array<double, 3>;
  struct Corrected {
    double error = 0;     ///< N·m, to be taken off the row's torque
    double variance = 0;  ///< (N·m)², of what is left
  };

  /// `share`: standard deviations of the shares by which the torques may be wrong.
  JointErrors(size_t num_joints, const Torques& share);

  /// Time goes by, `dt` s, before this tick's Learn.
  void Age(double dt);
  /// Begins anew for a joint whose foot has been lifted.
  void Begin(size_t joint) { joint_[joint] = {}; }
  /// A reading of a free leg's joint, `dt` s after the last: its row's torque that no foot carries,
  /// N·m; and the row's `variance`,
  /// (N·m)². `pressed`: the ground may have part in it, so that it counts little.
  void Learn(size_t joint, const Torques& torques, double residual, double variance, bool pressed,
             double dt);
  /// What is known by now of the error of a row whose variance was `variance`, (N·m)², before.
  Corrected Correct(size_t joint, const Torques& torques, double variance) const;
  void Archive(StateArchive* archive) { archive->Show(joint_); }

 private:
  double Offset(const Torques& torques, double variance) const;
  struct Joint {
    double mean = 0, spread = 0;  // N·m, (N·m)², of the residual
    double offset = 0;            // (N·m)², of Offset
    Torques torques{};            // N·m, averaged alike
    double learnt = 0, age = 0;   // s, that the average covers, since then
  };

  Torques share_;
  std::vector<Joint> joint_;
};

/// Whether a foot hangs free, from what is observed of it. It does once it goes through space and
/// seems to carry no more than the observer's error, and until it carries more than that.
class FreeFoot {
 public:
  /// `speed`: m/s of the sole against the other sole. `excess`: squared normalised wrench,
  /// chi-squared with 6 degrees of freedom when it carries nothing. `press`: the load in standard
  /// deviations; no ground pulls. True when it begins to be free.
  bool Update(double speed, double excess, double press, double dt);
  bool free() const { return free_; }
  void Archive(StateArchive* archive) { archive->Show(moving_, free_); }

 private:
  double moving_ = 0;  // s
  bool free_ = false;
};

}  // namespace poise
