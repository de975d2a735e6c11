#include "sim/cast_ahead.hpp"

#include <algorithm>

namespace sim {
namespace {

constexpr std::size_t kChunkMin = 4, kChunkMax = 64;  // Turns.

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
  caster_ = std::make_unique<ProfileCaster>(world_.scene(), config_.ranges, arc, config_.T_P_L,
                                            config_.seed);
  key_.reset();
}

std::span<const float> CastAhead::of(std::uint64_t number) {
  world_.advance(clock_.now());
  const auto& placed = world_.placed_scanner();
  const Key key{pan_.changes(), placed ? *placed : world_.robot()};
  const bool as_foreseen = key_ && *key_ == key;
  if (!as_foreseen || number < turns_.front().number || number > turns_.back().number) {
    chunk_ = as_foreseen ? std::min(2 * chunk_, kChunkMax) : kChunkMin;
    key_ = key;
    cast(number);
  }
  return std::span<const float>(ranges_m_).subspan((number - turns_.front().number) * arc_.beams,
                                                   arc_.beams);
}

void CastAhead::cast(std::uint64_t number) {
  turns_.clear();
  for (std::size_t i = 0; i < chunk_; ++i) {
    const hal::Time start = start_(number + i);
    turns_.push_back({number + i, pan_.angle_rad(start), pan_.angle_rad(start + arc_time_)});
  }
  ranges_m_.resize(chunk_ * arc_.beams);
  caster_->cast(key_->at.T_W_S(world_.config().scanner.height_m), turns_, config_.threads,
                ranges_m_);
  turns_cast_ += chunk_;
}

}  // namespace sim
