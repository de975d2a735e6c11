// Where scans really stood: every new one is laid over those in hand, and when a tour closes all
// pairs are brought to agree. Values only; waits for nothing.
//
// Scans are registered in all six directions. The mission's poses are upright and on the ground of
// their area, as everywhere in it: x, y and heading are taken over; height and tilt are only kept
// from bending them.
#pragma once

#include <functional>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "mission/config.hpp"
#include "mission/record.hpp"
#include "nav/registration/pose_graph.hpp"
#include "nav/registration/registration.hpp"

namespace mission {

// Where a scan is thought to have been taken before it is laid over others.
struct ScanBelief {
  hal::Pose2 pose;  // By all that is known.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
  hal::Pose2 alone;  // By all but other scans: what the pose graph may count as its own evidence.
  Eigen::Matrix3d alone_covariance = Eigen::Matrix3d::Identity();
  double ground_z_m{};
};

struct ScanPair {
  int with{};  // Number of the scan in hand.
  nav::Registration figures;
  bool used{};           // Accepted, and not at odds with the others.
  double conflict_at{};  // figures.conflict where the scan is believed to be.
};

struct ScanAttempt {
  ScanFit fit;
  std::vector<ScanPair> pairs;
  // Where to merge it: by the other scans and alone. As believed unless it was accepted.
  hal::Pose2 pose;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
  // What the other scans say by themselves: a measurement for the localizer. Directions that they
  // leave free have sigmas of 10 m or 1 rad.
  hal::Pose2 measured;
  Eigen::Matrix3d measured_covariance = Eigen::Matrix3d::Identity();
};

// All scans together.
struct TourFit {
  struct Scan {
    int number{};
    hal::Pose2 pose;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
  };
  std::vector<Scan> scans;   // As they were kept.
  int pairs{}, pairs_new{};  // That hold them together; of these, first registered here.
  int pairs_odd{};           // Left out: at odds with the rest.
  double chi2{};
  bool settled{};
};

// What a registrar keeps of its scans, but for their points: see ScanRegistrar::state.
struct RegistrarScan {
  int number{};
  Eigen::Isometry3d T_W_S = Eigen::Isometry3d::Identity();
  bool in_hand{};
  Eigen::Isometry3d prior_T_W_S = Eigen::Isometry3d::Identity();
  nav::Matrix6d prior_covariance = nav::Matrix6d::Identity();
};
struct RegistrarLink {
  int from{}, to{};  // By their place among the scans.
  Eigen::Isometry3d T_from_to = Eigen::Isometry3d::Identity();
  nav::Matrix6d covariance = nav::Matrix6d::Identity();
};
struct RegistrarState {
  std::vector<RegistrarScan> scans;
  std::vector<RegistrarLink> links;
  std::vector<std::pair<int, int>> tried;  // Pairs of numbers, the lower first, ascending.
};
// What keep() added to it.
struct RegistrarChange {
  RegistrarScan scan;
  std::vector<RegistrarLink> links;
  std::vector<std::pair<int, int>> tried;

  void apply(RegistrarState& state) const;
};

class ScanRegistrar {
 public:
  ScanRegistrar(const RegisterConfig& config, const ScannerConfig& scanner, int threads);
  ~ScanRegistrar();

  // The scan that attempt() and keep() are about, from now on. Points in S.
  void take(const std::vector<Eigen::Vector3f>& S_points_m);
  // Lays it over the scans that it overlaps most where it is believed to be. `other_guesses`: also
  // from guesses beside that.
  ScanAttempt attempt(const ScanBelief& belief, bool other_guesses);
  // Takes it in hand with its pose: later scans are laid over it. One that was refused is only
  // remembered by its belief.
  void keep(int number, const ScanBelief& belief, const ScanAttempt& attempt);

  // Registers the pairs that overlap and were not tried, and finds the poses that fit all best.
  TourFit close();

  std::size_t in_hand() const;

  // All but the points, and what the last keep() added.
  RegistrarState state() const;
  RegistrarChange last_kept() const;
  // In place of what it has: exactly as another was. S_points_m tells the points of a scan in hand;
  // of those only the last [register] in_hand_max are in hand.
  void take_up(const RegistrarState& state,
               const std::function<std::vector<Eigen::Vector3f>(int number)>& S_points_m);

 private:
  struct Scan;

  nav::RunPieces pieces() const;
  nav::RegistrationConfig pair_config(bool other_guesses) const;
  std::vector<std::pair<double, std::size_t>> overlapping(const nav::PreparedScan& scan,
                                                          const Eigen::Isometry3d& T_W_S,
                                                          std::size_t count) const;
  nav::PoseGraph graph() const;
  void locate(const ScanBelief& belief, ScanAttempt& attempt) const;
  void judge(const ScanBelief& belief, ScanAttempt& attempt) const;
  void look_through(const Eigen::Isometry3d& T_W_S, ScanFit& fit) const;
  Eigen::Isometry3d T_W_S_of(const hal::Pose2& pose, double ground_z_m) const;
  nav::PosePrior prior_of(std::size_t scan, const ScanBelief& belief) const;
  std::size_t index_of(int number) const;
  void register_left_pairs(TourFit& tour);

  const RegisterConfig config_;
  const ScannerConfig scanner_;
  const int threads_;
  std::vector<Scan> scans_;
  std::vector<nav::PoseLink> links_;
  std::set<std::pair<int, int>> tried_;  // By numbers, the lower first.
  std::unique_ptr<nav::PreparedScan> taken_;
};

}  // namespace mission
