// The vertices of a mesh file: STL, OBJ, Collada and what else assimp reads.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

namespace poise {

/// m, each coordinate times `scale`. Empty with a `problem` when the file cannot be read.
std::vector<Eigen::Vector3d> MeshPoints(const std::filesystem::path& file,
                                        const Eigen::Vector3d& scale, std::string* problem);

}  // namespace poise
