#include <utility>

#include "drivers/nmea_codec.hpp"

namespace drivers {
namespace {

constexpr double kKnot_mps = 1852.0 / 3600.0;

std::optional<std::int64_t> time_of(const NmeaSentence& sentence) {
  return std::visit(
      [](const auto& value) -> std::optional<std::int64_t> {
        if constexpr (requires { value.time_of_day_ns; }) return value.time_of_day_ns;
        return std::nullopt;
      },
      sentence.value);
}

template <class T>
void take(std::optional<T>& into, const std::optional<T>& value) {
  if (value) into = value;
}

void take(std::optional<double>& into, const std::optional<double>& value, double factor) {
  if (value) into = *value * factor;
}

GnssQuality quality_of(int code) {
  constexpr GnssQuality kByCode[] = {GnssQuality::none,           GnssQuality::single,
                                     GnssQuality::differential,   GnssQuality::pps,
                                     GnssQuality::rtk_fixed,      GnssQuality::rtk_float,
                                     GnssQuality::dead_reckoning, GnssQuality::manual,
                                     GnssQuality::simulated};
  return kByCode[code];
}

GnssQuality quality_of_mode(char mode) {
  switch (mode) {
    case 'D':
      return GnssQuality::differential;
    case 'R':
      return GnssQuality::rtk_fixed;
    case 'F':
      return GnssQuality::rtk_float;
    case 'E':
      return GnssQuality::dead_reckoning;
    case 'N':
      return GnssQuality::none;
    default:
      return GnssQuality::single;
  }
}

void merge_into(GnssEpoch& epoch, const NmeaGga& gga) {
  if (!gga.quality || *gga.quality == 0) return;
  epoch.quality = quality_of(*gga.quality);
  epoch.mode = gga.altitude_msl_m ? 3 : std::max(epoch.mode, 2);
  take(epoch.latitude, gga.latitude);
  take(epoch.longitude, gga.longitude);
  take(epoch.altitude_msl_m, gga.altitude_msl_m);
  take(epoch.geoid_separation_m, gga.geoid_separation_m);
  if (gga.altitude_msl_m && gga.geoid_separation_m)
    epoch.altitude_ellipsoid_m = *gga.altitude_msl_m + *gga.geoid_separation_m;
  take(epoch.hdop, gga.hdop);
  take(epoch.satellites_used, gga.satellites);
  take(epoch.correction_age_s, gga.correction_age_s);
  take(epoch.correction_station, gga.station);
}

void merge_into(GnssEpoch& epoch, const NmeaRmc& rmc) {
  take(epoch.date, rmc.date);
  if (!rmc.valid) return;
  epoch.mode = std::max(epoch.mode, 2);
  if (epoch.quality == GnssQuality::none) epoch.quality = quality_of_mode(rmc.mode);
  if (!epoch.latitude) epoch.latitude = rmc.latitude, epoch.longitude = rmc.longitude;
  take(epoch.speed_mps, rmc.speed_knots, kKnot_mps);
  take(epoch.track_deg, rmc.track_deg);
}

void merge_into(GnssEpoch& epoch, const NmeaGll& gll) {
  if (!gll.valid || epoch.latitude) return;
  epoch.mode = std::max(epoch.mode, 2);
  epoch.latitude = gll.latitude;
  epoch.longitude = gll.longitude;
  epoch.quality = quality_of_mode(gll.mode);
}

void merge_into(GnssEpoch& epoch, const NmeaGst& gst) {
  take(epoch.sigma_north_m, gst.latitude_sigma_m);
  take(epoch.sigma_east_m, gst.longitude_sigma_m);
  take(epoch.sigma_up_m, gst.altitude_sigma_m);
}

void merge_into(GnssEpoch& epoch, const NmeaVtg& vtg) {
  if (vtg.mode == 'N') return;
  take(epoch.speed_mps, vtg.speed_knots, kKnot_mps);
  take(epoch.track_deg, vtg.track_deg);
}

void merge_into(GnssEpoch& epoch, const NmeaGsa& gsa) {
  take(epoch.pdop, gsa.pdop);
  take(epoch.hdop, gsa.hdop);
  take(epoch.vdop, gsa.vdop);
  // A receiver may say 3 of one constellation and 1 of another: GGA and RMC know the whole.
  if (gsa.fix && *gsa.fix == 2 && epoch.mode == 3) epoch.mode = 2;
}

void merge_into(GnssEpoch& epoch, const NmeaHdt& hdt) {
  take(epoch.heading_deg, hdt.heading_deg);
}
void merge_into(GnssEpoch& epoch, const NmeaZda& zda) {
  take(epoch.date, zda.date);
}
void merge_into(GnssEpoch&, const NmeaGsv&) {}
void merge_into(GnssEpoch&, const NmeaOther&) {}

}  // namespace

EpochEnd::Say EpochEnd::see(std::optional<std::int64_t> time, int kind, bool repeats) {
  Say say;
  say.begins = !last_ || repeats || (time && time_ && *time != *time_);
  if (say.begins && last_) ender_ = last_;
  if (say.begins) time_.reset();
  if (time) time_ = time;
  last_ = kind;
  say.ends = ender_ == kind;
  return say;
}

GnssEpoch NmeaEpochs::take_epoch() {
  GnssEpoch epoch = *std::exchange(epoch_, std::nullopt);
  if (epoch.date && epoch.time_of_day_ns) {
    date_ = epoch.date;
    date_time_ns_ = *epoch.time_of_day_ns;
  } else if (date_ && epoch.time_of_day_ns && *epoch.time_of_day_ns >= date_time_ns_) {
    epoch.date = date_;
  }
  return epoch;
}

std::vector<GnssEpoch> NmeaEpochs::add(const NmeaSentence& sentence) {
  std::vector<GnssEpoch> done;
  const std::size_t kind = sentence.value.index();
  if (std::holds_alternative<NmeaOther>(sentence.value)) return done;
  const bool once = std::holds_alternative<NmeaGga>(sentence.value) ||
                    std::holds_alternative<NmeaRmc>(sentence.value);
  const auto say = end_.see(time_of(sentence), static_cast<int>(kind) * 64 + seen_[kind] % 64,
                            once && seen_[kind] > 0);
  if (say.begins) {
    if (epoch_) done.push_back(take_epoch());
    seen_ = {};
    epoch_.emplace();
  }
  ++seen_[kind];
  if (!epoch_) return done;  // After what seemed to be the last: too late for its epoch.
  if (const auto time = time_of(sentence)) epoch_->time_of_day_ns = time;
  std::visit([&](const auto& value) { merge_into(*epoch_, value); }, sentence.value);
  if (say.ends) done.push_back(take_epoch());
  return done;
}

std::optional<GnssEpoch> NmeaEpochs::flush() {
  return epoch_ ? std::optional(take_epoch()) : std::nullopt;
}

}  // namespace drivers
