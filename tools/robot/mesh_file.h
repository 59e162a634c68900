// Meshes of robots' files, read by assimp in a process of its own: a file that crashes the reader
// costs a mesh.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace poise {

/// Whether a file that begins so is the pointer that Git LFS puts in a file's place.
bool IsLfsPointer(std::string_view text);

struct MeshTriangles {
  std::vector<std::array<float, 3>> vertices;  ///< in the file's unit
  std::vector<uint32_t> indices;               ///< three a triangle
  size_t triangles() const { return indices.size() / 3; }
};

/// STL, OBJ, COLLADA and whatever else assimp reads, with z up as robots' files mean it. Empty with
/// a `problem`: no mesh, too large, or the reader crashed or took too long.
MeshTriangles LoadMesh(const std::filesystem::path& file, std::string* problem);

/// About `most` triangles of the same shape; all of them where there are no more.
MeshTriangles Simplified(MeshTriangles mesh, size_t most);

/// The mesh's points alone.
std::vector<Eigen::Vector3d> MeshPoints(const std::filesystem::path& file, std::string* problem);

}  // namespace poise
