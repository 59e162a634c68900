// MuJoCo's XML compiler, which knows one text at a time and reports errors through a global.
#pragma once

#include <mujoco/mujoco.h>

#include <memory>
#include <string>

namespace poise::robot {

struct FreeMujocoModel {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
};
using MujocoModel = std::unique_ptr<mjModel, FreeMujocoModel>;

/// Compiles MJCF that names no files. Null with a `problem`, one line or more, when MuJoCo refuses
/// it. One call at a time runs in a process.
MujocoModel CompileMjcf(const std::string& xml, std::string* problem);

}  // namespace poise::robot
