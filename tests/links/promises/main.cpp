// links_promises: asks links of this machine for what every link promises. One line per promise;
// exit 0: all kept, 1: some broken, 2: cannot run.
#include <cstdio>
#include <cstdlib>

#include "drivers/gs_usb.hpp"
#include "drivers/serial_port.hpp"
#include "drivers/socketcan.hpp"
#include "mission/main_command_line.hpp"
#include "tests/links/promises/can_promises.hpp"
#include "tests/links/promises/real_rigs.hpp"

namespace links_test {
namespace {

// Shell commands that do to the hardware what a promise asks for; empty: cannot be done here.
struct Commands {
  std::string cut, mend, silence, wake;

  static bool run(const std::string& command) {
    if (command.empty()) return false;
    if (std::system(command.c_str()) == 0) return true;
    throw std::runtime_error("this failed: " + command);
  }
};

struct CannotRun : std::runtime_error {
  using std::runtime_error::runtime_error;
};

drivers::LinkAddress parsed(const std::string& text) {
  auto address = drivers::parse_link_address(text);
  if (const auto* error = std::get_if<drivers::AddressError>(&address))
    throw CannotRun(error->what);
  return std::get<drivers::LinkAddress>(address);
}

using Pair = std::vector<std::string>;

class CanHardware final : public CanRig {
 public:
  CanHardware(const Pair& pair, const Commands& commands)
      : commands_(commands), a_(open(pair[0])), b_(open(pair[1])) {}
  ~CanHardware() override {
    Commands::run(commands_.wake);
    Commands::run(commands_.mend);
  }
  Loop& loop() override { return loop_; }
  hal::CanBus& a() override { return *a_; }
  hal::CanBus& b() override { return *b_; }
  bool cut() override { return Commands::run(commands_.cut); }
  void mend() override { Commands::run(commands_.mend); }
  bool silence(bool on) override { return Commands::run(on ? commands_.silence : commands_.wake); }
  bool recalls() const override { return own_.empty(); }  // The kernel does not.

 private:
  hal::CanBus* open(const std::string& text) {
    const auto address = parsed(text);
    if (const auto* adapter = std::get_if<drivers::GsUsbAddress>(&address)) {
      if (!usb_)
        usb_ = std::make_unique<drivers::GsUsbBus>(loop_.io().get_executor(), loop_.clock());
      return &usb_->channel(*adapter);
    }
    if (const auto* interface = std::get_if<drivers::CanAddress>(&address))
      return own_
          .emplace_back(std::make_unique<drivers::SocketCan>(*interface, loop_.io().get_executor(),
                                                             loop_.clock()))
          .get();
    throw CannotRun(text + " is no CAN bus");
  }

  const Commands& commands_;
  RealLoop loop_;
  std::unique_ptr<drivers::GsUsbBus> usb_;
  std::vector<std::unique_ptr<drivers::SocketCan>> own_;
  hal::CanBus* a_;
  hal::CanBus* b_;
};

class SerialHardware final : public StreamRig {
 public:
  SerialHardware(const Pair& pair, const Commands& commands)
      : commands_(commands),
        a_(line(pair[0]), loop_.io().get_executor(), loop_.clock()),
        b_(line(pair[1]), loop_.io().get_executor(), loop_.clock()) {}
  ~SerialHardware() override { Commands::run(commands_.mend); }
  Loop& loop() override { return loop_; }
  hal::ByteStream& a() override { return a_; }
  hal::ByteStream& b() override { return b_; }
  bool cut() override { return Commands::run(commands_.cut); }
  void mend() override { Commands::run(commands_.mend); }

 private:
  static drivers::SerialLine line(const std::string& text) {
    const auto address = parsed(text);
    if (const auto* serial = std::get_if<drivers::SerialAddress>(&address)) return serial->line;
    throw CannotRun(text + " is no serial port");
  }

  const Commands& commands_;
  RealLoop loop_;
  drivers::SerialPort a_, b_;
};

class Judge {
 public:
  explicit Judge(std::string only) : only_(std::move(only)) {}

  template <class Rig>
  void ask(const std::string& name, std::span<const Promise<Rig>> promises,
           const std::function<std::unique_ptr<Rig>()>& make) {
    for (const Promise<Rig>& promise : promises) {
      if (promise.name.find(only_) == std::string_view::npos) continue;
      const std::string line = name + " " + std::string(promise.name);
      try {
        const auto rig = make();
        rig->loop().run(promise.keep(*rig));
        tell("ok      ", line, "");
      } catch (const Skipped& skipped) {
        tell("skipped ", line, skipped.what());
      } catch (const CannotRun&) {
        throw;
      } catch (const std::exception& broken) {
        tell("BROKEN  ", line, broken.what());
        all_kept_ = false;
      }
    }
  }
  bool all_kept() const { return all_kept_ && told_ > 0; }

 private:
  void tell(const char* verdict, const std::string& line, const std::string& why) {
    std::printf("%s%s%s%s\n", verdict, line.c_str(), why.empty() ? "" : ": ", why.c_str());
    std::fflush(stdout);
    ++told_;
  }

  std::string only_;
  bool all_kept_ = true;
  int told_ = 0;
};

void ask_this_machine(Judge& judge) {
  judge.ask<StreamRig>("tcp", stream_promises(), make_tcp_rig);
  judge.ask<StreamRig>("serial", stream_promises(), make_serial_rig);
  judge.ask<DatagramRig>("udp", datagram_promises(), make_udp_rig);
  judge.ask<RegisterRig>("modbus-tcp", register_promises(), make_modbus_tcp_rig);
  judge.ask<RegisterRig>("modbus-rtu", register_promises(), make_modbus_rtu_rig);
  judge.ask<RegisterRig>("libmodbus", register_promises(), make_libmodbus_rig);
}

}  // namespace
}  // namespace links_test

int main(int argc, char** argv) {
  using namespace links_test;
  Pair can, serial;
  Commands commands;
  std::string only;
  bool local = false;
  mission::CommandLine line("Asks links of this machine for what every link promises.");
  line.add("--can-pair,--gs-usb", &can, "Two ends of one bus: can:vcan0,can:vcan0", {.pair = true});
  line.add("--serial-pair", &serial, "Two ports on one line: serial:PATH@BAUD,serial:PATH@BAUD",
           {.pair = true});
  line.add("--cut", &commands.cut, "Shell command that takes the link away");
  line.add("--mend", &commands.mend, "Shell command that gives it back; safe to repeat");
  line.add("--silence", &commands.silence, "Shell command: nobody acknowledges the first end");
  line.add("--wake", &commands.wake, "Shell command that ends that; safe to repeat");
  line.add("--only", &only, "Only promises with this in their names");
  line.add("--local", &local, "TCP, UDP, pseudo terminals and Modbus of this machine");
  if (!line.parse(argc, argv)) return line.exit_code();
  Judge judge(only);
  try {
    if (!can.empty())
      judge.ask<CanRig>(can[0], can_promises(),
                        [&] { return std::make_unique<CanHardware>(can, commands); });
    if (!serial.empty())
      judge.ask<StreamRig>(serial[0], stream_promises(),
                           [&] { return std::make_unique<SerialHardware>(serial, commands); });
    if (local) ask_this_machine(judge);
  } catch (const CannotRun& error) {
    std::fprintf(stderr, "links_promises: %s\n", error.what());
    return 2;
  }
  return judge.all_kept() ? 0 : 1;
}
