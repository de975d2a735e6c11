// u-blox receivers that speak UBX: the ninth generation (ZED-F9P) and, with less, the eighth.
#pragma once

#include "drivers/device.hpp"
#include "drivers/gnss_output.hpp"
#include "drivers/port_search.hpp"
#include "drivers/ublox_startup.hpp"
#include "hal/devices.hpp"

namespace drivers {

struct UbloxConfig {
  UbloxSettings settings;
  GnssOutputConfig output;  // Its rate is the settings'.
};

// Settings go to RAM only: it comes up as it was, and is told again after every loss. Position to
// 0.1 mm and the covariance need a ninth generation; an eighth gives centimetres and one radius.
class Ublox final : public hal::Gnss, public Device {
 public:
  // `corrections`: RTCM3 to pass on, whole frames only, unchanged; null: none. The settings must
  // have no problem.
  Ublox(const UbloxConfig& config, hal::Clock& clock, hal::ByteStream& stream,
        SetBaud set_baud = {}, hal::ByteStream* corrections = nullptr);

  // The oldest of at most 16 that nobody took yet; waits while there is no fix. Fails with
  // errc::timed_out once per start while the receiver is lost.
  hal::Task<hal::Result<hal::GnssFix>> next_fix() override { return output_.take(); }

  std::string_view model() const override { return "ublox"; }
  hal::Task<void> run() override;
  DeviceState state() const override { return state_; }
  const Identity& identity() const override { return identity_; }
  std::vector<Trouble> troubles() const override { return output_.troubles().all(); }
  std::string condition() const override;

  const GnssOutput& output() const { return output_; }
  int baud() const { return baud_; }
  // Frames of corrections: passed on, and dropped because the receiver was not running.
  std::uint64_t corrections_passed() const { return passed_; }
  std::uint64_t corrections_dropped() const { return dropped_; }
  // Since the last one that was passed on; nothing before the first.
  std::optional<double> since_correction_s() const;

 private:
  hal::Task<void> serve();
  hal::Task<bool> find();
  hal::Task<Found> find_at(int baud);
  hal::Task<bool> configure(bool found);
  hal::Task<bool> apply(const UbloxStep& step);
  hal::Task<bool> ask_version(hal::Time deadline);
  hal::Task<void> listen();
  hal::Task<void> read_epochs();
  hal::Task<void> watch();
  hal::Task<void> pass_corrections();
  hal::Task<hal::Result<void>> send(ByteView request);
  bool identify(const UbxMonVer& version);
  void name_silence();
  void handle(const UbxMessage& message);
  void note(const std::vector<const Fault*>& present, std::vector<const Fault*>& before,
            const std::string& detail);
  void judge_corrections(hal::Time now);

  UbloxConfig config_;
  hal::Clock& clock_;
  hal::ByteStream& stream_;
  SetBaud set_baud_;
  hal::ByteStream* corrections_;
  FrameReader reader_;
  GnssOutput output_;
  UbxEpochs epochs_;
  std::optional<std::uint32_t> itow_ms_;  // Of the last NAV-PVT.
  Identity identity_;
  std::optional<UbloxModel> model_;
  DeviceState state_ = DeviceState::off;
  int baud_;
  bool was_running_ = false;
  std::vector<const Fault*> navigation_faults_, radio_faults_, correction_faults_;
  hal::Time correction_at_{};
  bool passing_ = false;  // A correction is being written.
  std::uint64_t passed_{}, dropped_{};
};

}  // namespace drivers
