#include "drivers/velodyne.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace drivers {
namespace {

constexpr double kDeg = std::numbers::pi / 180;
constexpr std::uint32_t kRows = 16;
constexpr double kLowest_deg = -15, kRowStep_deg = 2;

std::uint32_t row_of(std::size_t laser) {
  return static_cast<std::uint32_t>(
      std::lround((velodyne_elevation_deg(laser) - kLowest_deg) / kRowStep_deg));
}

}  // namespace

Velodyne::Velodyne(VelodyneConfig config, hal::Clock& clock, hal::Datagrams& datagrams)
    : UdpScanner(config.scan, clock, datagrams), config_(config) {
  identity_ = {"Velodyne", "VLP-16", "", ""};
}

hal::ScanPattern Velodyne::pattern() const {
  const double step = 2 * std::numbers::pi / config_.columns;
  return {step / 2 - std::numbers::pi,
          step,
          kLowest_deg * kDeg,
          kRowStep_deg * kDeg,
          config_.columns,
          kRows};
}

std::string_view Velodyne::read(ByteView bytes, hal::Time arrival) {
  if (const auto why = decode_velodyne(bytes, packet_); !why.empty()) return why;
  std::int64_t now_us = hours_us_ + packet_.timestamp_us;
  constexpr std::int64_t kHour_us = kVelodyneHour_us;
  if (last_us_ && now_us - *last_us_ < -kHour_us / 2) {  // The hour turned.
    hours_us_ += kHour_us;
    now_us += kHour_us;
  }
  const bool dual = packet_.mode == VelodyneReturn::dual;
  const double period_s = kVelodynePacket_us / (dual ? 2e6 : 1e6);
  // The stamps count whole microseconds: two packets differ by one more or less.
  const double step_s = last_us_ ? static_cast<double>(now_us - *last_us_) / 1e6 : period_s;
  if (step_s > 0) fit_.add(now_us * 1000, arrival);
  if (is_new(step_s, period_s, step_s > 0 ? fit_.last_excess_s() : 0)) last_us_ = now_us;
  arrived_ = arrival;
  return {};
}

void Velodyne::begin() {
  swept_deg_ = 0;
  last_azimuth_deg_.reset();
}

void Velodyne::fill(TurnMerge& into) {
  const double azimuth_deg = packet_.points.front().azimuth_deg;
  if (last_azimuth_deg_) swept_deg_ += std::fmod(azimuth_deg - *last_azimuth_deg_ + 360, 360);
  last_azimuth_deg_ = azimuth_deg;
  const double step = 2 * std::numbers::pi / config_.columns;
  for (const VelodynePoint& point : packet_.points) {
    if (point.second_return != 0) continue;
    const double azimuth = -point.azimuth_deg * kDeg;
    const double elevation = velodyne_elevation_deg(point.laser) * kDeg;
    const double at = std::remainder(azimuth, 2 * std::numbers::pi) + std::numbers::pi;
    const auto column = std::min(static_cast<std::uint32_t>(at / step), config_.columns - 1);
    const hal::Beam beam{
        {0, 0, static_cast<float>(velodyne_offset_m(point.laser))},
        Eigen::Vector3d(std::cos(elevation) * std::cos(azimuth),
                        std::cos(elevation) * std::sin(azimuth), std::sin(elevation))
            .cast<float>()};
    into.add(column, row_of(point.laser), static_cast<float>(point.distance_2mm) * 0.002F, beam,
             static_cast<float>(std::abs(at - (column + 0.5) * step)));
  }
}

std::vector<BeamCone> Velodyne::cones() const {
  std::vector<BeamCone> rows(kRows);
  for (std::size_t laser = 0; laser < kRows; ++laser)
    rows[row_of(laser)] = {velodyne_elevation_deg(laser) * kDeg, velodyne_offset_m(laser)};
  return rows;
}

UdpScanner::PacketStart Velodyne::starts() const {
  return {-packet_.points.front().azimuth_deg * kDeg,
          fit_.to_ours(last_us_.value_or(0) * 1000).value_or(arrived_)};
}

void Velodyne::look(TurnAssembly& into) const {
  for (const VelodynePoint& point : packet_.points) {
    if (point.second_return != 0) continue;
    const std::uint32_t row = row_of(point.laser);
    if (into.looks(row))
      into.add(row, -point.azimuth_deg * kDeg, static_cast<float>(point.distance_2mm) * 0.002F);
  }
}

}  // namespace drivers
