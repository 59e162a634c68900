// An MJCF text reduced to what a robot is: only elements and attributes that the reader knows reach
// MuJoCo, each number finite, every object under a name of our own.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "components/robot_files/mjcf_source.h"

namespace poise::robot {

struct CleanBody {
  std::string name;
  int parent = -1;                            ///< body; -1: the root
  int joint = -1;                             ///< of the joints below
  bool has_inertial = false;                  ///< the numbers below are the file's
  double mass = 0;                            ///< kg
  std::array<double, 3> diagonal = {};        ///< kg·m², in the inertial frame
  std::optional<std::array<double, 6>> full;  ///< kg·m², in the body's axes, as MJCF orders them
};

struct CleanJoint {
  std::string name;
  int body = -1;
  std::optional<std::array<double, 2>> force_range;  ///< N·m, of the attribute actuatorfrcrange
  std::optional<Mimic> mimic;
};

struct CleanSite {
  std::string name;
  int body = -1;
};

struct CleanGeom {
  int body = -1;
  std::string mesh;  ///< file; empty: a primitive
  std::array<double, 3> scale = {1, 1, 1};
};

struct CleanActuator {
  int joint = -1;
  bool is_torque = false;  ///< its control is a force: ctrlrange limits it
};

/// In the cleaned text objects are called b0, j0, s0, g0, a0, by their place in these lists.
struct CleanMjcf {
  std::string xml, model, mesh_folder;
  std::vector<CleanBody> bodies;
  std::vector<CleanJoint> joints;
  std::vector<CleanSite> sites;
  std::vector<CleanGeom> geoms;
  std::vector<CleanActuator> actuators;
  std::vector<MjcfSensor> sensors;
  std::vector<MjcfKey> keys;
};

/// Throws RobotError with line and element.
CleanMjcf CleanedMjcf(std::string_view xml, std::vector<std::string>* warnings);

}  // namespace poise::robot
