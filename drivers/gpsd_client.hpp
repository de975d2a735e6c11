// A client of gpsd (TCP, JSON): takes the receiver that gpsd serves.
#pragma once

#include "drivers/device.hpp"
#include "drivers/gnss_output.hpp"
#include "drivers/gpsd_codec.hpp"
#include "hal/devices.hpp"

namespace drivers {

struct GpsdClientConfig {
  GnssOutputConfig output;  // rate_hz: as the receiver behind gpsd is set.
  std::string device;       // Only reports of this one ("/dev/ttyACM0"); empty: of any.
};

class GpsdClient final : public hal::Gnss, public Device {
 public:
  GpsdClient(const GpsdClientConfig& config, hal::Clock& clock, hal::ByteStream& stream);

  // As Ublox::next_fix.
  hal::Task<hal::Result<hal::GnssFix>> next_fix() override { return output_.take(); }

  std::string_view model() const override { return "gpsd"; }
  hal::Task<void> run() override;
  DeviceState state() const override { return state_; }
  const Identity& identity() const override { return identity_; }  // gpsd and its release.
  std::vector<Trouble> troubles() const override { return output_.troubles().all(); }

  const GnssOutput& output() const { return output_; }
  const std::vector<GpsdDevice>& devices() const { return devices_; }  // That gpsd has.

 private:
  hal::Task<bool> greet();
  hal::Task<bool> watch_devices(bool greeted);
  hal::Task<std::optional<GpsdMessage>> next_message(hal::Time deadline);
  hal::Task<void> listen();
  hal::Task<void> read_reports();
  hal::Task<void> watch();
  bool accept(const GpsdVersion& version);
  void name_silence();
  void judge_devices();
  void handle(const GpsdMessage& message);
  void take(const GpsdTpv& tpv);
  void give_pending();

  GpsdClientConfig config_;
  hal::Clock& clock_;
  hal::ByteStream& stream_;
  FrameReader reader_;
  GnssOutput output_;
  Identity identity_;
  std::vector<GpsdDevice> devices_;
  DeviceState state_ = DeviceState::off;
  bool was_running_ = false;
  std::string report_time_;  // Of the last report, how often it came, and whether it was used.
  int reports_ = 0;
  bool given_ = false;
  std::optional<GnssEpoch> pending_;
  hal::Time pending_at_{};
};

}  // namespace drivers
