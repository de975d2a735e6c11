#include "mission/scan_registrar.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "mission/site_model.hpp"
#include "planning/voxel_parallel.hpp"

namespace mission {
namespace {

// What an upright pose on the mapped ground says of height and tilt: real ground is neither even
// nor level.
constexpr double kHeightSigmaM = 0.3, kTiltSigmaRad = 0.05;
// Of a scan about which nothing is known, and of directions that a pair leaves free.
constexpr double kNowhereSigmaM = 10, kNowhereSigmaRad = 1;
// Two poses that agree differ by less (chi-square, 3 numbers, 99.9 %).
constexpr double kAgreeChi2 = 16.3;
constexpr double kOverlapWithinM = 1.0;  // As the coarsest clouds are thinned.
// Of the overlap foreseen from coarse clouds, so much is there in fine ones.
constexpr double kOverlapLeft = 0.8;
// Of points that stand where another scan looked through, where the localizer has the two. One that
// is a few decimetres off makes no more at the edges of things; another place does.
constexpr double kConflictMax = 0.08;

Eigen::Matrix3d plane_part(const nav::Matrix6d& covariance) {
  constexpr int kAxes[] = {0, 1, 5};
  Eigen::Matrix3d part;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) part(i, j) = covariance(kAxes[i], kAxes[j]);
  return part;
}

nav::Matrix6d upright(const Eigen::Matrix3d& plane) {
  constexpr int kAxes[] = {0, 1, 5};
  nav::Matrix6d covariance = nav::Matrix6d::Zero();
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) covariance(kAxes[i], kAxes[j]) = plane(i, j);
  covariance(2, 2) = kHeightSigmaM * kHeightSigmaM;
  covariance(3, 3) = covariance(4, 4) = kTiltSigmaRad * kTiltSigmaRad;
  return covariance;
}

hal::Pose2 plane_pose(const Eigen::Isometry3d& T_W_S) {
  return {T_W_S.translation().head<2>(), std::atan2(T_W_S.linear()(1, 0), T_W_S.linear()(0, 0))};
}

Eigen::Vector3d between(const hal::Pose2& from, const hal::Pose2& to) {
  Eigen::Vector3d way;
  way << to.position_m - from.position_m,
      std::remainder(to.heading_rad - from.heading_rad, 2 * std::numbers::pi);
  return way;
}

double chi2_of(const Eigen::Vector3d& way, const Eigen::Matrix3d& covariance) {
  return way.dot(covariance.inverse() * way);
}

// A pair says nothing of the directions that it leaves free.
nav::Matrix6d held_covariance(const nav::Registration& pair) {
  nav::Matrix6d covariance = pair.covariance;
  for (const nav::HeldAxis& axis : pair.shift)
    if (axis.is_free)
      covariance.block<3, 3>(0, 0) +=
          kNowhereSigmaM * kNowhereSigmaM * axis.direction * axis.direction.transpose();
  for (const nav::HeldAxis& axis : pair.turn)
    if (axis.is_free)
      covariance.block<3, 3>(3, 3) +=
          kNowhereSigmaRad * kNowhereSigmaRad * axis.direction * axis.direction.transpose();
  return covariance;
}

// Ground holds height and tilt only, and there is so much of it that walls would hardly count
// beside it: of what lies so low, the first point in every square stays.
std::vector<Eigen::Vector3f> with_thin_ground(const std::vector<Eigen::Vector3f>& S_points_m,
                                              double height_m) {
  constexpr float kLowM = 0.3F, kSquareM = 1;
  constexpr int kSquares = 400;  // Along each side, the scanner in the middle.
  std::vector<bool> taken(kSquares * kSquares);
  std::vector<Eigen::Vector3f> points;
  for (const Eigen::Vector3f& point : S_points_m) {
    if (std::abs(point.z() + static_cast<float>(height_m)) < kLowM) {
      const Eigen::Array2i square =
          (point.head<2>().array() / kSquareM).floor().cast<int>() + kSquares / 2;
      if (square.minCoeff() < 0 || square.maxCoeff() >= kSquares) continue;
      const auto index = static_cast<std::size_t>(square.y() * kSquares + square.x());
      if (taken[index]) continue;
      taken[index] = true;
    }
    points.push_back(point);
  }
  return points;
}

// Which of x, y and heading a pair leaves free, in words; empty: none. Height and tilt are not
// asked for.
std::string free_in_plane(const nav::Registration& pair) {
  std::string text;
  for (const nav::HeldAxis& axis : pair.shift)
    if (axis.is_free && std::abs(axis.direction.z()) < 0.7)
      text += (text.empty() ? "free along " : ", along ") + nav::in_words(axis.direction);
  for (const nav::HeldAxis& axis : pair.turn)
    if (axis.is_free && std::abs(axis.direction.z()) > 0.7)
      text += (text.empty() ? "free about " : ", about ") + nav::in_words(axis.direction);
  return text;
}

std::pair<int, int> pair_of(int a, int b) {
  return std::minmax(a, b);
}

}  // namespace

std::string_view name(ScanVerdict verdict) {
  switch (verdict) {
    case ScanVerdict::off:
      return "not registered";
    case ScanVerdict::alone:
      return "overlaps none";
    case ScanVerdict::accepted:
      return "accepted";
    case ScanVerdict::held_in_part:
      return "held in part";
    case ScanVerdict::refused:
      break;
  }
  return "refused";
}

struct ScanRegistrar::Scan {
  int number{};
  Eigen::Isometry3d T_W_S;
  nav::PosePrior prior;
  std::unique_ptr<nav::PreparedScan> cloud;  // Null: not in hand.
};

ScanRegistrar::ScanRegistrar(const RegisterConfig& config, const ScannerConfig& scanner,
                             int threads)
    : config_(config), scanner_(scanner), threads_(threads) {}
ScanRegistrar::~ScanRegistrar() = default;

nav::RunPieces ScanRegistrar::pieces() const {
  return [threads = threads_](std::size_t count, const std::function<void(std::size_t)>& work) {
    planning::for_pieces(threads, count, 1,
                         [&](int, std::size_t begin, std::size_t) { work(begin); });
  };
}

nav::RegistrationConfig ScanRegistrar::pair_config(bool other_guesses) const {
  nav::RegistrationConfig config;
  config.near_m = std::max(config.near_m, scanner_.range_min_m);
  config.far_m = std::min(config.far_m, scanner_.range_max_m);
  config.rms_max_m = config_.rms_max_m;
  config.overlap_min = kOverlapLeft * config_.overlap_min;
  if (!other_guesses) config.retry_m = config.retry_rad = 0;
  return config;
}

Eigen::Isometry3d ScanRegistrar::T_W_S_of(const hal::Pose2& pose, double ground_z_m) const {
  return scanner_pose(pose, ground_z_m, scanner_.height_m);
}

nav::PosePrior ScanRegistrar::prior_of(std::size_t scan, const ScanBelief& belief) const {
  return {static_cast<int>(scan), T_W_S_of(belief.alone, belief.ground_z_m),
          upright(belief.alone_covariance)};
}

void ScanRegistrar::take(const std::vector<Eigen::Vector3f>& S_points_m) {
  taken_ = std::make_unique<nav::PreparedScan>(with_thin_ground(S_points_m, scanner_.height_m),
                                               pair_config(false), pieces());
}

// Those in hand that overlap a scan enough, most first.
std::vector<std::pair<double, std::size_t>> ScanRegistrar::overlapping(
    const nav::PreparedScan& scan, const Eigen::Isometry3d& T_W_S, std::size_t count) const {
  std::vector<std::pair<double, std::size_t>> found;
  for (std::size_t i = 0; i < scans_.size(); ++i) {
    if (!scans_[i].cloud || scans_[i].cloud.get() == &scan) continue;
    const double overlap =
        nav::overlap_at(*scans_[i].cloud, scan, scans_[i].T_W_S.inverse() * T_W_S, kOverlapWithinM);
    if (overlap >= config_.overlap_min) found.emplace_back(overlap, i);
  }
  std::ranges::stable_sort(found, std::ranges::greater{}, &std::pair<double, std::size_t>::first);
  if (found.size() > count) found.resize(count);
  return found;
}

ScanAttempt ScanRegistrar::attempt(const ScanBelief& belief, bool other_guesses) {
  ScanAttempt attempt;
  attempt.pose = attempt.measured = attempt.fit.before = belief.pose;
  attempt.covariance = belief.covariance;
  const Eigen::Isometry3d T_W_S = T_W_S_of(belief.pose, belief.ground_z_m);
  const nav::RegistrationConfig config = pair_config(other_guesses);
  const auto most = static_cast<std::size_t>(config_.references_max);
  for (const auto& [overlap, i] : overlapping(*taken_, T_W_S, most)) {
    const Scan& reference = scans_[i];
    attempt.pairs.push_back(
        {reference.number,
         nav::register_scans(*reference.cloud, *taken_, reference.T_W_S.inverse() * T_W_S, config,
                             pieces()),
         false, nav::conflict_at(*reference.cloud, *taken_, reference.T_W_S.inverse() * T_W_S)});
    ScanPair& pair = attempt.pairs.back();
    pair.used = pair.figures.verdict != nav::Verdict::refused;
  }
  judge(belief, attempt);
  return attempt;
}

nav::PoseGraph ScanRegistrar::graph() const {
  nav::PoseGraph graph;
  graph.links = links_;
  for (const Scan& scan : scans_) {
    graph.T_W_S.push_back(scan.T_W_S);
    graph.priors.push_back(scan.prior);
  }
  return graph;
}

std::size_t ScanRegistrar::index_of(int number) const {
  return static_cast<std::size_t>(std::ranges::find(scans_, number, &Scan::number) -
                                  scans_.begin());
}

// What the pairs used say of the scan by themselves, and together with what it knows alone. Pairs
// that are at odds with the rest are not used any more.
void ScanRegistrar::locate(const ScanBelief& belief, ScanAttempt& attempt) const {
  const std::size_t self = scans_.size();
  nav::PoseGraph graph = this->graph();
  graph.T_W_S.push_back(T_W_S_of(belief.pose, belief.ground_z_m));
  graph.priors.push_back(prior_of(self, belief));
  graph.priors.back().covariance = upright(
      Eigen::Vector3d(kNowhereSigmaM, kNowhereSigmaM, kNowhereSigmaRad).cwiseAbs2().asDiagonal());
  std::vector<std::size_t> pair_of_link;
  const auto add_links = [&] {
    graph.links = links_;
    pair_of_link.clear();
    for (std::size_t i = 0; i < attempt.pairs.size(); ++i) {
      const ScanPair& pair = attempt.pairs[i];
      if (!pair.used) continue;
      graph.links.push_back({static_cast<int>(index_of(pair.with)), static_cast<int>(self),
                             pair.figures.T_reference_reading, held_covariance(pair.figures)});
      pair_of_link.push_back(i);
    }
  };
  add_links();
  nav::PoseGraphFit fit = nav::fit_pose_graph(graph).value();
  bool odd = false;
  for (const int link : fit.odd_links) {
    if (link < static_cast<int>(links_.size())) continue;
    attempt.pairs[pair_of_link[static_cast<std::size_t>(link) - links_.size()]].used = false;
    odd = true;
  }
  if (odd) {
    add_links();
    if (pair_of_link.empty()) return;
    fit = nav::fit_pose_graph(graph).value();
  }
  attempt.measured = plane_pose(fit.T_W_S[self]);
  attempt.measured_covariance = plane_part(fit.covariances[self]);
  const Eigen::Matrix3d both = attempt.measured_covariance + belief.alone_covariance;
  if (chi2_of(between(belief.alone, attempt.measured), both) > kAgreeChi2) {
    attempt.pose = attempt.measured;
    attempt.covariance = attempt.measured_covariance;
    return;
  }
  graph.priors.back() = prior_of(self, belief);
  fit = nav::fit_pose_graph(graph).value();
  attempt.pose = plane_pose(fit.T_W_S[self]);
  attempt.covariance = plane_part(fit.covariances[self]);
}

// A scan that shares no surface with others may still stand where the nearest of them looked
// through.
void ScanRegistrar::look_through(const Eigen::Isometry3d& T_W_S, ScanFit& fit) const {
  std::vector<std::pair<double, std::size_t>> nearest;
  for (std::size_t i = 0; i < scans_.size(); ++i)
    if (scans_[i].cloud)
      nearest.emplace_back((scans_[i].T_W_S.translation() - T_W_S.translation()).norm(), i);
  std::ranges::sort(nearest);
  if (nearest.size() > static_cast<std::size_t>(config_.references_max))
    nearest.resize(static_cast<std::size_t>(config_.references_max));
  for (const auto& [away_m, i] : nearest) {
    const double conflict =
        nav::conflict_at(*scans_[i].cloud, *taken_, scans_[i].T_W_S.inverse() * T_W_S);
    if (conflict <= kConflictMax) continue;
    fit.verdict = ScanVerdict::refused;
    fit.reason = fmt::format("scan {}: {:.0f} % of the points stand where the other looked through",
                             scans_[i].number, 100 * conflict);
    return;
  }
}

void ScanRegistrar::judge(const ScanBelief& belief, ScanAttempt& attempt) const {
  ScanFit& fit = attempt.fit;
  if (attempt.pairs.empty()) {
    fit.verdict = ScanVerdict::alone;
    look_through(T_W_S_of(belief.pose, belief.ground_z_m), fit);
    return;
  }
  if (std::ranges::any_of(attempt.pairs, &ScanPair::used)) locate(belief, attempt);
  const auto best = std::ranges::find_if(attempt.pairs, &ScanPair::used);
  const ScanPair& shown = best == attempt.pairs.end() ? attempt.pairs.front() : *best;
  fit.references = static_cast<int>(std::ranges::count_if(attempt.pairs, &ScanPair::used));
  fit.rms_m = shown.figures.rms_m;
  fit.cloud_to_cloud_m = shown.figures.cloud_to_cloud_m;
  fit.overlap = shown.figures.overlap;
  fit.strength_shift = shown.figures.shift[0].strength;
  fit.strength_turn = shown.figures.turn[0].strength;
  fit.verdict = ScanVerdict::refused;
  if (fit.references == 0) {
    const nav::RegistrationConfig gate = pair_config(false);
    const bool met = std::ranges::any_of(attempt.pairs, [&](const ScanPair& pair) {
      return pair.conflict_at > kConflictMax ||
             (pair.figures.pairs >= gate.pairs_min && pair.figures.overlap >= gate.overlap_min);
    });
    if (!met) fit.verdict = ScanVerdict::alone;  // Too little to contradict anything.
    fit.reason = fmt::format(
        "scan {}: {}", shown.with,
        shown.figures.reason.empty() ? "at odds with the other scans" : shown.figures.reason);
    return;
  }
  const Eigen::Vector3d way = between(belief.pose, attempt.measured);
  fit.moved_m = way.head<2>().norm();
  fit.moved_rad = std::abs(way.z());
  fit.chi2 = chi2_of(way, attempt.measured_covariance + belief.covariance);
  if (fit.chi2 > kAgreeChi2) {
    fit.reason = fmt::format(
        "the scans say {:.2f} m and {:.2f} deg beside the localizer, which is sure of {:.2f} m and "
        "{:.2f} deg",
        fit.moved_m, fit.moved_rad * 180 / std::numbers::pi,
        std::sqrt(belief.covariance.topLeftCorner<2, 2>().trace()),
        std::sqrt(belief.covariance(2, 2)) * 180 / std::numbers::pi);
    attempt.pose = belief.pose;
    attempt.covariance = belief.covariance;
    return;
  }
  const bool in_part = std::ranges::all_of(attempt.pairs, [](const ScanPair& pair) {
    return !pair.used || !free_in_plane(pair.figures).empty();
  });
  fit.verdict = in_part ? ScanVerdict::held_in_part : ScanVerdict::accepted;
  if (in_part) fit.reason = free_in_plane(shown.figures);
}

void ScanRegistrar::keep(int number, const ScanBelief& belief, const ScanAttempt& attempt) {
  const std::size_t self = scans_.size();
  scans_.push_back({number, T_W_S_of(attempt.pose, belief.ground_z_m), prior_of(self, belief), {}});
  if (attempt.fit.verdict == ScanVerdict::refused) return;
  for (const ScanPair& pair : attempt.pairs) {
    tried_.insert(pair_of(pair.with, number));
    if (!pair.used) continue;
    links_.push_back({static_cast<int>(index_of(pair.with)), static_cast<int>(self),
                      pair.figures.T_reference_reading, held_covariance(pair.figures)});
  }
  // A localizer that contradicts the scans is no evidence for the pose graph.
  const Eigen::Vector3d way = between(belief.alone, attempt.pose);
  if (chi2_of(way, belief.alone_covariance + attempt.covariance) > kAgreeChi2)
    scans_.back().prior.covariance = upright(
        Eigen::Vector3d(kNowhereSigmaM, kNowhereSigmaM, kNowhereSigmaRad).cwiseAbs2().asDiagonal());
  scans_.back().cloud = std::move(taken_);
  if (in_hand() > static_cast<std::size_t>(config_.in_hand_max))
    std::ranges::find_if(scans_, [](const Scan& scan) {
      return scan.cloud != nullptr;
    })->cloud.reset();
}

std::size_t ScanRegistrar::in_hand() const {
  return static_cast<std::size_t>(
      std::ranges::count_if(scans_, [](const Scan& scan) { return scan.cloud != nullptr; }));
}

void ScanRegistrar::register_left_pairs(TourFit& tour) {
  const nav::RegistrationConfig config = pair_config(false);
  const auto most = 2 * static_cast<std::size_t>(config_.references_max);
  for (std::size_t self = 0; self < scans_.size(); ++self) {
    if (!scans_[self].cloud) continue;
    for (const auto& [overlap, i] : overlapping(*scans_[self].cloud, scans_[self].T_W_S, most)) {
      const Scan &reference = scans_[i], &reading = scans_[self];
      if (!tried_.insert(pair_of(reference.number, reading.number)).second) continue;
      const nav::Registration pair =
          nav::register_scans(*reference.cloud, *reading.cloud,
                              reference.T_W_S.inverse() * reading.T_W_S, config, pieces());
      if (pair.verdict == nav::Verdict::refused) continue;
      ++tour.pairs_new;
      links_.push_back({static_cast<int>(i), static_cast<int>(self), pair.T_reference_reading,
                        held_covariance(pair)});
    }
  }
}

TourFit ScanRegistrar::close() {
  TourFit tour;
  register_left_pairs(tour);
  nav::PoseGraphFit fit = nav::fit_pose_graph(graph()).value();
  tour.pairs_odd = static_cast<int>(fit.odd_links.size());
  if (!fit.odd_links.empty()) {
    std::vector<nav::PoseLink> kept;
    for (std::size_t i = 0; i < links_.size(); ++i)
      if (std::ranges::find(fit.odd_links, static_cast<int>(i)) == fit.odd_links.end())
        kept.push_back(links_[i]);
    links_ = std::move(kept);
    fit = nav::fit_pose_graph(graph()).value();
  }
  tour.pairs = static_cast<int>(links_.size());
  tour.chi2 = fit.chi2;
  tour.settled = fit.settled;
  for (std::size_t i = 0; i < scans_.size(); ++i) {
    if (fit.settled) scans_[i].T_W_S = fit.T_W_S[i];
    tour.scans.push_back(
        {scans_[i].number, plane_pose(scans_[i].T_W_S), plane_part(fit.covariances[i])});
  }
  return tour;
}

void RegistrarChange::apply(RegistrarState& state) const {
  state.scans.push_back(scan);
  state.links.insert(state.links.end(), links.begin(), links.end());
  state.tried.insert(state.tried.end(), tried.begin(), tried.end());
}

RegistrarState ScanRegistrar::state() const {
  RegistrarState state;
  for (const Scan& scan : scans_)
    state.scans.push_back(
        {scan.number, scan.T_W_S, scan.cloud != nullptr, scan.prior.T_W_S, scan.prior.covariance});
  for (const nav::PoseLink& link : links_)
    state.links.push_back({link.from, link.to, link.T_from_to, link.covariance});
  state.tried.assign(tried_.begin(), tried_.end());
  return state;
}

RegistrarChange ScanRegistrar::last_kept() const {
  const Scan& last = scans_.back();
  RegistrarChange change{
      {last.number, last.T_W_S, last.cloud != nullptr, last.prior.T_W_S, last.prior.covariance},
      {},
      {}};
  const int self = static_cast<int>(scans_.size()) - 1;
  for (const nav::PoseLink& link : links_)
    if (link.to == self)
      change.links.push_back({link.from, link.to, link.T_from_to, link.covariance});
  for (const auto& pair : tried_)
    if (pair.first == last.number || pair.second == last.number) change.tried.push_back(pair);
  return change;
}

void ScanRegistrar::take_up(
    const RegistrarState& state,
    const std::function<std::vector<Eigen::Vector3f>(int number)>& S_points_m) {
  scans_.clear();
  links_.clear();
  tried_ = {state.tried.begin(), state.tried.end()};
  for (const RegistrarLink& link : state.links)
    links_.push_back({link.from, link.to, link.T_from_to, link.covariance});
  auto too_many = std::ranges::count(state.scans, true, &RegistrarScan::in_hand) -
                  std::ptrdiff_t{config_.in_hand_max};
  for (const RegistrarScan& scan : state.scans) {
    const int self = static_cast<int>(scans_.size());
    scans_.push_back(
        {scan.number, scan.T_W_S, {self, scan.prior_T_W_S, scan.prior_covariance}, nullptr});
    if (!scan.in_hand || too_many-- > 0) continue;
    take(S_points_m(scan.number));
    scans_.back().cloud = std::move(taken_);
  }
}

}  // namespace mission
