#include "tests/links/promises/real_rigs.hpp"

#include <unistd.h>

#include <boost/asio/ip/udp.hpp>
#include <filesystem>

#include "drivers/modbus_client.hpp"
#include "drivers/peers.hpp"
#include "drivers/serial_port.hpp"
#include "drivers/tcp_stream.hpp"
#include "drivers/udp_port.hpp"
#include "sim/modbus_server.hpp"
#include "tests/links/promises/libmodbus_server.hpp"

namespace links_test {
namespace {

void rethrow_ours(std::exception_ptr problem) {
  try {
    if (problem) std::rethrow_exception(problem);
  } catch (const boost::system::system_error&) {  // Cancelled.
  }
}

std::string pty_path() {
  static int count = 0;
  return std::filesystem::temp_directory_path() /
         ("vantage-pty-" + std::to_string(getpid()) + "-" + std::to_string(count++));
}

class TcpRig final : public StreamRig {
 public:
  Loop& loop() override { return loop_; }
  hal::ByteStream& a() override { return ours_; }
  hal::ByteStream& b() override { return peer_; }
  bool cut() override {
    peer_.unplug();
    return true;
  }
  void mend() override { peer_.plug_in(); }

 private:
  RealLoop loop_;
  drivers::TcpPeer peer_{"127.0.0.1", 0, loop_.io().get_executor(), loop_.clock()};
  drivers::TcpStream ours_{{"127.0.0.1", peer_.port()}, loop_.io().get_executor(), loop_.clock()};
};

class SerialRig final : public StreamRig {
 public:
  Loop& loop() override { return loop_; }
  hal::ByteStream& a() override { return ours_; }
  hal::ByteStream& b() override { return peer_; }
  bool cut() override {
    peer_.unplug();
    return true;
  }
  void mend() override { peer_.plug_in(); }

 private:
  RealLoop loop_;
  std::string path_ = pty_path();
  drivers::PtyPeer peer_{path_, loop_.io().get_executor(), loop_.clock()};
  drivers::SerialPort ours_{{path_, 115200}, loop_.io().get_executor(), loop_.clock()};
};

class UdpRig final : public DatagramRig {
 public:
  Loop& loop() override { return loop_; }
  hal::Datagrams& port() override { return port_; }
  hal::Task<void> send(std::span<const std::uint8_t> datagram) override {
    sender_.send(datagram);
    co_return;
  }
  std::uint64_t lost() const override { return port_.lost_datagrams(); }

 private:
  // One that is free now.
  static std::uint16_t free_port() {
    using boost::asio::ip::udp;
    boost::asio::io_context io;
    udp::socket socket(io, udp::endpoint(udp::v4(), 0));
    return socket.local_endpoint().port();
  }

  RealLoop loop_;
  std::uint16_t number_ = free_port();
  drivers::UdpPort port_{{number_, "127.0.0.1"}, loop_.io().get_executor(), loop_.clock()};
  drivers::UdpSender sender_{"127.0.0.1", number_, loop_.io().get_executor()};
};

constexpr std::uint8_t kUnit = 17;

// Our unit behind a peer.
template <class Peer>
class ModbusRig : public RegisterRig {
 public:
  Loop& loop() override { return loop_; }
  hal::Registers& client() override { return bus_->unit(kUnit); }
  bool silence(bool on) override {
    unit_.faults()->set({on ? sim::UnitFault::off : sim::UnitFault::none, 0});
    return true;
  }
  bool cut() override {
    peer_->unplug();
    return true;
  }
  void mend() override { peer_->plug_in(); }

 protected:
  void start(sim::ModbusWire wire, drivers::ModbusBus::Address address) {
    boost::asio::co_spawn(loop_.io(),
                          sim::serve_modbus(*peer_, wire, loop_.clock(),
                                            [this](std::uint8_t number) {
                                              return number == kUnit ? &unit_ : nullptr;
                                            }),
                          rethrow_ours);
    bus_ = std::make_unique<drivers::ModbusBus>(std::move(address), loop_.io().get_executor(),
                                                loop_.clock());
  }

  RealLoop loop_;
  TableUnit unit_{loop_.clock()};
  std::unique_ptr<Peer> peer_;
  std::unique_ptr<drivers::ModbusBus> bus_;
};

class ModbusTcpRig final : public ModbusRig<drivers::TcpPeer> {
 public:
  ModbusTcpRig() {
    peer_ = std::make_unique<drivers::TcpPeer>("127.0.0.1", 0, loop_.io().get_executor(),
                                               loop_.clock());
    start(sim::ModbusWire::tcp, drivers::ModbusTcpAddress{"127.0.0.1", peer_->port(), kUnit});
  }
};

class ModbusRtuRig final : public ModbusRig<drivers::PtyPeer> {
 public:
  ModbusRtuRig() {
    const std::string path = pty_path();
    peer_ = std::make_unique<drivers::PtyPeer>(path, loop_.io().get_executor(), loop_.clock());
    start(sim::ModbusWire::rtu, drivers::ModbusRtuAddress{{path, 19200}, kUnit});
  }
  bool has_connection() const override { return false; }
};

class LibmodbusRig final : public RegisterRig {
 public:
  Loop& loop() override { return loop_; }
  hal::Registers& client() override { return bus_.unit(kUnit); }
  bool cut() override {
    server_.stop();
    return true;
  }
  void mend() override { server_.start(); }
  bool has_raw_coils() const override { return false; }

 private:
  RealLoop loop_;
  LibmodbusServer server_;
  drivers::ModbusBus bus_{drivers::ModbusTcpAddress{"127.0.0.1", server_.port(), kUnit},
                          loop_.io().get_executor(), loop_.clock()};
};

}  // namespace

std::unique_ptr<StreamRig> make_tcp_rig() {
  return std::make_unique<TcpRig>();
}
std::unique_ptr<StreamRig> make_serial_rig() {
  return std::make_unique<SerialRig>();
}
std::unique_ptr<DatagramRig> make_udp_rig() {
  return std::make_unique<UdpRig>();
}
std::unique_ptr<RegisterRig> make_modbus_tcp_rig() {
  return std::make_unique<ModbusTcpRig>();
}
std::unique_ptr<RegisterRig> make_modbus_rtu_rig() {
  return std::make_unique<ModbusRtuRig>();
}
std::unique_ptr<RegisterRig> make_libmodbus_rig() {
  return std::make_unique<LibmodbusRig>();
}

}  // namespace links_test
