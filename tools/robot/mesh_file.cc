#include "tools/robot/mesh_file.h"

#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fcntl.h>
#include <meshoptimizer.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <assimp/Importer.hpp>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <limits>

#include "fmt/format.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

constexpr uintmax_t kMostBytes = 256u << 20;    // of a file
constexpr uint64_t kMostVertices = 20'000'000;  // of a mesh
constexpr rlim_t kMostSeconds = 20;             // of processor time
constexpr rlim_t kMostMemory = 4ull << 30;      // bytes; sanitizers reserve more
constexpr float kMostError = 0.05f;             // of the mesh's extent, that simplifying may cost

/// The scene's triangles; `problem` where there are none.
MeshTriangles ReadHere(const fs::path& file, std::string* problem) {
  MeshTriangles mesh;
  Assimp::Importer importer;
  // Robots' files have z up, whatever a COLLADA file says of itself.
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  importer.SetPropertyInteger(
      AI_CONFIG_PP_RVC_FLAGS,
      aiComponent_NORMALS | aiComponent_TANGENTS_AND_BITANGENTS | aiComponent_COLORS |
          aiComponent_TEXCOORDS | aiComponent_BONEWEIGHTS | aiComponent_ANIMATIONS |
          aiComponent_TEXTURES | aiComponent_LIGHTS | aiComponent_CAMERAS | aiComponent_MATERIALS);
  const aiScene* const scene = importer.ReadFile(
      file.string(), aiProcess_RemoveComponent | aiProcess_Triangulate |
                         aiProcess_PreTransformVertices | aiProcess_JoinIdenticalVertices);
  if (scene == nullptr) {
    *problem = importer.GetErrorString();
    return mesh;
  }
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
    const aiMesh& part = *scene->mMeshes[m];
    const auto first = static_cast<uint32_t>(mesh.vertices.size());
    for (unsigned v = 0; v < part.mNumVertices; ++v) {
      const aiVector3D& p = part.mVertices[v];
      mesh.vertices.push_back({p.x, p.y, p.z});
    }
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      const aiFace& face = part.mFaces[f];
      if (face.mNumIndices != 3) continue;  // a point or a line
      for (unsigned i = 0; i < 3; ++i) {
        if (face.mIndices[i] >= part.mNumVertices) {
          *problem = "a triangle has a corner that is not there";
          return {};
        }
        mesh.indices.push_back(first + face.mIndices[i]);
      }
    }
  }
  for (const auto& v : mesh.vertices) {
    if (std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2])) continue;
    *problem = "a corner is no number";
    return {};
  }
  if (mesh.indices.empty()) {
    *problem = "it has no triangles";
    return {};
  }
  return mesh;
}

template <class Items>
bool Send(const Items& items, FILE* pipe) {
  return std::fwrite(items.data(), sizeof items[0], items.size(), pipe) == items.size();
}

template <class Items>
bool Receive(size_t count, Items* items, FILE* pipe) {
  items->resize(count);
  return std::fread(items->data(), sizeof(*items)[0], count, pipe) == count;
}

/// What comes first through the pipe; the vertices, indices or the problem follow.
struct Header {
  uint64_t vertices = 0, indices = 0, problem = 0;
};

[[noreturn]] void ReadInChild(const fs::path& file, int pipe) {
  for (const int signal : {SIGSEGV, SIGABRT, SIGFPE, SIGBUS, SIGILL}) std::signal(signal, SIG_DFL);
  const rlimit time{kMostSeconds, kMostSeconds}, none{0, 0};
  setrlimit(RLIMIT_CPU, &time);
  setrlimit(RLIMIT_CORE, &none);
#ifndef __SANITIZE_ADDRESS__
  const rlimit memory{kMostMemory, kMostMemory};
  setrlimit(RLIMIT_AS, &memory);
#endif
  std::string problem;
  MeshTriangles mesh;
  try {
    mesh = ReadHere(file, &problem);
  } catch (const std::exception& error) {
    problem = error.what();
  }
  const Header header{mesh.vertices.size(), mesh.indices.size(), problem.size()};
  FILE* const to = fdopen(pipe, "w");
  const bool sent = to != nullptr && std::fwrite(&header, sizeof header, 1, to) == 1 &&
                    Send(problem, to) && Send(mesh.vertices, to) && Send(mesh.indices, to) &&
                    std::fflush(to) == 0;
  _exit(sent ? 0 : 1);  // nothing of the parent's is flushed or ended
}

bool ReceiveMesh(FILE* pipe, MeshTriangles* mesh, std::string* problem) {
  Header header;
  if (std::fread(&header, sizeof header, 1, pipe) != 1) return false;
  if (header.vertices > kMostVertices || header.indices > 3 * kMostVertices ||
      header.problem > 10000) {
    *problem = "it is too large";
    return true;
  }
  return Receive(header.problem, problem, pipe) &&
         Receive(header.vertices, &mesh->vertices, pipe) &&
         Receive(header.indices, &mesh->indices, pipe);
}

}  // namespace

bool IsLfsPointer(std::string_view text) {
  return text.starts_with("version https://git-lfs.github.com/spec/");
}

MeshTriangles LoadMesh(const fs::path& file, std::string* problem) {
  problem->clear();
  MeshTriangles mesh;
  std::error_code error;
  const uintmax_t size = fs::file_size(file, error);
  if (error || size > kMostBytes) {
    *problem = error ? error.message() : fmt::format("it has more than {} MB", kMostBytes >> 20);
    return mesh;
  }
  std::string begin(100, '\0');
  std::ifstream(file, std::ios::binary)
      .read(begin.data(), static_cast<std::streamsize>(begin.size()));
  if (IsLfsPointer(begin)) {
    *problem = "it is a Git LFS pointer; fetch the file that it stands for, `git lfs pull`";
    return mesh;
  }
  int pipe[2];
  if (pipe2(pipe, O_CLOEXEC) != 0) {
    *problem = std::strerror(errno);
    return mesh;
  }
  const pid_t child = fork();
  if (child == 0) {
    close(pipe[0]);
    ReadInChild(file, pipe[1]);
  }
  close(pipe[1]);
  if (child < 0) {
    *problem = std::strerror(errno);
    close(pipe[0]);
    return mesh;
  }
  FILE* const from = fdopen(pipe[0], "r");
  const bool received = from != nullptr && ReceiveMesh(from, &mesh, problem);
  if (from != nullptr) std::fclose(from);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
  if (!received) {
    mesh = {};
    const bool slow =
        WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL);
    *problem = slow ? fmt::format("its reader took more than {} s", kMostSeconds)
                    : "its reader crashed on it";
  }
  if (!problem->empty()) mesh = {};
  return mesh;
}

MeshTriangles Simplified(MeshTriangles mesh, size_t most) {
  if (mesh.triangles() > most) {
    std::vector<uint32_t> fewer(mesh.indices.size());
    size_t count = meshopt_simplify(fewer.data(), mesh.indices.data(), mesh.indices.size(),
                                    mesh.vertices[0].data(), mesh.vertices.size(),
                                    sizeof mesh.vertices[0], 3 * most, kMostError, 0, nullptr);
    // Many small closed parts, screws and text, do not get simpler one by one.
    if (count > 3 * most + most) {
      count = meshopt_simplifySloppy(fewer.data(), mesh.indices.data(), mesh.indices.size(),
                                     mesh.vertices[0].data(), mesh.vertices.size(),
                                     sizeof mesh.vertices[0], 3 * most,
                                     std::numeric_limits<float>::max(), nullptr);
    }
    fewer.resize(count);
    mesh.indices = std::move(fewer);
  }
  // Vertices that no triangle has any more are dropped.
  std::vector<uint32_t> remap(mesh.vertices.size());
  const size_t count = meshopt_optimizeVertexFetchRemap(remap.data(), mesh.indices.data(),
                                                        mesh.indices.size(), mesh.vertices.size());
  std::vector<std::array<float, 3>> kept(count);
  for (size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (remap[v] < count) kept[remap[v]] = mesh.vertices[v];
  }
  for (uint32_t& i : mesh.indices) i = remap[i];
  mesh.vertices = std::move(kept);
  return mesh;
}

std::vector<Eigen::Vector3d> MeshPoints(const fs::path& file, std::string* problem) {
  std::vector<Eigen::Vector3d> points;
  for (const auto& v : LoadMesh(file, problem).vertices) points.emplace_back(v[0], v[1], v[2]);
  return points;
}

}  // namespace poise
