// Any receiver that sends NMEA 0183 by itself: nothing is told to it.
#pragma once

#include "drivers/device.hpp"
#include "drivers/gnss_output.hpp"
#include "drivers/nmea_codec.hpp"
#include "hal/devices.hpp"

namespace drivers {

struct NmeaGnssConfig {
  GnssOutputConfig output;  // rate_hz: as the receiver is set.
  int baud = 9600;          // Listened at first.
};

inline constexpr int kNmeaBauds[] = {9600, 38400, 115200, 4800, 19200, 57600, 230400, 460800};

// Takes GGA and RMC, and the accuracy of GST where it comes.
class NmeaGnss final : public hal::Gnss, public Device {
 public:
  NmeaGnss(const NmeaGnssConfig& config, hal::Clock& clock, hal::ByteStream& stream,
           SetBaud set_baud = {});

  // As Ublox::next_fix.
  hal::Task<hal::Result<hal::GnssFix>> next_fix() override { return output_.take(); }

  std::string_view model() const override { return "nmea"; }
  hal::Task<void> run() override;
  DeviceState state() const override { return state_; }
  const Identity& identity() const override { return identity_; }  // The talkers' name at most.
  std::vector<Trouble> troubles() const override { return output_.troubles().all(); }

  const GnssOutput& output() const { return output_; }
  int baud() const { return baud_; }

 private:
  hal::Task<bool> find();
  hal::Task<bool> hears_position(hal::Time deadline);
  hal::Task<void> listen();
  hal::Task<void> read_sentences();
  hal::Task<void> watch();
  void identify(const NmeaSentence& sentence);
  void name_silence();
  void take(const std::vector<GnssEpoch>& epochs);

  NmeaGnssConfig config_;
  hal::Clock& clock_;
  SetBaud set_baud_;
  FrameReader reader_;
  GnssOutput output_;
  NmeaEpochs epochs_;
  Identity identity_;
  DeviceState state_ = DeviceState::off;
  int baud_;
  bool was_running_ = false;
};

}  // namespace drivers
