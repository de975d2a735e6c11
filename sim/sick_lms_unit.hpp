// A SICK LMS1xx or LMS5xx on a simulated pan axis: speaks CoLa, measures in the world.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "drivers/sick_lms_codec.hpp"
#include "drivers/sick_lms_startup.hpp"
#include "hal/clock.hpp"
#include "hal/links.hpp"
#include "hal/wake.hpp"
#include "sim/cast_ahead.hpp"
#include "sim/pan_truth.hpp"
#include "sim/unit_faults.hpp"
#include "sim/world.hpp"

namespace sim {

struct SickLmsUnitConfig {
  bool lms5xx{};
  std::string ident;  // What DeviceIdent says; empty: as the model does.
  std::string firmware = "V1.80.2";
  std::uint32_t serial_number = 20439907;
  std::optional<drivers::ColaDialect> only;  // Old firmware speaks one dialect at a time.
  double skew = 30e-6;                       // Of its crystal: seconds of its own per ours, less 1.
  std::uint32_t clock_start_us = 0;  // What its clock shows at the start and after a restart.
  double boot_s = 12;                // From power to the first answer, after `off` ends.
  bool long_range{};                 // Ranges in steps of 2 mm: up to 131 m instead of 65 m.
  Eigen::Isometry3d T_P_L = Eigen::Isometry3d::Identity();  // How it really hangs on the pan axis.
  ScannerModel ranges;  // Of it the ranges, their noise and the losses count.
  std::uint64_t seed = 1;
  int threads = 2;  // For ray casting; changes nothing but speed.
};

// Refuses what the real one has not. While it streams it casts ahead, as the pan axis will turn if
// nothing changes that, and throws away what turns out otherwise. `wrong` sends ranges and the scan
// frequency off by that factor; after `off` it starts anew and must be set up again.
class SickLmsUnit {
 public:
  // All of these must outlive it.
  SickLmsUnit(SickLmsUnitConfig config, World& world, hal::Clock& clock, hal::ByteStream& link,
              UnitFaults& faults, const PanTruth& pan);
  ~SickLmsUnit();

  hal::Task<void> run();

  // The second status byte of scans: 0 well, 1 error, 2 pollution warning, 4 pollution error.
  void set_status(std::uint8_t status) { status_ = status; }
  bool streaming() const { return streaming_; }
  std::uint64_t scans_sent() const { return scans_sent_; }
  std::uint64_t profiles_cast() const { return ahead_.turns_cast(); }

 private:
  using Message = drivers::ColaMessage;
  using Handler = drivers::Bytes (SickLmsUnit::*)(const Message&);
  struct Known;
  static const Known kKnown[];

  hal::Task<void> listen();
  hal::Task<void> stream();
  hal::Task<void> answer(const Message& message);
  bool booting();
  void restart();

  drivers::Bytes reply(const Message& message);
  drivers::Bytes refuse(std::uint16_t code) const;
  drivers::Bytes say(const Message& to, std::span<const drivers::ColaValue> values = {}) const;
  drivers::Bytes say_text(const Message& to, std::span<const std::string> texts) const;

  drivers::Bytes log_in(const Message& message);
  drivers::Bytes choose_dialect(const Message& message);
  drivers::Bytes identify(const Message& message);
  drivers::Bytes firmware(const Message& message);
  drivers::Bytes state(const Message& message);
  drivers::Bytes hours(const Message& message);
  drivers::Bytes location(const Message& message);
  drivers::Bytes stop_measuring(const Message& message);
  drivers::Bytes start_measuring(const Message& message);
  drivers::Bytes set_scan(const Message& message);
  drivers::Bytes tell_scan(const Message& message);
  drivers::Bytes set_sector(const Message& message);
  drivers::Bytes tell_sector(const Message& message);
  drivers::Bytes set_data(const Message& message);
  drivers::Bytes tell_data(const Message& message);
  drivers::Bytes set_echo(const Message& message);
  drivers::Bytes run_mode(const Message& message);
  drivers::Bytes subscribe(const Message& message);

  double period_s() const;
  std::uint32_t device_us(hal::Time time) const;
  hal::Time turn_start(std::uint64_t number) const;
  MirrorArc arc() const;
  void keep_pace(std::uint64_t number);
  hal::Duration transmission(std::uint64_t number) const;
  hal::Task<void> send(std::uint64_t number, hal::Time sent);
  void fill_header(std::uint64_t number, hal::Time sent);
  void fill_channels(std::span<const float> ranges_m);

  const SickLmsUnitConfig config_;
  hal::Clock& clock_;
  UnitFaults& faults_;
  FaultyStream link_;

  drivers::ColaDialect dialect_ = drivers::ColaDialect::binary;
  drivers::LmsSettings settings_;
  bool logged_in_{}, measuring_ = true, streaming_{}, was_off_{};
  hal::Time powered_{}, ready_{};
  hal::Wake changed_;
  std::uint8_t status_{};

  hal::Time turning_since_{};  // When mirror turn 0 of the present settings began.
  std::uint64_t turns_before_{}, paced_by_{};
  std::uint16_t telegram_counter_{};
  std::uint64_t scans_sent_{}, since_start_{};
  drivers::LmsScan scan_;

  CastAhead ahead_;
  bool cast_anew_ = true;
};

}  // namespace sim
