// The simulated ground: floor and blocks.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "sim/terrain.h"
#include "tools/foxglove/foxglove.pb.h"
#include "tools/scenario/scenario.pb.h"

namespace poise {

class GroundScene {
 public:
  /// A scenario whose ground cannot be (another version's) has a floor alone.
  explicit GroundScene(const Scenario& scenario);

  /// The ground at a time (s of the scenario), where it is another than at the call before.
  std::optional<foxglove::SceneUpdate> Update(double time, int64_t utime);

 private:
  void AddFloor(int64_t utime, foxglove::SceneUpdate* scene) const;

  SimConfig config_;
  std::unique_ptr<Terrain> terrain_;
  double stage_ = 0;  // of the block, as it was told last
  bool begun_ = false;
};

}  // namespace poise
