#include "sim/nmea_unit.hpp"

#include <cmath>
#include <cstdio>

#include "drivers/nmea_codec.hpp"
#include "drivers/text.hpp"

namespace sim {
namespace {

using drivers::GnssQuality;

constexpr hal::Duration kLinkPause = std::chrono::milliseconds(100);
constexpr double kGeoid_m = 46.0;

template <class... Values>
std::string formatted(const char* format, Values... values) {
  char text[256];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

std::string time_text(std::int64_t time_of_day_ns) {
  const std::int64_t ms = time_of_day_ns / 1'000'000;
  return formatted("%02d%02d%02d.%03d", static_cast<int>(ms / 3'600'000),
                   static_cast<int>(ms / 60'000 % 60), static_cast<int>(ms / 1000 % 60),
                   static_cast<int>(ms % 1000));
}

// Degrees as "ddmm.mmm,N", rounded once so that there are never 60 minutes.
std::string angle_text(double degrees, int degree_digits, char positive, char negative,
                       int digits) {
  const auto unit = static_cast<std::int64_t>(std::llround(std::pow(10.0, digits)));
  const std::int64_t units = std::llround(std::abs(degrees) * 60.0 * static_cast<double>(unit));
  const std::int64_t minutes = units / unit;
  return formatted("%0*d%02d.%0*lld,%c", degree_digits, static_cast<int>(minutes / 60),
                   static_cast<int>(minutes % 60), digits, static_cast<long long>(units % unit),
                   degrees < 0 ? negative : positive);
}

int quality_code(GnssQuality quality) {
  return static_cast<int>(quality);  // In the order of GGA's codes.
}
char mode_letter(GnssQuality quality) {
  constexpr char kLetters[] = {'N', 'A', 'D', 'P', 'R', 'F', 'E', 'M', 'S'};
  return kLetters[static_cast<int>(quality)];
}

}  // namespace

std::vector<std::string> nmea_sentences(const GnssMoment& moment, const GnssSky& sky,
                                        const NmeaForm& form) {
  const bool fix = sky.quality != GnssQuality::none;
  const std::string time = time_text(moment.utc_time_of_day_ns);
  const std::string at =
      !fix ? ",,,"
           : angle_text(moment.at.latitude_deg, 2, 'N', 'S', form.minute_digits) + "," +
                 angle_text(moment.at.longitude_deg, 3, 'E', 'W', form.minute_digits);
  const std::string date =
      formatted("%02d%02d%02d", moment.date.day, moment.date.month, moment.date.year % 100);
  std::vector<std::string> sentences;
  const auto add = [&](const std::string& text) {
    sentences.push_back(drivers::encode_nmea(form.talker + text));
  };
  add("RMC," + time + "," + (fix ? "A" : "V") + "," + at + ",0.0,," + date + ",,," +
      mode_letter(sky.quality));
  add("GGA," + time + "," + at + "," + std::to_string(quality_code(sky.quality)) +
      formatted(",%02d,0.7,", sky.satellites) +
      (fix ? formatted("%.4f,M,%.1f,M,", moment.at.height_m - kGeoid_m, kGeoid_m) : ",,,,") +
      (fix ? "1.0,0001" : ","));
  if (form.accuracy && fix)
    add("GST," + time +
        formatted(",%.4f,,,,%.4f,%.4f,%.4f", moment.sigma_m, moment.sigma_m, moment.sigma_m,
                  2 * moment.sigma_m));
  return sentences;
}

NmeaUnit::NmeaUnit(const NmeaUnitConfig& config, World& world, hal::Clock& clock,
                   hal::ByteStream& end, UnitFaults& faults)
    : config_(config),
      clock_(clock),
      faults_(faults),
      uart_(end, config.baud),
      out_(uart_, clock, faults),
      source_(config.source, world, clock, faults) {}

hal::Task<void> NmeaUnit::run() {
  for (;;) {
    co_await source_.next_due(config_.source.rate_hz);
    if (faults_.silent()) continue;
    int kind = 0;
    const GnssMoment moment = source_.sample();
    const auto sentences = nmea_sentences(moment, sky_at(moment, sky_), config_.form);
    for (const std::string& sentence : sentences) {
      const auto sent = co_await out_.write(drivers::as_bytes(sentence), kind++);
      if (!sent) co_await clock_.sleep_for(kLinkPause);
    }
  }
}

}  // namespace sim
