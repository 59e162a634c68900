// Parts of the controller, or imperfections of the robot, that a run does without.
#pragma once

#include <string>
#include <vector>

namespace poise {

/// One assignment to a field of the scenario.
struct FieldChange {
  std::string set;  ///< "field.path=value", as SetField takes them
  std::string by;   ///< what asked for it: "--set", "--ideal", "variant NAME"
};

/// One way to run a scenario with something left out.
struct Ablation {
  std::string name;                  ///< "full", "without_balancing", "ideal"
  std::vector<std::string> without;  ///< of RemovableParts()
  bool ideal = false;
  std::vector<std::string> flags() const;  ///< of `poise run`
};

/// What --without takes.
std::vector<std::string> RemovableParts();

/// The changes of --without PART, for each of `parts` (of RemovableParts()), and of --ideal.
///
/// Each component declares its own (ComponentTraits). Ideal: no friction in the joints, no sensor
/// noise, no drive train between command and torque, no difference between the robot and its model.
/// The rotors' inertia is on: it is part of the model that the controller uses (mass_matrix of
/// components/robot), and without it the robot would differ from it. Limits of the motors and the
/// ground stay.
std::vector<FieldChange> AblationChanges(const std::vector<std::string>& parts, bool ideal);

/// All of them, "full" first.
std::vector<Ablation> Ablations();

}  // namespace poise
