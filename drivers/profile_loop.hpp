// The loop of a profile scanner on a byte stream, whatever it speaks: sessions one after the other,
// each of which sets the scanner up anew; its frames; profiles while they are wanted.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/device.hpp"
#include "drivers/profile_stream.hpp"
#include "drivers/resync.hpp"
#include "drivers/signal.hpp"
#include "drivers/troubles.hpp"
#include "hal/clock.hpp"
#include "hal/devices.hpp"
#include "hal/links.hpp"

namespace drivers {

namespace profile_fault {

inline constexpr Fault kUnplugged{1, "no connection",
                                  "the cable, the network or the scanner's power",
                                  "check power, cable and address; it comes back by itself"};
inline constexpr Fault kOtherModel{4, "wrong model", "another scanner than the robot file says",
                                   "connect the right one, or name this one in the robot file"};
inline constexpr Fault kQuiet{7, "scans stopped", "the connection or the scanner hangs",
                              "it is restarted by itself; if it stays, switch its power off and "
                              "on"};

}  // namespace profile_fault

class ProfileLoop : public hal::ProfileScanner, public Device {
 public:
  // Fail with errc::timed_out when the scanner is not there within Nature::start_max.
  hal::Task<hal::Result<void>> start() override;
  hal::Task<hal::Result<void>> stop() override;
  // Fails with errc::timed_out when none comes for 2 s, and with errc::operation_not_permitted
  // before start().
  hal::Task<hal::Result<hal::Profile>> next_profile() override;

  hal::Task<void> run() override;
  DeviceState state() const override { return state_; }
  const Identity& identity() const override { return identity_; }
  std::vector<Trouble> troubles() const override { return troubles_.all(); }

  double clock_jitter_s() const { return watch_.jitter_s(); }  // Of arrivals, lately.

 protected:
  // What differs from scanner to scanner and stays so.
  struct Nature {
    std::size_t frame_max{};
    Look (*look)(ByteView){};
    hal::Duration start_max{};
    std::size_t profiles_max{};  // That wait to be taken; then the oldest are lost and counted.
    double retry_s{};            // From losing the scanner to trying again.
    const Fault *silent{}, *garbage{};
  };

  // The clock and the stream must outlive it.
  ProfileLoop(const Nature& nature, hal::Clock& clock, hal::ByteStream& stream);

  // Forgets what belongs to the session before.
  virtual void begin_session() = 0;
  // Identifies the scanner and sets it up. False ends the session; a trouble says why.
  virtual hal::Task<bool> set_up() = 0;
  virtual void clear_set_up_troubles() = 0;
  virtual hal::Task<bool> is_alive() = 0;  // While it is not measuring.
  // Begins or ends the stream of scans and sets streaming_. False: it does not answer.
  virtual hal::Task<bool> stream(bool on) = 0;
  // After a short silence of a stream. False ends the session.
  virtual hal::Task<bool> revive() { co_return true; }
  virtual bool must_be_set_up_again() const { return false; }
  virtual void end_session() {}
  virtual void take(ByteView frame, hal::Time arrival) = 0;
  virtual double period_s() const = 0;  // From scan to scan.

  // What an answer did not come to: garbage came, or nothing.
  void tell_silence(const std::string& asked);
  // The request, until the deadline.
  hal::Task<void> write(ByteView request, hal::Time deadline);
  std::uint64_t bytes_skipped() const;

  const Nature nature_;
  hal::Clock& clock_;
  DeviceState state_ = DeviceState::off;
  Identity identity_;
  Troubles troubles_;
  ScanWatch watch_{troubles_};
  ProfileQueue queue_;
  Signal answered_, changed_, switched_;
  bool wanted_{}, streaming_{};
  hal::Time last_scan_{};  // Arrival of the last new one, or of the stream's begin.

 private:
  hal::Task<void> session();
  hal::Task<void> receive();
  hal::Task<void> converse();
  hal::Task<void> serve();
  hal::Task<bool> tend_stream();
  hal::Task<hal::Result<void>> wait_until_streaming(bool on);

  hal::ByteStream& stream_;
  Resync resync_;
  std::uint64_t bytes_{};
};

}  // namespace drivers
