#include "sim/usbip_server.hpp"

#include <algorithm>
#include <string_view>

#include "hal/together.hpp"

namespace sim {
namespace {

using drivers::Bytes;
using drivers::ByteView;

constexpr std::uint32_t kSubmit = 1, kUnlink = 2, kSubmitted = 3, kUnlinked = 4;
constexpr std::int32_t kStall = -32, kConnectionReset = -104;
constexpr std::size_t kTransferMax = 65536;  // Longer ones are no host's.
constexpr std::uint8_t kGetStatus = 0, kGetDescriptor = 6, kGetConfiguration = 8;
constexpr std::uint8_t kDevice = 1, kConfiguration = 2, kString = 3;

// candleLight, two channels: bulk IN 0x81, bulk OUT 0x02.
constexpr std::uint8_t kDeviceDescriptor[] = {18,   1,    0,    2, 0, 0, 0, 64, 0x50,
                                              0x1D, 0x6F, 0x60, 0, 0, 1, 2, 3,  1};
constexpr std::uint8_t kConfigurationDescriptor[] = {
    9, 2, 32,   0, 1, 1,    0,    0x80, 50,  // One interface, 100 mA.
    9, 4, 0,    0, 2, 0xFF, 0xFF, 0xFF, 0,   // Vendor's own class.
    7, 5, 0x81, 2, 0, 2,    0,               // 512 bytes, as high speed asks for.
    7, 5, 0x02, 2, 0, 2,    0};
constexpr std::string_view kStrings[] = {"", "Vantage", "simulated gs_usb adapter", "SN1"};

std::uint32_t big(std::span<const std::uint8_t> bytes, std::size_t at) {
  return std::uint32_t{bytes[at]} << 24 | std::uint32_t{bytes[at + 1]} << 16 |
         std::uint32_t{bytes[at + 2]} << 8 | bytes[at + 3];
}

void put_big(Bytes& bytes, std::uint32_t value) {
  for (const int shift : {24, 16, 8, 0}) bytes.push_back(static_cast<std::uint8_t>(value >> shift));
}

std::uint16_t word(std::span<const std::uint8_t> bytes, std::size_t at) {
  return static_cast<std::uint16_t>(bytes[at] | bytes[at + 1] << 8);
}

// UTF-16; number 0: the languages, English.
std::optional<Bytes> string_descriptor(std::uint8_t number) {
  if (number == 0) return Bytes{4, kString, 0x09, 0x04};
  if (number >= std::size(kStrings)) return std::nullopt;
  Bytes bytes{static_cast<std::uint8_t>(2 + 2 * kStrings[number].size()), kString};
  for (const char c : kStrings[number]) {
    bytes.push_back(static_cast<std::uint8_t>(c));
    bytes.push_back(0);
  }
  return bytes;
}

}  // namespace

UsbipServer::UsbipServer(GsUsbUnit& unit, hal::ByteStream& host) : unit_(unit), host_(host) {
  unit_.on_ready([this] { pump(); });
}

UsbipServer::~UsbipServer() {
  unit_.on_ready(nullptr);
}

hal::Task<void> UsbipServer::run() {
  co_await hal::first_of(read_requests(), write_answers());
}

hal::Task<bool> UsbipServer::read_all(std::span<std::uint8_t> into) {
  while (!into.empty()) {
    const auto got = co_await host_.read_some(into);
    if (!got) co_return false;
    into = into.subspan(*got);
  }
  co_return true;
}

hal::Task<void> UsbipServer::read_requests() {
  Header header;
  for (;;) {
    const bool there = co_await read_all(header);
    if (!there) co_return;
    const std::uint32_t command = big(header, 0);
    if (command == kUnlink) {
      unlink(big(header, 4), big(header, 20));
      continue;
    }
    if (command != kSubmit) co_return;  // No host of ours.
    const bool taken = co_await submit(header);
    if (!taken) co_return;
  }
}

hal::Task<void> UsbipServer::write_answers() {
  for (;;) {
    while (answers_.empty()) co_await answered_.wait();
    const Bytes now = std::exchange(answers_, {});
    const auto written = co_await host_.write(now);
    if (!written) co_return;
  }
}

hal::Task<bool> UsbipServer::submit(const Header& header) {
  const std::uint32_t sequence = big(header, 4), endpoint = big(header, 16);
  const std::uint32_t length = big(header, 24);
  const bool in = big(header, 12) != 0;
  if (length > kTransferMax) co_return false;
  Bytes out(in ? 0 : length);
  const bool there = co_await read_all(out);
  if (!there) co_return false;
  if (endpoint == 0) {
    control(sequence, std::span(header).subspan(40), out);
  } else if (in) {
    reads_.push_back({sequence, length});
    pump();
  } else {
    answer(sequence, 0, length, {});
    unit_.take(out);
  }
  co_return true;
}

void UsbipServer::control(std::uint32_t sequence, std::span<const std::uint8_t> setup,
                          const Bytes& out) {
  const std::uint8_t type = setup[0], request = setup[1];
  const std::uint16_t value = word(setup, 2), length = word(setup, 6);
  const bool in = (type & 0x80) != 0, vendor = (type & 0x60) != 0;
  const auto its = static_cast<drivers::gs_usb::Request>(request);
  std::optional<Bytes> data;
  if (!vendor)
    data = standard(request, value);
  else if (in)
    data = unit_.get(its, value);
  else if (unit_.put(its, value, out))
    data = Bytes{};
  if (!data) return answer(sequence, kStall, 0, {});
  if (!in) return answer(sequence, 0, length, {});
  data->resize(std::min<std::size_t>(data->size(), length));
  answer(sequence, 0, static_cast<std::uint32_t>(data->size()), *data);
}

// What every device answers; nothing to be said where the host only sets something.
std::optional<Bytes> UsbipServer::standard(std::uint8_t request, std::uint16_t value) const {
  if (request == kGetStatus) return Bytes{0, 0};
  if (request == kGetConfiguration) return Bytes{1};
  if (request != kGetDescriptor) return Bytes{};
  const auto number = static_cast<std::uint8_t>(value);
  switch (value >> 8) {
    case kDevice:
      return Bytes(std::begin(kDeviceDescriptor), std::end(kDeviceDescriptor));
    case kConfiguration:
      return Bytes(std::begin(kConfigurationDescriptor), std::end(kConfigurationDescriptor));
    case kString:
      return string_descriptor(number);
    default:
      return std::nullopt;
  }
}

void UsbipServer::pump() {
  while (!reads_.empty()) {
    auto transfer = unit_.next();
    if (!transfer) return;
    const Read read = reads_.front();
    reads_.pop_front();
    transfer->resize(std::min<std::size_t>(transfer->size(), read.length));
    answer(read.sequence, 0, static_cast<std::uint32_t>(transfer->size()), *transfer);
  }
}

void UsbipServer::unlink(std::uint32_t sequence, std::uint32_t target) {
  const auto hit = std::find_if(reads_.begin(), reads_.end(),
                                [&](const Read& read) { return read.sequence == target; });
  const bool found = hit != reads_.end();
  if (found) reads_.erase(hit);
  for (const std::uint32_t each : {kUnlinked, sequence, 0U, 0U, 0U}) put_big(answers_, each);
  put_big(answers_, static_cast<std::uint32_t>(found ? kConnectionReset : 0));
  answers_.insert(answers_.end(), 24, 0);
  answered_.notify();
}

void UsbipServer::answer(std::uint32_t sequence, std::int32_t status, std::uint32_t length,
                         ByteView data) {
  for (const std::uint32_t each : {kSubmitted, sequence, 0U, 0U, 0U}) put_big(answers_, each);
  put_big(answers_, static_cast<std::uint32_t>(status));
  put_big(answers_, length);
  answers_.insert(answers_.end(), 20, 0);
  answers_.insert(answers_.end(), data.begin(), data.end());
  answered_.notify();
}

}  // namespace sim
