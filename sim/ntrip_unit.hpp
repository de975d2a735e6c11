// An NTRIP caster with one mountpoint, and the base behind it.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "drivers/ntrip_codec.hpp"
#include "drivers/site_frame.hpp"
#include "hal/clock.hpp"
#include "sim/unit_faults.hpp"

namespace sim {

struct NtripUnitConfig {
  std::string mountpoint = "SITE0", user, password;           // Empty user: who asks needs none.
  drivers::NtripVersion version = drivers::NtripVersion::v2;  // That it answers in.
  bool chunked = true;                                        // Of version 2.
  bool wants_position = false;                                // It sends nothing before a GGA came.
  drivers::GeoPoint base{48.0, 11.0, 500};
  std::int64_t itow_ms = 302'400'000;  // GPS time at our time 0, of the week.
};

// Answers like a caster; frames come every second: the base's place at first and every 10 s,
// observations of four systems with a header as it is and contents that are random. `wrong` moves
// the base by that share of its distance from the earth's middle.
class NtripUnit {
 public:
  NtripUnit(NtripUnitConfig config, hal::Clock& clock, hal::ByteStream& end, UnitFaults& faults);

  hal::Task<void> run();

  // Switches at run time.
  void answer_with(std::string text) { answer_ = std::move(text); }  // To all; empty: as it should.
  void mute(bool on) { mute_ = on; }          // Answers, and then sends nothing.
  void speak_rtcm2(bool on) { rtcm2_ = on; }  // Sends another format.
  void hang_up() { hang_up_ = true; }         // Says that no more comes.

  const std::vector<std::string>& positions() const { return positions_; }  // GGA that came.
  int asked() const { return asked_; }

 private:
  hal::Task<void> answer_requests();
  hal::Task<void> stream();
  hal::Task<void> answer(const drivers::NtripAsked& asked);
  hal::Task<void> say(std::string text, int kind);
  hal::Task<void> send(const drivers::Bytes& frame, int kind);
  std::string answer_to(const drivers::NtripAsked& asked);
  std::string table() const;
  std::vector<drivers::Bytes> frames(std::int64_t second);
  Eigen::Vector3d base_ecef_m() const;
  std::int64_t second_now() const;

  const NtripUnitConfig config_;
  hal::Clock& clock_;
  UnitFaults& faults_;
  FaultyStream out_;
  Dice dice_{77};
  std::string heard_, answer_;
  std::vector<std::string> positions_;
  bool streaming_{}, mute_{}, rtcm2_{}, hang_up_{};
  std::int64_t first_{};  // Second of the stream.
  int asked_{};
};

}  // namespace sim
