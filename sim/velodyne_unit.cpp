#include "sim/velodyne_unit.hpp"

#include <cmath>
#include <numbers>

namespace sim {
namespace {

constexpr double kDeg = std::numbers::pi / 180;
constexpr std::size_t kBlocks = 12, kPerBlock = 32, kLasers = 16;
constexpr double kCycle_us = 55.296, kLaser_us = 2.304;

}  // namespace

VelodyneUnit::VelodyneUnit(VelodyneUnitConfig config, World& world, hal::Clock& clock,
                           DatagramSender& link, UnitFaults& faults)
    : config_(config),
      world_(world),
      clock_(clock),
      faults_(faults),
      link_(link, clock, faults),
      own_us_(config.clock_start_us) {
  packet_.mode = drivers::VelodyneReturn::strongest;
  packet_.product = config.product;
  packet_.points.resize(kBlocks * kPerBlock);
}

VelodyneUnit::~VelodyneUnit() = default;

hal::Task<void> VelodyneUnit::run() {
  for (;;) {
    const double own_s = drivers::kVelodynePacket_us / 1e6;
    co_await clock_.sleep_for(faults_.slowed(hal::from_seconds(own_s / (1 + config_.skew))));
    const double speed = faults_.wrong_factor() * faults_.slowness();
    if (!faults_.silent()) {
      measure(clock_.now());
      co_await link_.send(drivers::encode_velodyne(packet_));
    }
    own_us_ = std::fmod(own_us_ + drivers::kVelodynePacket_us * speed, drivers::kVelodyneHour_us);
    turned_ += own_s * config_.turns_per_s;
    turned_ -= std::floor(turned_);
    number_ += packet_.points.size();
  }
}

// As if its lasers had fired one after the other while the robot stood as it stands now.
void VelodyneUnit::measure(hal::Time at) {
  world_.advance(at);
  const auto& placed = world_.placed_scanner();
  const Eigen::Isometry3d T_W_S =
      (placed ? *placed : world_.robot()).T_W_S(world_.config().scanner.height_m);
  packet_.timestamp_us = static_cast<std::uint32_t>(own_us_);
  const double highest = world_.moving() ? config_.in_motion_max_rad : std::numbers::pi;
  rays_.clear();
  cast_.clear();
  for (std::size_t i = 0; i < packet_.points.size(); ++i) {
    const std::size_t block = i / kPerBlock, laser = i % kLasers;
    const double delay_us =
        static_cast<double>(i / kLasers) * kCycle_us + static_cast<double>(laser) * kLaser_us;
    const double azimuth_deg = 360 * (turned_ + delay_us / 1e6 * config_.turns_per_s);
    if (i % kPerBlock == 0)
      packet_.block_azimuth_centideg[block] =
          static_cast<std::uint16_t>(std::lround(azimuth_deg * 100) % 36000);
    const double azimuth = -azimuth_deg * kDeg;
    const double elevation = drivers::velodyne_elevation_deg(laser) * kDeg;
    if (elevation > highest) continue;
    cast_.push_back(i);
    rays_.push_back({T_W_S * Eigen::Vector3d(0, 0, drivers::velodyne_offset_m(laser)),
                     T_W_S.linear() * Eigen::Vector3d(std::cos(elevation) * std::cos(azimuth),
                                                      std::cos(elevation) * std::sin(azimuth),
                                                      std::sin(elevation)),
                     number_ + i});
  }
  ranges_m_.resize(rays_.size());
  cast_bundle(world_.scene(), config_.ranges, mix(config_.seed), rays_, ranges_m_);
  see_people(world_, config_.ranges, rays_, ranges_m_);
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    drivers::VelodynePoint& point = packet_.points[cast_[i]];
    const double steps = ranges_m_[i] * 500.0 * faults_.wrong_factor() + 0.5;
    point.distance_2mm = steps < 65536 ? static_cast<std::uint16_t>(steps) : 0;
    point.reflectivity = ranges_m_[i] > 0 ? 40 : 0;
  }
}

}  // namespace sim
