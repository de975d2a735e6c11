// A gpsd that serves one receiver of the simulated robot, on one connection.
#pragma once

#include <string>

#include "sim/gnss_source.hpp"

namespace sim {

struct GpsdUnitConfig {
  GnssSourceConfig source;
  std::string device = "/dev/ttyACM0", release = "3.22";
  int protocol_major = 3;
};

// Greets when asked for its version, reports once it is told to watch, as gpsd does: each epoch
// twice, for the two sentences of it.
class GpsdUnit {
 public:
  GpsdUnit(const GpsdUnitConfig& config, World& world, hal::Clock& clock, hal::ByteStream& end,
           UnitFaults& faults);

  hal::Task<void> run();
  void restart() { watched_ = false; }
  void unplug(bool unplugged) { unplugged_ = unplugged; }  // The receiver from its gpsd.
  GnssSky& sky() { return sky_; }

 private:
  hal::Task<void> answer_requests();
  hal::Task<void> answer(std::string_view request);
  hal::Task<void> stream();
  hal::Task<void> say(const std::string& line, int kind);
  std::string version() const;
  std::string devices() const;
  std::string report(const GnssMoment& moment) const;

  GpsdUnitConfig config_;
  hal::Clock& clock_;
  UnitFaults& faults_;
  FaultyStream out_;
  GnssSource source_;
  GnssSky sky_;
  bool watched_ = false, unplugged_ = false;
};

}  // namespace sim
