// The shapes that a maker's file gives a body, meshes read once.
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "components/robot/link_tree.h"
#include "tools/robot_import/maker_file.h"
#include "tools/robot_import/robot_import.h"
#include "tools/robot_import/sole_finder.h"

namespace poise {

class BodyShapes {
 public:
  /// Both must outlive it.
  BodyShapes(const ImportOptions& options, const MakerFile& maker)
      : options_(options), maker_(maker) {}

  /// Returns the shapes of a body's links, in its frame: those that collide, or that are seen.
  std::vector<FootShape> Of(const robot::LinkTree& tree, int body, bool collides);
  /// Tells by name why meshes are not known that were asked for since the last Forget.
  const std::map<std::string, std::string>& missing() const { return missing_; }
  void Forget() { missing_.clear(); }

 private:
  struct Mesh {
    std::vector<Eigen::Vector3d> points;  // in the file's unit
    std::string problem;
  };
  std::map<std::string, Mesh> meshes_;  // by file
  std::map<std::string, std::string> missing_;
  const ImportOptions& options_;
  const MakerFile& maker_;
};

}  // namespace poise
