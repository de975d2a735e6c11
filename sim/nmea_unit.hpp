// A receiver that sends NMEA 0183 on the simulated robot.
#pragma once

#include <string>
#include <vector>

#include "sim/gnss_source.hpp"
#include "sim/uart.hpp"

namespace sim {

struct NmeaForm {
  std::string talker = "GN";
  bool accuracy = true;   // Sends GST.
  int minute_digits = 7;  // 0.2 mm.
};

struct NmeaUnitConfig {
  GnssSourceConfig source;
  NmeaForm form;
  int baud = 9600;
};

// Sends by itself and hears nothing.
class NmeaUnit {
 public:
  NmeaUnit(const NmeaUnitConfig& config, World& world, hal::Clock& clock, hal::ByteStream& end,
           UnitFaults& faults);

  hal::Task<void> run();
  GnssSky& sky() { return sky_; }
  Uart& uart() { return uart_; }

 private:
  NmeaUnitConfig config_;
  hal::Clock& clock_;
  UnitFaults& faults_;
  Uart uart_;
  FaultyStream out_;
  GnssSource source_;
  GnssSky sky_;
};

// RMC, GGA and, where asked for, GST of a moment, each with its checksum and line end.
std::vector<std::string> nmea_sentences(const GnssMoment& moment, const GnssSky& sky,
                                        const NmeaForm& form);

}  // namespace sim
