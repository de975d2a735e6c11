// The settings of a serial port, applied from a list. Apart from serial_port.cpp because the
// kernel's header for free baud rates and the C library's exclude each other.
#include <asm/ioctls.h>
#include <asm/termbits.h>
#include <sys/file.h>
#include <sys/ioctl.h>

#include <cerrno>

#include "drivers/serial_port.hpp"

namespace drivers {
namespace {

using boost::system::error_code;

error_code last_error() {
  return {errno, boost::system::system_category()};
}

struct Bits {
  tcflag_t mask, value;
};
struct Settings {
  Bits input, output, local, control;
};

Settings settings_for(const SerialLine& line) {
  const tcflag_t parity = line.parity == 'N' ? 0 : line.parity == 'E' ? PARENB : PARENB | PARODD;
  return {
      {IGNBRK | BRKINT | PARMRK | ISTRIP | INLCR | IGNCR | ICRNL | IXON | IXOFF | IXANY | INPCK,
       line.parity == 'N' ? 0U : INPCK},
      {OPOST, 0},
      {ECHO | ECHONL | ICANON | ISIG | IEXTEN, 0},
      {CSIZE | PARENB | PARODD | CSTOPB | CRTSCTS | CLOCAL | CREAD | CBAUD | (CBAUD << IBSHIFT),
       CS8 | CLOCAL | CREAD | BOTHER | parity | (line.stop_bits == 2 ? CSTOPB : 0U)},
  };
}

void put(tcflag_t& flags, Bits bits) {
  flags = (flags & ~bits.mask) | bits.value;
}
bool has(tcflag_t flags, Bits bits) {
  return (flags & bits.mask) == bits.value;
}

// Adapters round the rate; 3 % is what a receiver bears.
bool near(std::uint32_t rate, std::uint32_t wanted) {
  return rate >= wanted - wanted / 33 && rate <= wanted + wanted / 33;
}

bool taken(const termios2& is, const Settings& wanted, std::uint32_t baud) {
  const tcflag_t speed = CBAUD | (CBAUD << IBSHIFT);  // Read back by c_ospeed.
  const Bits control{wanted.control.mask & ~speed, wanted.control.value & ~speed};
  return has(is.c_iflag, wanted.input) && has(is.c_oflag, wanted.output) &&
         has(is.c_lflag, wanted.local) && has(is.c_cflag, control) && near(is.c_ospeed, baud);
}

}  // namespace

error_code apply_settings(int port, const SerialLine& line) {
  termios2 now{};
  if (ioctl(port, TCGETS2, &now) != 0) return last_error();
  const Settings wanted = settings_for(line);
  put(now.c_iflag, wanted.input);
  put(now.c_oflag, wanted.output);
  put(now.c_lflag, wanted.local);
  put(now.c_cflag, wanted.control);
  now.c_ispeed = now.c_ospeed = line.baud;
  now.c_cc[VMIN] = 1;
  now.c_cc[VTIME] = 0;
  if (ioctl(port, TCSETS2, &now) != 0) return last_error();
  termios2 is{};
  if (ioctl(port, TCGETS2, &is) != 0) return last_error();
  if (!taken(is, wanted, line.baud))
    return boost::system::errc::make_error_code(boost::system::errc::invalid_argument);
  ioctl(port, TCFLSH, TCIFLUSH);  // What came at another speed.
  return {};
}

std::uint32_t speed_of(int port) {
  termios2 is{};
  return ioctl(port, TCGETS2, &is) == 0 ? is.c_ospeed : 0;
}

error_code lock_port(int port) {
  if (flock(port, LOCK_EX | LOCK_NB) != 0) return last_error();
  if (ioctl(port, TIOCEXCL) != 0) return last_error();
  return {};
}

void unlock_port(int port) {
  ioctl(port, TIOCNXCL);
  flock(port, LOCK_UN);
}

}  // namespace drivers
