// UBX messages as an epoch's fix, and the receiver's faults by name.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "drivers/ubx_codec.hpp"

namespace drivers {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000, kDay_ns = 86400 * kSecond_ns;

constexpr Fault kNoFix{1, "no fix", "too few satellites", "give the antenna a clear sky"};
constexpr Fault kFixNotOk{1, "fix beyond its limits", "the receiver's masks refuse the fix",
                          "wait, or give the antenna a clear sky"};
constexpr Fault kInvalid{1, "position invalid", "the receiver says so", "do not use this epoch"};
constexpr Fault kTimeUnsure{1, "time not resolved", "no almanac or leap seconds yet",
                            "wait up to 12.5 minutes"};
constexpr Fault kSpoofing[] = {
    {2, "spoofing indicated", "signals are not plausible", "do not trust satellites here"},
    {3, "spoofing on several signals", "signals are not plausible",
     "do not trust satellites here"}};
constexpr Fault kJamming[] = {
    {2, "interference", "a transmitter is near", "move antennas apart, look for a transmitter"},
    {3, "jammed", "a strong transmitter is near", "move away from it"}};
constexpr Fault kAntenna[] = {
    {3, "antenna short", "cable or plug shorted", "replace the cable"},
    {4, "antenna open", "no antenna, or its cable is broken", "connect it, replace the cable"}};
constexpr Fault kRtcmBroken{1, "damaged correction", "corrections are damaged on their way",
                            "check the line that brings them"};
constexpr Fault kRtcmUnused{1, "correction not used", "the receiver cannot use this message",
                            "choose a stream of the receiver's systems"};

int mode_of(const UbxNavPvt& pvt) {
  if (!pvt.fix_ok) return 1;
  if (pvt.fix_type == 3 || pvt.fix_type == 4) return 3;
  return pvt.fix_type == 2 || pvt.fix_type == 1 ? 2 : 1;
}

GnssQuality quality_of(const UbxNavPvt& pvt) {
  if (mode_of(pvt) == 1) return GnssQuality::none;
  if (pvt.fix_type == 1) return GnssQuality::dead_reckoning;
  if (pvt.carrier == UbxCarrier::fixed) return GnssQuality::rtk_fixed;
  if (pvt.carrier == UbxCarrier::floating) return GnssQuality::rtk_float;
  return pvt.differential ? GnssQuality::differential : GnssQuality::single;
}

// Of the codes of NAV-PVT: the most that each can mean; the last has no end.
std::optional<double> correction_age_s(const UbxNavPvt& pvt) {
  constexpr double kMost_s[] = {0, 1, 2, 5, 10, 15, 20, 30, 45, 60, 90, 120, 120};
  if (pvt.correction_age_code == 0) return std::nullopt;
  return kMost_s[std::min<std::size_t>(pvt.correction_age_code, std::size(kMost_s) - 1)];
}

GnssDate date_of(const UbxNavPvt& pvt, bool day_before) {
  using namespace std::chrono;
  const year_month_day said{year(pvt.year), month(pvt.month), day(pvt.day)};
  const year_month_day date = sys_days(said) - days(day_before);
  return {int(date.year()), int(unsigned(date.month())), int(unsigned(date.day()))};
}

void set_position(GnssEpoch& epoch, const UbxNavPvt& pvt) {
  epoch.latitude = ExactAngle::from_1e7deg(pvt.latitude_1e7deg);
  epoch.longitude = ExactAngle::from_1e7deg(pvt.longitude_1e7deg);
  epoch.altitude_ellipsoid_m = pvt.height_mm / 1000.0;
  epoch.altitude_msl_m = pvt.height_msl_mm / 1000.0;
  epoch.geoid_separation_m =
      static_cast<double>(std::int64_t{pvt.height_mm} - pvt.height_msl_mm) / 1000.0;
  epoch.speed_mps = pvt.ground_speed_mmps / 1000.0;
  epoch.track_deg = pvt.motion_heading_1e5deg / 1e5;
  epoch.climb_mps = -(pvt.down_mmps / 1000.0);
  epoch.horizontal_accuracy_m = pvt.horizontal_accuracy_mm / 1000.0;
  epoch.vertical_accuracy_m = pvt.vertical_accuracy_mm / 1000.0;
  epoch.speed_accuracy_mps = pvt.speed_accuracy_mmps / 1000.0;
  if (pvt.heading_valid) epoch.heading_deg = pvt.vehicle_heading_1e5deg / 1e5;
}

void refine(GnssEpoch& epoch, const UbxNavHpposllh& high) {
  if (high.invalid || !epoch.latitude) return;
  epoch.latitude = ExactAngle::from_1e9deg(high.latitude_1e9deg);
  epoch.longitude = ExactAngle::from_1e9deg(high.longitude_1e9deg);
  epoch.altitude_ellipsoid_m = static_cast<double>(high.height_01mm) / 1e4;
  epoch.altitude_msl_m = static_cast<double>(high.height_msl_01mm) / 1e4;
  epoch.horizontal_accuracy_m = high.horizontal_accuracy_01mm / 1e4;
  epoch.vertical_accuracy_m = high.vertical_accuracy_01mm / 1e4;
}

void refine(GnssEpoch& epoch, const UbxNavCov& cov) {
  const auto& m2 = cov.position_m2;
  if (!cov.position_valid || !(m2[0] >= 0 && m2[3] >= 0 && m2[5] >= 0)) return;
  epoch.sigma_north_m = std::sqrt(double{m2[0]});
  epoch.sigma_east_m = std::sqrt(double{m2[3]});
  epoch.sigma_up_m = std::sqrt(double{m2[5]});
}

void refine(GnssEpoch& epoch, const UbxNavDop& dop) {
  epoch.hdop = dop.horizontal / 100.0;
  epoch.vdop = dop.vertical / 100.0;
  epoch.pdop = dop.position / 100.0;
}

std::optional<std::int64_t> itow_of(const UbxMessage& m) {
  if (m.cls != 0x01 || m.payload.size() < 8) {
    const auto eoe = ubx_nav_eoe(m);
    return eoe ? std::optional<std::int64_t>(eoe->itow_ms) : std::nullopt;
  }
  const bool after_version = m.id == 0x14 || m.id == 0x3C;
  return little<std::uint32_t>(m.payload, after_version ? 4 : 0);
}

}  // namespace

GnssEpoch epoch_of(const UbxNavPvt& pvt) {
  GnssEpoch epoch;
  epoch.itow_ms = pvt.itow_ms;
  epoch.mode = mode_of(pvt);
  epoch.quality = quality_of(pvt);
  epoch.satellites_used = pvt.satellites;
  epoch.pdop = pvt.pdop_centi / 100.0;
  epoch.correction_age_s = correction_age_s(pvt);
  if (pvt.date_valid && pvt.time_valid && pvt.month >= 1 && pvt.month <= 12) {
    const std::int64_t time_ns =
        (pvt.hour * 3600LL + pvt.minute * 60LL + pvt.second) * kSecond_ns + pvt.nano;
    // A negative rest may lead to the day before.
    epoch.time_of_day_ns = time_ns < 0 ? time_ns + kDay_ns : time_ns;
    epoch.date = date_of(pvt, time_ns < 0);
  }
  if (epoch.mode >= 2 && !pvt.position_invalid) set_position(epoch, pvt);
  return epoch;
}

std::vector<GnssEpoch> UbxEpochs::add(const UbxMessage& m) {
  std::vector<GnssEpoch> done;
  const auto itow = itow_of(m);
  if (!itow) return done;
  const auto say = end_.see(itow, m.id);
  if (say.begins) {
    if (has_pvt_) done.push_back(epoch_);
    has_pvt_ = false;
  }
  if (const auto pvt = ubx_nav_pvt(m)) epoch_ = epoch_of(*pvt), has_pvt_ = true;
  if (has_pvt_) {
    if (const auto high = ubx_nav_hpposllh(m)) refine(epoch_, *high);
    if (const auto cov = ubx_nav_cov(m)) refine(epoch_, *cov);
    if (const auto dop = ubx_nav_dop(m)) refine(epoch_, *dop);
  }
  const bool eoe = ubx_nav_eoe(m).has_value();
  eoe_ |= eoe;
  if (has_pvt_ && (eoe_ ? eoe : say.ends)) {
    done.push_back(epoch_);
    has_pvt_ = false;
  }
  return done;
}

std::optional<GnssEpoch> UbxEpochs::flush() {
  return std::exchange(has_pvt_, false) ? std::optional(epoch_) : std::nullopt;
}

std::vector<const Fault*> ubx_faults(const UbxNavPvt& pvt) {
  std::vector<const Fault*> found;
  if (pvt.fix_type == 0) found.push_back(&kNoFix);
  if (pvt.fix_type != 0 && !pvt.fix_ok) found.push_back(&kFixNotOk);
  if (pvt.position_invalid) found.push_back(&kInvalid);
  if (!pvt.fully_resolved) found.push_back(&kTimeUnsure);
  return found;
}

std::vector<const Fault*> ubx_faults(const UbxNavStatus& status) {
  std::vector<const Fault*> found;
  if (status.fix_type == 0) found.push_back(&kNoFix);
  if (const Fault* f = fault_of(kSpoofing, status.flags2 >> 3 & 3U)) found.push_back(f);
  return found;
}

std::vector<const Fault*> ubx_faults(const UbxMonRf::Block& block) {
  std::vector<const Fault*> found;
  if (const Fault* fault = fault_of(kJamming, block.jamming)) found.push_back(fault);
  if (const Fault* fault = fault_of(kAntenna, block.antenna)) found.push_back(fault);
  return found;
}

std::vector<const Fault*> ubx_faults(const UbxRxmRtcm& rtcm) {
  std::vector<const Fault*> found;
  if (rtcm.crc_failed) found.push_back(&kRtcmBroken);
  if (rtcm.used == 1) found.push_back(&kRtcmUnused);
  return found;
}

}  // namespace drivers
