// The ranges of a turning mirror, cast in chunks before they are needed: as the pan axis will turn
// and the robot will stand if nothing changes that. What turns out otherwise is thrown away, so the
// ranges are always those of the latest truth. With several threads the next chunk is cast while
// this one is asked for.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "hal/clock.hpp"
#include "sim/pan_truth.hpp"
#include "sim/profile_caster.hpp"
#include "sim/world.hpp"

namespace sim {

class CastAhead {
 public:
  struct Config {
    ScannerModel ranges;  // Of it the ranges, their noise and the losses count.
    Eigen::Isometry3d T_P_L = Eigen::Isometry3d::Identity();
    std::uint64_t seed = 1;
    int threads = 2;
  };
  // When turn `number` begins.
  using TurnStart = std::function<hal::Time(std::uint64_t)>;

  CastAhead(Config config, World& world, hal::Clock& clock, const PanTruth& pan, TurnStart start);

  // Another arc, or turns that begin at other times: forgets what was cast.
  void set_arc(const MirrorArc& arc, hal::Duration arc_time);
  // One turn's ranges in metres, 0 where nothing comes back; until the next call. Only every so
  // many turns are going to be asked for.
  std::span<const float> of(std::uint64_t number, std::uint64_t every = 1);

  std::uint64_t turns_cast() const { return turns_cast_; }  // Those thrown away included.

 private:
  struct Key {
    std::uint64_t pan_changes{};
    StandingPose at;
    bool operator==(const Key& other) const;
  };
  struct Chunk {
    std::vector<MirrorTurn> turns;
    std::vector<float> ranges_m;
    bool has(std::uint64_t number) const;
  };
  void renew(std::uint64_t number, bool as_foreseen);
  // Begins to cast those from `number` on.
  void begin(Chunk& chunk, std::uint64_t number, int helpers);
  std::span<const float> with_people(const MirrorTurn& turn, std::span<const float> ranges_m);
  void look_for_people(const MirrorTurn& turn);

  const Config config_;
  World& world_;
  hal::Clock& clock_;
  const PanTruth& pan_;
  const TurnStart start_;
  MirrorArc arc_;
  hal::Duration arc_time_{};
  std::vector<Eigen::Vector3d> L_directions_;  // Of the arc's beams.
  std::optional<Key> key_;
  Chunk now_, next_;  // The next one is being cast, if it has turns.
  std::vector<float> among_people_m_;
  std::vector<Eigen::Vector3d> W_directions_;
  std::vector<double> to_people_m_;
  std::size_t chunk_ = 4;
  std::uint64_t every_ = 1;
  std::uint64_t turns_cast_{};
  std::unique_ptr<ProfileCaster> caster_;  // Last: its threads write into the chunks.
};

}  // namespace sim
