// A biped to import, whose every number the tests know, and the makers' files where they are.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "tools/robot_import/robot_import.h"

namespace poise {

/// Changes of SimpleBiped.
struct Biped {
  double shin_rotor = 0;   ///< kg·m², hidden in both shins about y
  bool ankle_roll = true;  ///< false: five joints in a leg
  std::string more_links;  ///< before </robot>
  std::string base_rpy =
      "";  ///< not empty: a root link above, to which the base is fixed like that
};

/// A URDF: base, two legs of six joints, feet with boxes 0.24 x 0.1 m that end 0.08 m below the
/// ankle and reach from 0.06 m behind it to 0.18 m before it; thighs and shins of 0.4 m, 0.2 m
/// apart.
std::string SimpleBiped(const Biped& changes = {});
inline constexpr double kShinInertia[3] = {0.03, 0.029, 0.004};  // kg·m², about x, y, z

/// A file of this text in a fresh folder.
std::filesystem::path WriteMaker(const std::string& name, const std::string& text);
RobotImport ImportText(const std::string& name, const std::string& text);
/// What the import says of the file when it refuses it; "taken" when it does not.
std::string Refusal(const ImportOptions& options);
std::string RefusalOf(const std::string& text);
/// Throws std::runtime_error where no motor moves the joint.
const Motor& MotorOf(const Robot& robot, const std::string& joint);

/// The folder of the makers' files: $POISE_ROBOTS, else ../shared/robots beside the checkout. Empty
/// when it is not there.
std::filesystem::path MakersFolder();

}  // namespace poise
