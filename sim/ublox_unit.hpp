// A u-blox receiver on the simulated robot: ZED-F9P, or an eighth generation.
#pragma once

#include <map>
#include <set>
#include <string>

#include "drivers/ublox_startup.hpp"
#include "drivers/ubx_codec.hpp"
#include "sim/gnss_source.hpp"
#include "sim/uart.hpp"

namespace sim {

struct UbloxUnitConfig {
  GnssSourceConfig source;  // Its rate is set over the wire.
  std::string software = "EXT CORE 1.00 (61b2dd)", hardware = "00190000";
  std::vector<std::string> extensions{"ROM BASE 0x118B2060", "FWVER=HPG 1.32",  "PROTVER=27.31",
                                      "MOD=ZED-F9P",         "GPS;GLO;GAL;BDS", "QZSS"};
  int baud = 38400;
};

// Comes up with NMEA at 1 Hz, as sold; settings are forgotten by restart(). With a fix of the
// world's accuracy; RTCM that comes in is counted and reported, and changes nothing else.
class UbloxUnit {
 public:
  UbloxUnit(const UbloxUnitConfig& config, World& world, hal::Clock& clock, hal::ByteStream& end,
            UnitFaults& faults);

  hal::Task<void> run();
  void restart();

  GnssSky& sky() { return sky_; }
  // As MON-RF says: jamming 1 fine, 2 and 3 worse; antenna 2 fine, 3 short, 4 open.
  void set_radio(std::uint8_t jamming, std::uint8_t antenna) {
    jamming_ = jamming, antenna_ = antenna;
  }
  void refuse_key(std::uint32_t key) { refused_key_ = key; }    // Answered by ACK-NAK.
  void forget_key(std::uint32_t key) { forgotten_key_ = key; }  // Acknowledged, not kept.
  Uart& uart() { return uart_; }
  const std::vector<std::uint16_t>& corrections() const { return corrections_; }  // By type.

 private:
  hal::Task<void> answer_requests();
  hal::Task<void> stream();
  hal::Task<void> answer(drivers::ByteView frame);
  hal::Task<void> send(const drivers::Bytes& bytes);
  hal::Task<void> take_correction(drivers::ByteView frame);
  bool apply(const drivers::UbxMessage& message);
  bool apply_keys(const drivers::UbxMessage& message);
  std::vector<drivers::Bytes> replies_to(const drivers::UbxMessage& message);
  std::vector<drivers::Bytes> messages_of(const GnssMoment& moment) const;
  std::optional<drivers::Bytes> asked(const drivers::UbxMessage& message);
  bool sends(std::uint32_t key) const;
  std::uint64_t value(std::uint32_t key) const;

  UbloxUnitConfig config_;
  hal::Clock& clock_;
  UnitFaults& faults_;
  Uart uart_;
  FaultyStream out_;
  GnssSource source_;
  GnssSky sky_;
  bool ninth_;  // Understands keys.
  std::uint8_t jamming_ = 1, antenna_ = 2;
  std::map<std::uint32_t, std::uint64_t> keys_;  // RAM, of UART1 and USB.
  std::uint64_t epochs_ = 0;
  std::optional<std::uint32_t> refused_key_, forgotten_key_;
  std::vector<std::uint16_t> corrections_;
};

// NAV-PVT and NAV-HPPOSLLH of a moment.
drivers::UbxNavPvt nav_pvt(const GnssMoment& moment, const GnssSky& sky);
drivers::UbxNavHpposllh nav_hpposllh(const GnssMoment& moment);

}  // namespace sim
