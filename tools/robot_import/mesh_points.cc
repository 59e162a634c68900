#include "tools/robot_import/mesh_points.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>

namespace poise {

std::vector<Eigen::Vector3d> MeshPoints(const std::filesystem::path& file,
                                        const Eigen::Vector3d& scale, std::string* problem) {
  std::vector<Eigen::Vector3d> points;
  Assimp::Importer importer;
  const aiScene* const scene = importer.ReadFile(
      file.string(), aiProcess_JoinIdenticalVertices | aiProcess_PreTransformVertices);
  if (scene == nullptr) {
    *problem = importer.GetErrorString();
    return points;
  }
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
    const aiMesh& mesh = *scene->mMeshes[m];
    for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
      const aiVector3D& p = mesh.mVertices[v];
      const Eigen::Vector3d point = scale.cwiseProduct(Eigen::Vector3d(p.x, p.y, p.z));
      if (point.allFinite()) points.push_back(point);
    }
  }
  if (points.empty()) *problem = "it has no vertices";
  return points;
}

}  // namespace poise
