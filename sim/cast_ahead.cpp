#include "sim/cast_ahead.hpp"

#include <algorithm>
#include <cmath>

namespace sim {
namespace {

constexpr std::size_t kChunkMin = 4, kChunkMax = 64;  // Turns,
constexpr std::size_t kChunkMoving = 1;  // of a robot that is elsewhere by the next one.

}  // namespace

bool CastAhead::Key::operator==(const Key& other) const {
  return pan_changes == other.pan_changes && at.pose.position_m == other.at.pose.position_m &&
         at.pose.heading_rad == other.at.pose.heading_rad && at.ground_z_m == other.at.ground_z_m;
}

CastAhead::CastAhead(Config config, World& world, hal::Clock& clock, const PanTruth& pan,
                     TurnStart start)
    : config_(std::move(config)),
      world_(world),
      clock_(clock),
      pan_(pan),
      start_(std::move(start)) {}

void CastAhead::set_arc(const MirrorArc& arc, hal::Duration arc_time) {
  arc_ = arc;
  arc_time_ = arc_time;
  L_directions_.clear();
  for (std::uint32_t i = 0; i < arc.beams; ++i) {
    const double angle_rad = arc.angle_first_rad + i * arc.angle_step_rad;
    L_directions_.emplace_back(std::cos(angle_rad), std::sin(angle_rad), 0);
  }
  caster_ = std::make_unique<ProfileCaster>(world_.scene(), config_.ranges, arc, config_.T_P_L,
                                            config_.seed);
  key_.reset();
}

bool CastAhead::has(std::uint64_t number, std::uint64_t every) const {
  return every == every_ && number >= turns_.front().number && number <= turns_.back().number &&
         (number - turns_.front().number) % every == 0;
}

std::span<const float> CastAhead::of(std::uint64_t number, std::uint64_t every) {
  world_.advance(clock_.now());
  const auto& placed = world_.placed_scanner();
  const Key key{pan_.changes(), placed ? *placed : world_.robot()};
  const bool as_foreseen = key_ && *key_ == key;
  if (!as_foreseen || !has(number, every)) {
    const std::size_t least = world_.moving() ? kChunkMoving : kChunkMin;
    chunk_ = as_foreseen ? std::min(2 * chunk_, kChunkMax) : least;
    every_ = every;
    key_ = key;
    cast(number);
  }
  const std::size_t at = (number - turns_.front().number) / every_;
  const auto ranges_m = std::span<const float>(ranges_m_).subspan(at * arc_.beams, arc_.beams);
  return world_.people().empty() ? ranges_m : with_people(turns_[at], ranges_m);
}

// People walk on while what stands was cast: they are put in as they are now.
std::span<const float> CastAhead::with_people(const MirrorTurn& turn,
                                              std::span<const float> ranges_m) {
  among_people_m_.assign(ranges_m.begin(), ranges_m.end());
  to_people_m_.resize(arc_.beams);
  look_for_people(turn);
  for (std::uint32_t i = 0; i < arc_.beams; ++i) {
    const double range_m = to_people_m_[i];
    const bool seen =
        range_m >= config_.ranges.range_min_m && range_m <= config_.ranges.range_max_m;
    float& reported_m = among_people_m_[i];
    if (seen && (reported_m == 0 || range_m < static_cast<double>(reported_m)))
      reported_m = static_cast<float>(range_m);
  }
  return among_people_m_;
}

// All beams whose pan angle is the same at once: mostly all of a turn.
void CastAhead::look_for_people(const MirrorTurn& turn) {
  const Eigen::Isometry3d T_W_S = key_->at.T_W_S(world_.config().scanner.height_m);
  const auto pan_rad = [&](std::uint32_t beam) {
    return turn.pan_first_rad + (turn.pan_end_rad - turn.pan_first_rad) * beam / arc_.beams;
  };
  for (std::uint32_t first = 0, end = 0; first < arc_.beams; first = end) {
    const Eigen::Isometry3d T_W_L =
        T_W_S * Eigen::AngleAxisd(pan_rad(first), Eigen::Vector3d::UnitZ()) * config_.T_P_L;
    W_directions_.clear();
    for (; end < arc_.beams && pan_rad(end) == pan_rad(first); ++end)
      W_directions_.emplace_back(T_W_L.linear() * L_directions_[end]);
    world_.ranges_to_people_m(T_W_L.translation(), W_directions_,
                              std::span(to_people_m_).subspan(first, end - first));
  }
}

void CastAhead::cast(std::uint64_t number) {
  turns_.clear();
  for (std::size_t i = 0; i < chunk_; ++i) {
    const std::uint64_t turn = number + i * every_;
    const hal::Time start = start_(turn);
    turns_.push_back({turn, pan_.angle_rad(start), pan_.angle_rad(start + arc_time_)});
  }
  ranges_m_.resize(chunk_ * arc_.beams);
  caster_->cast(key_->at.T_W_S(world_.config().scanner.height_m), turns_, config_.threads,
                ranges_m_);
  turns_cast_ += chunk_;
}

}  // namespace sim
