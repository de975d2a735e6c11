// The simulated site's surfaces: triangles in W, read from Wavefront OBJ.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace sim {

struct Mesh {
  std::vector<Eigen::Vector3d> W_vertices_m;
  std::vector<std::array<std::uint32_t, 3>> triangles;  // Indices of vertices. Either winding.

  Eigen::AlignedBox3d bounds_m() const;  // Empty when the mesh is.
  void add_quad(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                const Eigen::Vector3d& d);  // In order around it.
};

// What one file may hold; larger ones are refused.
inline constexpr std::size_t kObjBytesMax = std::size_t{1} << 30;
inline constexpr std::size_t kObjElementsMax = 20'000'000;  // Vertices, and triangles.
inline constexpr double kObjCoordinateMax_m = 1e8;

struct ParsedMesh {
  Mesh mesh;
  std::vector<std::string> errors;  // "file:line: reason"; not empty: the mesh cannot be used.
};

// Reads v and f; faces as i, i/j, i//k or i/j/k, counted from 1 or backwards from -1; polygons
// become fans of triangles (right for convex ones); triangles that use a vertex twice are dropped.
// Groups, materials, normals and other known keywords are skipped, unknown ones are errors. Metres,
// z up. Never throws for what the text says; `name` is for messages.
ParsedMesh parse_obj(std::string_view text, const std::string& name);

// The same from a file; a file that cannot be read is an error like the others.
ParsedMesh load_obj(const std::filesystem::path& file);

}  // namespace sim
