// What step_planner plans of the feet, and from where steps bring the COM to rest: FOOTSTEPS.
#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "components/framework/state_archive.h"
#include "components/step_planner/stepping/capturability.h"
#include "components/step_planner/stepping/quasi_static_walk.h"
#include "components/step_planner/stepping/recovery.h"
#include "steps/footsteps_t.hpp"

namespace poise {

/// The robot of one tick.
struct FootstepInput {
  double time = 0;        ///< s
  double com_height = 0;  ///< m, world
  robot::FootArray<Eigen::Isometry3d> sole{Eigen::Isometry3d::Identity(),
                                           Eigen::Isometry3d::Identity()};  ///< world
  robot::FootArray<bool> in_contact{true, true};
};

/// Regions are made anew when the foot that carries changes, and every 20 ms. Never allocates.
class FootstepReport {
 public:
  FootstepReport() = default;
  /// `recovery`, `walk`: null where they are not enabled, as below.
  FootstepReport(const stepping::Recovery* recovery, const stepping::QuasiStaticWalk* walk);

  void Update(const FootstepInput& input, const stepping::Recovery* recovery,
              const stepping::QuasiStaticWalk* walk, ::steps::footsteps_t* out);
  void Archive(StateArchive* archive) { archive->Show(since_, stance_); }

 private:
  double since_ = -1e9;  // s, last time that regions were made
  std::optional<robot::Foot> stance_;
  stepping::RegionFinder recovery_regions_, walk_regions_;
};

}  // namespace poise
