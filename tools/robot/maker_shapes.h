// The solids of a maker's file, URDF or MJCF, and where their meshes lie.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "components/robot/robot_source.h"

namespace tinyxml2 {
class XMLElement;
}

namespace poise {

/// Where meshes are looked for; without a file and folders, nowhere.
struct MeshPlaces {
  std::filesystem::path maker_file;
  std::string mesh_folder;                     ///< as MJCF names it
  std::vector<std::filesystem::path> folders;  ///< as told, first
};

/// Solids of a URDF's <visual> and <collision>. Numbers that are missing or none stay 0, and a
/// solid with such a size is no solid: HasSize.
std::vector<robot::SourceShape> UrdfShapes(const tinyxml2::XMLElement& robot);

struct MakerShapes {
  std::vector<robot::SourceShape> shapes;
  std::string mesh_folder;
};

/// Reads the shapes of a text of either format. Throws robot::RobotError.
MakerShapes ReadShapes(std::string_view maker_text);

/// Whether a primitive's sizes are above 0 and finite, a mesh's scales not 0.
bool HasSize(const robot::SourceShape& shape);

/// The file of a mesh as the maker's file names it ("package://P/x.stl", "file:///x.stl", a
/// relative path): below the folders told, with or without its own leading folders, then beside the
/// maker's file or above it. Empty when there is none.
std::filesystem::path FindMesh(const MeshPlaces& places, const std::string& name);

}  // namespace poise
