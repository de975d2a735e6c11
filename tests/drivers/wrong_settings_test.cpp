// Bit rate, node id, baud, dialect, model, address: what is wrong is told apart for every device,
// and named with its remedy.
#include <algorithm>
#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <functional>
#include <memory>
#include <set>

#include "drivers/agilex_drive.hpp"
#include "drivers/cia402_drive.hpp"
#include "drivers/flir_ptu.hpp"
#include "drivers/gpsd_client.hpp"
#include "drivers/hokuyo.hpp"
#include "drivers/nmea_gnss.hpp"
#include "drivers/ntrip.hpp"
#include "drivers/ouster.hpp"
#include "drivers/power_io.hpp"
#include "drivers/sick_lms.hpp"
#include "drivers/ublox.hpp"
#include "drivers/velodyne.hpp"
#include "drivers/vn100.hpp"
#include "sim/agilex_unit.hpp"
#include "sim/cia402_unit.hpp"
#include "sim/flir_ptu_unit.hpp"
#include "sim/gpsd_unit.hpp"
#include "sim/hokuyo_unit.hpp"
#include "sim/nmea_unit.hpp"
#include "sim/ntrip_unit.hpp"
#include "sim/ouster_unit.hpp"
#include "sim/power_units.hpp"
#include "sim/sick_lms_unit.hpp"
#include "sim/uart.hpp"
#include "sim/ublox_unit.hpp"
#include "sim/vn100_unit.hpp"
#include "tests/drivers/drive_bench.hpp"

namespace wrong_settings {

using namespace drivers_test;

// A CAN controller at another rate than its bus, as SocketCAN shows it: it hears error frames only,
// which are no frames; what it sends nobody acknowledges, and a few milliseconds later it is bus
// off, which whoever receives is told. The kernel restarts it after 100 ms.
class AtAnotherRate final : public hal::CanBus {
 public:
  explicit AtAnotherRate(hal::Clock& clock) : clock_(clock) {}

  hal::Task<hal::Result<void>> send(hal::CanFrame, hal::Time) override {
    if (clock_.now() >= off_until_) {
      co_await clock_.sleep_for(5ms);
      off_until_ = clock_.now() + 100ms;
      untold_ = true;
      off_.notify();
    }
    co_return down();
  }
  hal::Task<hal::Result<hal::ReceivedFrame>> receive() override {
    while (!untold_) co_await off_.wait();
    untold_ = false;
    co_return down();
  }

 private:
  static boost::system::error_code down() {
    return boost::system::errc::make_error_code(errc::network_down);
  }
  hal::Clock& clock_;
  hal::Time off_until_{};
  bool untold_ = false;
  hal::Wake off_;
};

// A Modbus unit whose every answer is this error.
class Answers final : public sim::RegisterUnit {
 public:
  explicit Answers(errc::errc_t error) : error_(error) {}
  hal::Result<std::vector<std::uint16_t>> read_input(hal::RegisterRange) override { return code(); }
  hal::Result<std::vector<std::uint16_t>> read_holding(hal::RegisterRange) override {
    return code();
  }
  hal::Result<std::vector<bool>> read_coils(hal::RegisterRange) override { return code(); }
  hal::Result<std::vector<bool>> read_discrete(hal::RegisterRange) override { return code(); }

 private:
  boost::system::error_code code() const { return errc::make_error_code(error_); }
  errc::errc_t error_;
};

// One device, and what is at the other end of its link.
struct Site : DriveBench {
  sim::CanWire::End& host = wire.attach();
  sim::StreamWire line{clock};
  sim::DatagramWire net{clock};
  sim::UnitFaults faults{clock}, more_faults{clock};
  sim::FixedPan pan;
  sim::Battery charge{sim::BatteryConfig{}, world};
  std::vector<std::shared_ptr<void>> owned;
  drivers::Device* device{};
  std::vector<std::unique_ptr<boost::asio::cancellation_signal>> stops;
  bool ending = false;

  // What runs holds on to what is owned: it ends first.
  ~Site() {
    ending = true;
    for (auto& stop : stops) stop->emit(boost::asio::cancellation_type::terminal);
    io.restart();
    io.poll();
    while (!owned.empty()) owned.pop_back();
  }
  void spawn(hal::Task<void> task) {
    stops.push_back(std::make_unique<boost::asio::cancellation_signal>());
    boost::asio::co_spawn(io, std::move(task),
                          boost::asio::bind_cancellation_slot(stops.back()->slot(),
                                                              [this](std::exception_ptr problem) {
                                                                if (problem && !ending)
                                                                  std::rethrow_exception(problem);
                                                              }));
  }
  template <class T, class... Arguments>
  T& own(Arguments&&... arguments) {
    auto made = std::make_shared<T>(std::forward<Arguments>(arguments)...);
    owned.push_back(made);
    return *made;
  }
  template <class T, class... Arguments>
  T& unit(Arguments&&... arguments) {
    T& made = own<T>(std::forward<Arguments>(arguments)...);
    spawn(made.run());
    return made;
  }
  template <class T, class... Arguments>
  void drive_with(Arguments&&... arguments) {
    T& made = unit<T>(std::forward<Arguments>(arguments)...);
    device = &made;
  }
  // Of a line whose unit's end is `uart`.
  drivers::SettableLine settable(sim::Uart& uart) {
    return {{"/dev/ttyUSB0", static_cast<std::uint32_t>(uart.host_baud())},
            [&uart](int baud) -> hal::Result<void> {
              uart.set_host_baud(baud);
              return {};
            }};
  }
  // The unit's end of a serial line whose other end is set to another rate.
  sim::Uart& at(int unit_baud, int host_baud) {
    sim::Uart& uart = own<sim::Uart>(line.b(), unit_baud);
    uart.set_host_baud(host_baud);
    return uart;
  }
};

template <class Config>
Config of(const std::function<void(Config&)>& change = {}) {
  Config config{};
  if (change) change(config);
  return config;
}

void add_cia402_units(Site& s, std::uint8_t left, std::uint8_t right) {
  sim::Cia402NodeConfig first, second;
  first.node = left;
  second.node = right;
  auto& left_end = s.wire.attach();
  auto& right_end = s.wire.attach();
  s.unit<sim::Cia402Unit>(first, second, s.world, s.clock, left_end, right_end, s.faults,
                          s.more_faults);
}

void add_heartbeat(Site& s) {
  s.spawn([](hal::CanBus& bus, hal::Clock& clock) -> hal::Task<void> {
    for (;;) {
      hal::CanFrame frame;
      frame.id = 0x705;
      frame.size = 1;
      frame.data[0] = 0x7F;
      (void)co_await bus.send(frame, clock.now() + 1s);
      co_await clock.sleep_for(100ms);
    }
  }(s.wire.attach(), s.clock));
}

void add_power(Site& s, sim::RegisterUnit& battery, sim::RegisterUnit& board) {
  auto& battery_wire = s.own<sim::RegisterWire>(s.clock, battery);
  auto& board_wire = s.own<sim::RegisterWire>(s.clock, board);
  s.drive_with<drivers::PowerIo>(drivers::PowerIo::Config{}, s.clock,
                                 drivers::PowerIo::Links{.battery = &battery_wire.client(),
                                                         .gateway = nullptr,
                                                         .board = &board_wire.client(),
                                                         .safety = nullptr});
}
sim::RegisterUnit& victron(Site& s) {
  return s.own<sim::VictronUnit>(sim::VictronUnit::Config{}, s.charge, s.clock, s.faults);
}

drivers::OusterMetadata ouster_metadata(const std::string& profile) {
  std::string text = sim::sample_ouster_metadata();
  const std::string was = "RNG19_RFL8_SIG16_NIR16";
  text.replace(text.find(was), was.size(), profile);
  drivers::OusterMetadata metadata;
  EXPECT_EQ(drivers::parse_ouster_metadata(text, metadata), "");
  return metadata;
}
void add_ouster_unit(Site& s) {
  sim::OusterUnitConfig config;
  config.metadata = ouster_metadata("RNG19_RFL8_SIG16_NIR16");
  s.unit<sim::OusterUnit>(config, s.world, s.clock, s.net.sender(), s.faults);
}

void add_caster(Site& s, const std::function<void(drivers::NtripRequest&)>& change) {
  sim::NtripUnitConfig caster;
  caster.user = "robot";
  caster.password = "right";
  s.unit<sim::NtripUnit>(caster, s.clock, s.line.b(), s.faults);
  drivers::NtripConfig config;
  config.request.host = "rtk.example.org";
  config.request.mountpoint = "SITE0";
  config.request.user = "robot";
  config.request.password = "right";
  change(config.request);
  s.drive_with<drivers::NtripClient>(config, s.clock, s.line.a());
}

void add_ssh_server(Site& s) {
  s.spawn([](hal::ByteStream& end, hal::Clock& clock) -> hal::Task<void> {
    const std::string banner = "SSH-2.0-OpenSSH_9.2p1 Debian-2\r\n";
    const std::vector<std::uint8_t> bytes(banner.begin(), banner.end());
    for (;;) {
      (void)co_await end.write(bytes);
      co_await clock.sleep_for(3s);
    }
  }(s.line.b(), s.clock));
}

struct Wrong {
  const char* device;
  const char* what;
  std::function<void(Site&)> make;
  const char* says;
  const char* advises;
  const char* or_says = "";  // By chance, with the same advice.
};

void PrintTo(const Wrong& wrong, std::ostream* to) {
  *to << wrong.device << wrong.what;
}

const std::vector<Wrong>& all_wrongs() {
  using drivers::AgilexDrive;
  using drivers::Cia402Drive;
  static const std::vector<Wrong> all{
      {"Agilex", "BitRate",
       [](Site& s) {
         s.drive_with<AgilexDrive>(AgilexDrive::Config{}, s.clock, s.own<AtAnotherRate>(s.clock));
       },
       "CAN bus down", "set 500 kbit/s"},
      {"Agilex", "Dialect",
       [](Site& s) {
         auto config =
             of<sim::AgilexUnit::Config>([](auto& c) { c.dialect = drivers::agilex::Dialect::v1; });
         s.unit<sim::AgilexUnit>(config, s.world, nullptr, s.clock, s.wire.attach(), s.faults);
         s.drive_with<AgilexDrive>(AgilexDrive::Config{}, s.clock, s.host);
       },
       "base speaks protocol version 1", "update the base to version 2"},
      {"Agilex", "NotConnected",
       [](Site& s) { s.drive_with<AgilexDrive>(AgilexDrive::Config{}, s.clock, s.host); },
       "nobody acknowledges on the bus", "terminations"},
      {"Agilex", "CanopenOnItsBus",
       [](Site& s) {
         add_heartbeat(s);
         s.drive_with<AgilexDrive>(AgilexDrive::Config{}, s.clock, s.host);
       },
       "another device on the bus", "what the robot file calls the drive"},
      {"Cia402", "BitRate",
       [](Site& s) {
         s.drive_with<Cia402Drive>(Cia402Drive::Config{}, s.clock, s.own<AtAnotherRate>(s.clock));
       },
       "CAN bus down", "set the drives' bit rate"},
      {"Cia402", "NodeId",
       [](Site& s) {
         add_cia402_units(s, 1, 5);
         s.drive_with<Cia402Drive>(Cia402Drive::Config{}, s.clock, s.host);
       },
       "drive silent", "compare node id and bit rate with the robot file"},
      {"Cia402", "NotConnected",
       [](Site& s) { s.drive_with<Cia402Drive>(Cia402Drive::Config{}, s.clock, s.host); },
       "nobody acknowledges on the bus", "terminations"},
      {"Cia402", "OtherDrive",
       [](Site& s) {
         add_cia402_units(s, 1, 2);
         s.drive_with<Cia402Drive>(of<Cia402Drive::Config>([](auto& c) { c.product = 0x777; }),
                                   s.clock, s.host);
       },
       "another drive than expected", "compare vendor and product"},
      {"SickLms", "Baud",
       [](Site& s) {
         s.unit<sim::SickLmsUnit>(sim::SickLmsUnitConfig{}, s.world, s.clock, s.at(57600, 115200),
                                  s.faults, s.pan);
         s.drive_with<drivers::SickLms>(drivers::SickLmsConfig{}, s.clock, s.line.a());
       },
       "no answer", "57600 baud"},  // It speaks only when it is asked in words that it knows.
      {"SickLms", "Model",
       [](Site& s) {
         s.unit<sim::SickLmsUnit>(of<sim::SickLmsUnitConfig>([](auto& c) { c.ident = "TiM551"; }),
                                  s.world, s.clock, s.line.b(), s.faults, s.pan);
         s.drive_with<drivers::SickLms>(drivers::SickLmsConfig{}, s.clock, s.line.a());
       },
       "wrong model", "name this one in the robot file"},
      {"Hokuyo", "Baud",
       [](Site& s) {
         s.unit<sim::HokuyoUnit>(sim::HokuyoUnitConfig{}, s.world, s.clock, s.at(115200, 19200),
                                 s.faults, s.pan);
         s.drive_with<drivers::Hokuyo>(drivers::HokuyoConfig{}, s.clock, s.line.a());
       },
       "not SCIP", "try 19200, 38400 and 115200 baud"},
      {"Hokuyo", "Model",
       [](Site& s) {
         s.unit<sim::HokuyoUnit>(sim::HokuyoUnitConfig{}, s.world, s.clock, s.line.b(), s.faults,
                                 s.pan);
         s.drive_with<drivers::Hokuyo>(
             of<drivers::HokuyoConfig>([](auto& c) { c.model = "UTM-30LX"; }), s.clock, s.line.a());
       },
       "wrong model", "name this one in the robot file"},
      {"Hokuyo", "Address",
       [](Site& s) { s.drive_with<drivers::Hokuyo>(drivers::HokuyoConfig{}, s.clock, s.line.a()); },
       "no answer", "TCP port 10940"},
      {"FlirPtu", "Baud",
       [](Site& s) {
         sim::Uart& uart = s.at(9600, 19200);
         s.unit<sim::FlirPtuUnit>(sim::FlirPtuUnitConfig{}, s.clock, uart, s.faults);
         s.drive_with<drivers::FlirPtu>(drivers::FlirPtuConfig{}, s.clock, s.line.a(),
                                        s.settable(uart));
       },
       "not understood", "set the bit rate of the robot file"},
      {"FlirPtu", "BaudOfAServerInBetween",
       [](Site& s) {
         s.unit<sim::FlirPtuUnit>(sim::FlirPtuUnitConfig{}, s.clock, s.at(9600, 19200), s.faults);
         s.drive_with<drivers::FlirPtu>(drivers::FlirPtuConfig{}, s.clock, s.line.a());
       },
       "no pan-tilt unit's answers", "9600 baud", "no answer"},  // Where noise wakes it to none.
      {"FlirPtu", "Address",
       [](Site& s) {
         s.drive_with<drivers::FlirPtu>(drivers::FlirPtuConfig{}, s.clock, s.line.a());
       },
       "no answer", "TCP port 4000"},
      {"Vn100", "Baud",
       [](Site& s) {
         s.unit<sim::Vn100Unit>(sim::Vn100UnitConfig{}, s.world, s.clock, s.at(115200, 57600),
                                s.faults);
         s.drive_with<drivers::Vn100>(drivers::Vn100Config{}, s.clock, s.line.a());
       },
       "not understood", "set the bit rate of the robot file"},
      {"Vn100", "ReceiverOnItsPort",
       [](Site& s) {
         s.unit<sim::NmeaUnit>(sim::NmeaUnitConfig{{}, {}, 9600}, s.world, s.clock, s.line.b(),
                               s.faults);
         s.drive_with<drivers::Vn100>(drivers::Vn100Config{}, s.clock, s.line.a());
       },
       "another device", "correct the port"},
      {"Vn100", "NotConnected",
       [](Site& s) { s.drive_with<drivers::Vn100>(drivers::Vn100Config{}, s.clock, s.line.a()); },
       "silent", "check power, cable and port"},
      {"Ublox", "Baud",
       [](Site& s) {
         s.unit<sim::UbloxUnit>(sim::UbloxUnitConfig{}, s.world, s.clock, s.at(38400, 4800),
                                s.faults);
         s.drive_with<drivers::Ublox>(drivers::UbloxConfig{}, s.clock, s.line.a());
       },
       "not understood", "set the bit rate of the robot file"},
      {"Ublox", "Dialect",
       [](Site& s) {
         s.unit<sim::UbloxUnit>(
             of<sim::UbloxUnitConfig>([](auto& c) { c.extensions = {"PROTVER 13.00"}; }), s.world,
             s.clock, s.line.b(), s.faults);
         s.drive_with<drivers::Ublox>(drivers::UbloxConfig{}, s.clock, s.line.a());
       },
       "protocol too old", "update the firmware"},
      {"Ublox", "ImuOnItsPort",
       [](Site& s) {
         s.unit<sim::Vn100Unit>(sim::Vn100UnitConfig{}, s.world, s.clock, s.line.b(), s.faults);
         s.drive_with<drivers::Ublox>(drivers::UbloxConfig{}, s.clock, s.line.a());
       },
       "another device", "correct the port"},
      {"Nmea", "Baud",
       [](Site& s) {
         s.unit<sim::NmeaUnit>(sim::NmeaUnitConfig{{}, {}, 9600}, s.world, s.clock,
                               s.at(9600, 38400), s.faults);
         s.drive_with<drivers::NmeaGnss>(drivers::NmeaGnssConfig{}, s.clock, s.line.a());
       },
       "not understood", "set the bit rate of the robot file"},
      {"Nmea", "ImuOnItsPort",
       [](Site& s) {
         s.unit<sim::Vn100Unit>(sim::Vn100UnitConfig{}, s.world, s.clock, s.line.b(), s.faults);
         s.drive_with<drivers::NmeaGnss>(drivers::NmeaGnssConfig{}, s.clock, s.line.a());
       },
       "another device", "correct the port"},
      {"Gpsd", "Address",
       [](Site& s) {
         add_ssh_server(s);
         s.drive_with<drivers::GpsdClient>(drivers::GpsdClientConfig{}, s.clock, s.line.a());
       },
       "another device", "the model in the robot file"},
      {"Gpsd", "Dialect",
       [](Site& s) {
         s.unit<sim::GpsdUnit>(of<sim::GpsdUnitConfig>([](auto& c) { c.protocol_major = 2; }),
                               s.world, s.clock, s.line.b(), s.faults);
         s.drive_with<drivers::GpsdClient>(drivers::GpsdClientConfig{}, s.clock, s.line.a());
       },
       "gpsd of another protocol", "install gpsd 3.x"},
      {"Gpsd", "Receiver",
       [](Site& s) {
         s.unit<sim::GpsdUnit>(sim::GpsdUnitConfig{}, s.world, s.clock, s.line.b(), s.faults);
         s.drive_with<drivers::GpsdClient>(
             of<drivers::GpsdClientConfig>([](auto& c) { c.device = "/dev/ttyS7"; }), s.clock,
             s.line.a());
       },
       "gpsd has no receiver", "name its device to gpsd"},
      {"Vlp16", "Address",
       [](Site& s) {
         s.drive_with<drivers::Velodyne>(drivers::VelodyneConfig{}, s.clock, s.net.receiver());
       },
       "no packets", "this computer's address"},
      {"Vlp16", "OusterSendsThere",
       [](Site& s) {
         add_ouster_unit(s);
         s.drive_with<drivers::Velodyne>(drivers::VelodyneConfig{}, s.clock, s.net.receiver());
       },
       "other packets", "correct the robot file"},
      {"Ouster", "Address",
       [](Site& s) {
         s.drive_with<drivers::Ouster>(
             drivers::OusterConfig{{}, ouster_metadata("RNG19_RFL8_SIG16_NIR16")}, s.clock,
             s.net.receiver());
       },
       "no packets", "this computer's address"},
      {"Ouster", "Profile",
       [](Site& s) {
         add_ouster_unit(s);
         s.drive_with<drivers::Ouster>(
             drivers::OusterConfig{{}, ouster_metadata("RNG15_RFL8_NIR8")}, s.clock,
             s.net.receiver());
       },
       "other packets", "scanner's settings"},
      {"Power", "UnitNumberOfTheBattery",
       [](Site& s) {
         add_power(s, s.own<Answers>(errc::network_unreachable),
                   s.unit<sim::RelayUnit>(s.clock, s.more_faults));
       },
       "gateway does not know this unit", "read the unit numbers in the gateway's menu"},
      {"Power", "BaudOfTheBoard",
       [](Site& s) { add_power(s, victron(s), s.own<Answers>(errc::bad_message)); },
       "damaged replies", "compare baud rate and parity"},
      {"Power", "AddressOfTheBoard",
       [](Site& s) { add_power(s, victron(s), s.own<Answers>(errc::timed_out)); }, "no answer",
       "the address in the robot file"},
      {"Power", "OtherDeviceThanTheBattery",
       [](Site& s) {
         add_power(s, s.own<sim::RegisterUnit>(), s.unit<sim::RelayUnit>(s.clock, s.more_faults));
       },
       "refuses a request", "check what hangs on this address"},
      {"Caster", "Password", [](Site& s) { add_caster(s, [](auto& r) { r.password = "x"; }); },
       "caster refuses user or password", "correct the credentials file"},
      {"Caster", "Mountpoint", [](Site& s) { add_caster(s, [](auto& r) { r.mountpoint = "B"; }); },
       "no such mountpoint", "correct the mountpoint"},
      {"Caster", "Address",
       [](Site& s) {
         add_ssh_server(s);
         s.drive_with<drivers::NtripClient>(
             of<drivers::NtripConfig>([](auto& c) { c.request.mountpoint = "SITE0"; }), s.clock,
             s.line.a());
       },
       "not a caster", "the usual port is 2101"}};
  return all;
}

class WrongSetting : public testing::TestWithParam<Wrong> {};

TEST_P(WrongSetting, IsNamedWithItsRemedy) {
  const Wrong& wrong = GetParam();
  Site site;
  wrong.make(site);
  bool found = false;
  std::set<std::string> said;
  for (int looks = 0; looks < 600 && !found; ++looks) {
    site.wait(50ms);
    for (const drivers::Trouble& trouble : site.device->troubles()) {
      said.insert(text({trouble}));
      const std::string_view name = trouble.fault->name;
      found = found || ((name == wrong.says || name == wrong.or_says) &&
                        trouble.fault->remedy.find(wrong.advises) != std::string_view::npos);
    }
  }
  EXPECT_TRUE(found) << testing::PrintToString(said);
  EXPECT_NE(site.device->state(), drivers::DeviceState::off);
}

INSTANTIATE_TEST_SUITE_P(Devices, WrongSetting, testing::ValuesIn(all_wrongs()),
                         [](const auto& param) {
                           return std::string(param.param.device) + param.param.what;
                         });

// No two wrong settings of a device have one name.
TEST(WrongSettings, AreToldApart) {
  std::set<std::pair<std::string, std::string>> seen;
  for (const Wrong& wrong : all_wrongs())
    EXPECT_TRUE(seen.emplace(wrong.device, wrong.says).second) << wrong.device << wrong.what;
}

// And a device that is wired and set as it should be has none of these names.
TEST(WrongSettings, AreNotSeenWhereThereAreNone) {
  Site s;
  s.unit<sim::AgilexUnit>(sim::AgilexUnit::Config{}, s.world, nullptr, s.clock, s.wire.attach(),
                          s.faults);
  s.drive_with<drivers::AgilexDrive>(drivers::AgilexDrive::Config{}, s.clock, s.host);
  s.wait(5s);
  EXPECT_EQ(text(s.device->troubles()), "");
  Site other;
  add_caster(other, [](auto&) {});
  other.wait(5s);
  EXPECT_EQ(text(other.device->troubles()), "");
}

}  // namespace wrong_settings
