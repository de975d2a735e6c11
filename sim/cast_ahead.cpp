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

bool CastAhead::Chunk::has(std::uint64_t number) const {
  if (turns.empty()) return false;
  const std::uint64_t first = turns.front().number;
  const std::uint64_t every = turns.size() > 1 ? turns[1].number - first : 1;
  return number >= first && number <= turns.back().number && (number - first) % every == 0;
}

std::span<const float> CastAhead::of(std::uint64_t number, std::uint64_t every) {
  world_.advance(clock_.now());
  const auto& placed = world_.placed_scanner();
  const Key key{pan_.changes(), placed ? *placed : world_.robot()};
  const bool as_foreseen = key_ && *key_ == key && every == every_;
  if (!as_foreseen || !now_.has(number)) {
    every_ = every;
    key_ = key;
    renew(number, as_foreseen);
  }
  const std::size_t at = (number - now_.turns.front().number) / every_;
  const auto ranges_m = std::span<const float>(now_.ranges_m).subspan(at * arc_.beams, arc_.beams);
  return world_.people().empty() ? ranges_m : with_people(now_.turns[at], ranges_m);
}

// As foreseen, chunks get longer, and the next one is begun.
void CastAhead::renew(std::uint64_t number, bool as_foreseen) {
  if (as_foreseen && next_.has(number)) {
    std::swap(now_, next_);
  } else {
    const std::size_t least = world_.moving() ? kChunkMoving : kChunkMin;
    chunk_ = as_foreseen ? std::min(2 * chunk_, kChunkMax) : least;
    begin(now_, number, config_.threads - 1);
  }
  caster_->finish();
  next_.turns.clear();
  if (!as_foreseen || config_.threads < 2) return;
  chunk_ = std::min(2 * chunk_, kChunkMax);
  begin(next_, now_.turns.back().number + every_, config_.threads - 1);
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

void CastAhead::begin(Chunk& chunk, std::uint64_t number, int helpers) {
  chunk.turns.clear();
  for (std::size_t i = 0; i < chunk_; ++i) {
    const std::uint64_t turn = number + i * every_;
    const hal::Time start = start_(turn);
    chunk.turns.push_back({turn, pan_.angle_rad(start), pan_.angle_rad(start + arc_time_)});
  }
  chunk.ranges_m.resize(chunk_ * arc_.beams);
  caster_->begin(key_->at.T_W_S(world_.config().scanner.height_m), chunk.turns, helpers,
                 chunk.ranges_m);
  turns_cast_ += chunk_;
}

}  // namespace sim
