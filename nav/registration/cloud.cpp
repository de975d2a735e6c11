#include "nav/registration/cloud.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <nanoflann.hpp>
#include <utility>

namespace nav {
namespace {

constexpr int kVoxelBits = 21;  // Of each coordinate: 20 km at 0.02 m.
constexpr std::size_t kNeighboursMax = 32;

struct Keyed {
  std::uint64_t voxel{};
  std::uint32_t point{};
};

// By voxel, and within a voxel as they came: by bytes of the key, least significant first.
void sort_by_voxel(std::vector<Keyed>& points, int bits) {
  std::vector<Keyed> other(points.size());
  for (int shift = 0; shift < bits; shift += 11) {
    std::array<std::size_t, 2048> start{};
    for (const Keyed& p : points) ++start[(p.voxel >> shift) & 2047U];
    std::size_t sum = 0;
    for (std::size_t& s : start) sum += std::exchange(s, sum);
    for (const Keyed& p : points) other[start[(p.voxel >> shift) & 2047U]++] = p;
    points.swap(other);
  }
}

// Bits that hold every number up to `most`.
int bits_for(std::uint64_t most) {
  int bits = 1;
  while (bits < kVoxelBits + 1 && (most >> bits) != 0) ++bits;
  return bits;
}

std::vector<Keyed> voxels_of(std::span<const Eigen::Vector3f> points_m, double voxel_m) {
  const auto per_m = static_cast<float>(1 / voxel_m);
  Eigen::Array3f low = points_m[0], high = points_m[0];
  for (const auto& p : points_m) {
    low = low.min(p.array());
    high = high.max(p.array());
  }
  const Eigen::Array3d first = (low * per_m).floor().cast<double>();
  const Eigen::Array3d last = (high * per_m).floor().cast<double>();
  const int x_bits = bits_for(static_cast<std::uint64_t>(last.x() - first.x()));
  const int y_bits = bits_for(static_cast<std::uint64_t>(last.y() - first.y()));
  const int z_bits = bits_for(static_cast<std::uint64_t>(last.z() - first.z()));
  std::vector<Keyed> keyed(points_m.size());
  const Eigen::Array3f origin = first.cast<float>();
  for (std::size_t i = 0; i < points_m.size(); ++i) {
    const Eigen::Array3f cell = (points_m[i].array() * per_m).floor() - origin;
    const auto at = [&](int axis) { return static_cast<std::uint64_t>(cell[axis]); };
    keyed[i] = {(at(2) << (x_bits + y_bits)) | (at(1) << x_bits) | at(0),
                static_cast<std::uint32_t>(i)};
  }
  sort_by_voxel(keyed, x_bits + y_bits + z_bits);
  return keyed;
}

// Eigenvectors belong to ascending eigenvalues. Zero where the neighbours show no plane.
Eigen::Vector3f normal_of(const Points& points, std::span<const Neighbour> around,
                          const NormalConfig& config) {
  if (around.size() < 5) return Eigen::Vector3f::Zero();
  const Eigen::Vector3f base = points[around[0].index];
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  Eigen::Matrix3f products = Eigen::Matrix3f::Zero();
  for (const Neighbour& n : around) {
    const Eigen::Vector3f d = points[n.index] - base;
    sum += d;
    products += d * d.transpose();
  }
  const auto count = static_cast<float>(around.size());
  const Eigen::Matrix3f spread = (products - sum * sum.transpose() / count) / count;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> eigen;
  eigen.computeDirect(spread);
  const Eigen::Array3f length = eigen.eigenvalues().array().max(0).sqrt();
  if (!(length[2] > 0) || length[0] > config.flat_max * length[1] ||
      length[1] < config.line_max * length[2])
    return Eigen::Vector3f::Zero();
  const Eigen::Vector3f normal = eigen.eigenvectors().col(0).normalized();
  return normal.dot(base) > 0 ? -normal : normal;
}

}  // namespace

Points usable_points(std::span<const Eigen::Vector3f> points_m, double near_m, double far_m) {
  Points usable;
  usable.reserve(points_m.size());
  const auto near2 = static_cast<float>(near_m * near_m);
  const auto far2 = static_cast<float>(far_m * far_m);
  for (const auto& p : points_m) {
    const float r2 = p.squaredNorm();
    if (r2 > near2 && r2 <= far2) usable.push_back(p);  // Not so for what is not a number.
  }
  return usable;
}

Points thinned(std::span<const Eigen::Vector3f> points_m, double voxel_m) {
  Points means;
  if (points_m.empty()) return means;
  const auto keyed = voxels_of(points_m, voxel_m);
  for (std::size_t i = 0; i < keyed.size();) {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    const Eigen::Vector3f& base = points_m[keyed[i].point];
    std::size_t end = i;
    for (; end < keyed.size() && keyed[end].voxel == keyed[i].voxel; ++end)
      sum += points_m[keyed[end].point] - base;
    means.emplace_back(base + sum / static_cast<float>(end - i));
    i = end;
  }
  return means;
}

struct NearestPoints::Tree {
  struct Data {
    Points points_m;
    std::size_t kdtree_get_point_count() const { return points_m.size(); }
    float kdtree_get_pt(std::size_t i, std::size_t axis) const {
      return points_m[i][static_cast<Eigen::Index>(axis)];
    }
    template <class Box>
    bool kdtree_get_bbox(Box&) const {
      return false;
    }
  };
  using Index = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Data>, Data,
                                                    3, std::uint32_t>;

  explicit Tree(Points points_m) : data{std::move(points_m)}, index(3, data, {12}) {}

  Data data;
  Index index;
};

NearestPoints::NearestPoints(Points points_m)
    : tree_(std::make_unique<Tree>(std::move(points_m))) {}
NearestPoints::~NearestPoints() = default;
NearestPoints::NearestPoints(NearestPoints&&) noexcept = default;
NearestPoints& NearestPoints::operator=(NearestPoints&&) noexcept = default;

const Points& NearestPoints::points_m() const {
  return tree_->data.points_m;
}

namespace {

// The nearest one, no farther than a bound that is known before.
struct NearestOne {
  using DistanceType = float;
  float best2;
  std::uint32_t index = 0;
  bool any = false;

  bool addPoint(float distance2, std::uint32_t i) {
    if (distance2 < best2) {
      best2 = distance2;
      index = i;
      any = true;
    }
    return true;
  }
  float worstDist() const { return best2; }
  bool full() const { return true; }
  std::size_t size() const { return any ? 1 : 0; }
};

}  // namespace

bool NearestPoints::nearest(const Eigen::Vector3f& to, float within_m, Neighbour& found) const {
  NearestOne one{within_m * within_m};
  if (!points_m().empty()) tree_->index.findNeighbors(one, to.data(), {});
  found = {one.index, one.best2};
  return one.any;
}

std::size_t NearestPoints::nearest(const Eigen::Vector3f& to, std::span<Neighbour> found) const {
  std::array<std::uint32_t, kNeighboursMax> index{};
  std::array<float, kNeighboursMax> distance2{};
  const std::size_t count = std::min(found.size(), kNeighboursMax);
  if (points_m().empty() || count == 0) return 0;
  const std::size_t got = tree_->index.knnSearch(to.data(), count, index.data(), distance2.data());
  for (std::size_t i = 0; i < got; ++i) found[i] = {index[i], distance2[i]};
  return got;
}

Surface make_surface(Points points_m, const NormalConfig& config, const RunPieces& run) {
  Surface surface{NearestPoints(std::move(points_m)), {}};
  const Points& points = surface.points.points_m();
  surface.normals.resize(points.size());
  const std::size_t count = std::min(config.neighbours, kNeighboursMax);
  in_pieces(run, points.size(), [&](std::size_t begin, std::size_t end) {
    std::array<Neighbour, kNeighboursMax> around;
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t got = surface.points.nearest(points[i], {around.data(), count});
      surface.normals[i] = normal_of(points, {around.data(), got}, config);
    }
  });
  return surface;
}

}  // namespace nav
