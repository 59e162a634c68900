#include "tools/robot_import/body_shapes.h"

#include <filesystem>
#include <utility>

#include "tools/robot/maker_shapes.h"
#include "tools/robot/mesh_file.h"

namespace poise {

using Eigen::Vector3d;
using robot::LinkTree;

std::vector<FootShape> BodyShapes::Of(const LinkTree& tree, int body, bool collides) {
  std::vector<FootShape> shapes;
  for (const robot::SourceShape& source : maker_.shapes) {
    const auto place = tree.links.find(source.link);
    if (place == tree.links.end() || place->second.body != body || source.collides != collides) {
      continue;
    }
    FootShape shape{source.kind, place->second.pose * source.pose, source.size, {}};
    if (source.kind == robot::SourceShape::Kind::kMesh) {
      const std::filesystem::path file =
          FindMesh({options_.file, maker_.mesh_folder, options_.meshes}, source.mesh);
      if (file.empty()) {
        missing_[source.mesh] = "it is not there";
        continue;
      }
      const auto [known, is_new] = meshes_.try_emplace(file.string());
      Mesh& mesh = known->second;
      if (is_new) mesh.points = MeshPoints(file, &mesh.problem);
      if (!mesh.problem.empty()) {
        missing_[source.mesh] = mesh.problem;
        continue;
      }
      for (const Vector3d& p : mesh.points) {
        shape.points.push_back(shape.pose * source.size.cwiseProduct(p));
      }
    }
    shapes.push_back(std::move(shape));
  }
  return shapes;
}

}  // namespace poise
