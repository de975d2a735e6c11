#include "drivers/link_address.hpp"

#include <gtest/gtest.h>

namespace {

using namespace drivers;

TEST(LinkAddress, ReadsEveryKindWhole) {
  const std::pair<const char*, LinkAddress> cases[] = {
      {"can:can0", CanAddress{"can0"}},
      {"gs_usb:0042001A/1@250000", GsUsbAddress{"0042001A", 1, 250'000}},
      {"gs_usb:any@500000", GsUsbAddress{"any", 0, 500'000}},
      {"serial:/dev/ttyUSB0@115200", SerialAddress{{"/dev/ttyUSB0", 115'200, 'N', 1}}},
      {"serial:/dev/serial/by-id/usb-x@9600E2",
       SerialAddress{{"/dev/serial/by-id/usb-x", 9600, 'E', 2}}},
      {"serial:/dev/odd@name@9600O", SerialAddress{{"/dev/odd@name", 9600, 'O', 1}}},
      {"tcp:192.168.1.10:2111", TcpAddress{"192.168.1.10", 2111}},
      {"tcp:lms.local:2112", TcpAddress{"lms.local", 2112}},
      {"tcp:[fe80::1]:80", TcpAddress{"fe80::1", 80}},
      {"udp:2368", UdpAddress{2368, ""}},
      {"udp:2368@192.168.1.201", UdpAddress{2368, "192.168.1.201"}},
      {"modbus-tcp:192.168.1.20:502/100", ModbusTcpAddress{"192.168.1.20", 502, 100}},
      {"modbus-rtu:/dev/ttyUSB0@9600N/1", ModbusRtuAddress{{"/dev/ttyUSB0", 9600, 'N', 1}, 1}},
  };
  for (const auto& [text, wanted] : cases) {
    const auto parsed = parse_link_address(text);
    ASSERT_TRUE(std::holds_alternative<LinkAddress>(parsed)) << text;
    const auto& address = std::get<LinkAddress>(parsed);
    EXPECT_EQ(address, wanted) << text;
    EXPECT_EQ(std::get<LinkAddress>(parse_link_address(to_text(address))), wanted) << text;
  }
}

TEST(LinkAddress, SaysWhatIsWrongAndWhatToWrite) {
  const std::pair<const char*, const char*> cases[] = {
      {"", "begins with its kind"},
      {"can0", "begins with its kind, as in can:can0"},
      {"usb:x", "begins with its kind"},
      {"can:", "1 to 15 characters"},
      {"can:a-name-that-is-too-long", "1 to 15 characters"},
      {"can:can 0", "1 to 15 characters"},
      {"gs_usb:any/0", "bit rate comes behind @"},
      {"gs_usb:any/0@500", "bit rate comes behind @"},
      {"gs_usb:any/x@500000", "channel comes behind /"},
      {"gs_usb:/0@500000", "\"any\" takes the only one"},
      {"serial:ttyUSB0@9600", "begins with /"},
      {"serial:/dev/ttyUSB0", "baud rate is missing"},
      {"serial:/dev/ttyUSB0@", "50 to 4000000"},
      {"serial:/dev/ttyUSB0@9600X", "parity N, E or O"},
      {"serial:/dev/ttyUSB0@9600N3", "parity N, E or O"},
      {"serial:/dev/ttyUSB0@99999999999", "50 to 4000000"},
      {"tcp:host", "port comes behind the host"},
      {"tcp:host:0", "1 to 65535"},
      {"tcp::80", "host is missing"},
      {"tcp:fe80::1:80", "brackets"},
      {"udp:0", "1 to 65535"},
      {"udp:2368@host", "IPv4 address"},
      {"udp:2368@1.2.3.256", "IPv4 address"},
      {"modbus-tcp:host:502", "unit comes behind /"},
      {"modbus-tcp:host:502/256", "unit comes behind /"},
      {"modbus-rtu:/dev/ttyUSB0/1", "baud rate is missing"},
      {"modbus-rtu:/dev/ttyUSB0@9600N/248", "1 to 247"},
  };
  for (const auto& [text, why] : cases) {
    const auto parsed = parse_link_address(text);
    ASSERT_TRUE(std::holds_alternative<AddressError>(parsed)) << text;
    const std::string& what = std::get<AddressError>(parsed).what;
    EXPECT_NE(what.find(why), std::string::npos) << text << ": " << what;
    EXPECT_TRUE(what.find("xample: ") != std::string::npos ||
                what.find("as in can:can0") != std::string::npos)
        << what;
  }
}

TEST(LinkAddress, ShowsOddTextsWithoutTheirOddities) {
  const auto parsed = parse_link_address("tcp:\x1b[31m\n" + std::string(1000, 'x'));
  const std::string& what = std::get<AddressError>(parsed).what;
  EXPECT_EQ(what.find('\x1b'), std::string::npos);
  EXPECT_LT(what.size(), 200U);
}

}  // namespace
