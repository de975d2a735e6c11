// pcap and pcapng files, and the packets in them.
#include <map>
#include <memory>

#include "drivers/text.hpp"
#include "tools/captures_parts.hpp"
#include "tools/captures_tcp.hpp"

namespace captures {
namespace {

using drivers::big;
using drivers::ByteView;
using drivers::little;

constexpr std::uint32_t kSectionHeader = 0x0A0D0D0A, kByteOrder = 0x1A2B3C4D;
constexpr std::uint32_t kMicroseconds = 0xA1B2C3D4, kNanoseconds = 0xA1B23C4D;
constexpr std::uint32_t kEthernet = 1, kRawIp = 101, kLinuxCooked = 113, kSocketCan = 227,
                        kRawIpv4 = 228;
constexpr std::uint32_t kCanExtended = 1U << 31, kCanRemote = 1U << 30, kCanError = 1U << 29;

std::string ip_text(ByteView address) {
  std::string text;
  for (const auto byte : address) text += (text.empty() ? "" : ".") + std::to_string(byte);
  return text;
}

// What a packet's link says, and then what is inside.
class Packets {
 public:
  explicit Packets(Builder& builder) : builder_(builder) {}

  void packet(std::uint32_t link, std::size_t interface, std::optional<double> t_s,
              ByteView bytes) {
    switch (link) {
      case kEthernet:
        return ethernet(t_s, bytes);
      case kLinuxCooked:
        return by_type(t_s, bytes, 14);
      case kRawIp:
      case kRawIpv4:
        return ipv4(t_s, bytes);
      case kSocketCan:
        return can(interface, t_s, bytes);
      default:
        builder_.skip("link type that is not read", bytes.size());
    }
  }

  void finish() {
    for (auto& [key, side] : sides_) side->tcp.finish(out_of(*side), gap());
  }

 private:
  struct Side {
    TcpSide tcp;
    std::size_t conversation{};
    bool from_device{};
  };

  void ethernet(std::optional<double> t_s, ByteView bytes) {
    std::size_t type_at = 12;
    // VLAN tags.
    while (bytes.size() >= type_at + 4 && (big<std::uint16_t>(bytes, type_at) == 0x8100 ||
                                           big<std::uint16_t>(bytes, type_at) == 0x88A8))
      type_at += 4;
    by_type(t_s, bytes, type_at);
  }

  void by_type(std::optional<double> t_s, ByteView bytes, std::size_t type_at) {
    if (bytes.size() < type_at + 2) return builder_.skip("packet cut short", bytes.size());
    if (big<std::uint16_t>(bytes, type_at) != 0x0800)
      return builder_.skip("packet that is not IPv4", bytes.size());
    ipv4(t_s, bytes.subspan(type_at + 2));
  }

  void ipv4(std::optional<double> t_s, ByteView bytes) {
    if (bytes.size() < 20 || bytes[0] >> 4 != 4)
      return builder_.skip("packet that is not IPv4", bytes.size());
    const std::size_t head = 4U * (bytes[0] & 15U), total = big<std::uint16_t>(bytes, 2);
    if (head < 20 || total < head || total > bytes.size())
      return builder_.skip("packet cut short", bytes.size());
    // More fragments, or not the first one.
    if ((big<std::uint16_t>(bytes, 6) & 0x3FFF) != 0)
      return builder_.skip("IP fragment", bytes.size());
    const ByteView inside = bytes.subspan(head, total - head);
    const std::string from = ip_text(bytes.subspan(12, 4)), to = ip_text(bytes.subspan(16, 4));
    if (bytes[9] == 17) return udp(t_s, from, to, inside);
    if (bytes[9] == 6) return tcp(t_s, from, to, inside);
    builder_.skip("packet that is neither UDP nor TCP", bytes.size());
  }

  bool wanted(std::uint16_t from, std::uint16_t to) const {
    const auto port = builder_.options().port;
    return !port || *port == from || *port == to;
  }

  void udp(std::optional<double> t_s, const std::string& from, const std::string& to,
           ByteView bytes) {
    if (bytes.size() < 8) return builder_.skip("packet cut short", bytes.size());
    const auto from_port = big<std::uint16_t>(bytes, 0), to_port = big<std::uint16_t>(bytes, 2);
    if (!wanted(from_port, to_port)) return builder_.skip("other port", bytes.size());
    const std::size_t size = big<std::uint16_t>(bytes, 4);
    if (size < 8 || size > bytes.size()) return builder_.skip("packet cut short", bytes.size());
    Piece piece;
    piece.t_s = t_s;
    piece.bytes.assign(bytes.begin() + 8, bytes.begin() + static_cast<std::ptrdiff_t>(size));
    piece.conversation = builder_.conversation(from + ":" + std::to_string(from_port) + " - " + to +
                                               ":" + std::to_string(to_port));
    builder_.add(std::move(piece));
  }

  void tcp(std::optional<double> t_s, const std::string& from, const std::string& to,
           ByteView bytes) {
    if (bytes.size() < 20) return builder_.skip("packet cut short", bytes.size());
    const std::size_t head = 4U * (bytes[12] >> 4);
    if (head < 20 || head > bytes.size()) return builder_.skip("packet cut short", bytes.size());
    const auto from_port = big<std::uint16_t>(bytes, 0), to_port = big<std::uint16_t>(bytes, 2);
    if (!wanted(from_port, to_port)) return builder_.skip("other port", bytes.size());
    const bool syn = (bytes[13] & 2) != 0, ack = (bytes[13] & 16) != 0;
    Side& side = side_of(from + ":" + std::to_string(from_port), to + ":" + std::to_string(to_port),
                         syn ? ack : from_port < to_port, syn);
    side.tcp.add({big<std::uint32_t>(bytes, 4), syn, t_s, bytes.subspan(head)}, out_of(side),
                 gap());
  }

  // The device is who was connected to; where the capture joined later, who has the lower port.
  Side& side_of(const std::string& from, const std::string& to, bool from_device, bool sure) {
    auto& side = sides_[from + " " + to];
    if (!side) {
      side = std::make_unique<Side>();
      const auto other = sides_.find(to + " " + from);
      side->from_device = other != sides_.end() && other->second && !sure
                              ? !other->second->from_device
                              : from_device;
      side->conversation =
          builder_.conversation(side->from_device ? from + " - " + to : to + " - " + from);
    }
    return *side;
  }

  TcpSide::Out out_of(const Side& side) {
    return [this, &side](std::optional<double> t_s, ByteView bytes) {
      Piece piece;
      piece.t_s = t_s;
      piece.from_device = side.from_device;
      piece.bytes.assign(bytes.begin(), bytes.end());
      piece.conversation = side.conversation;
      builder_.add(std::move(piece));
    };
  }
  TcpSide::Gap gap() {
    return [this](std::size_t bytes) { builder_.skip("gap in a TCP stream", bytes); };
  }

  // SocketCAN: id with flags big-endian, length, three bytes, data.
  void can(std::size_t interface, std::optional<double> t_s, ByteView bytes) {
    if (bytes.size() < 8) return builder_.skip("packet cut short", bytes.size());
    const auto id = big<std::uint32_t>(bytes, 0);
    if ((id & kCanError) != 0) return builder_.skip("CAN error frame", bytes.size());
    if (bytes[4] > 8) return builder_.skip("CAN FD frame", bytes.size());
    Piece piece;
    piece.t_s = t_s;
    piece.can_extended = (id & kCanExtended) != 0;
    piece.can_remote = (id & kCanRemote) != 0;
    piece.can_id = id & (piece.can_extended ? 0x1FFFFFFFU : 0x7FFU);
    const std::size_t size = piece.can_remote ? 0 : bytes[4];
    if (bytes.size() < 8 + size) return builder_.skip("packet cut short", bytes.size());
    piece.bytes.assign(bytes.begin() + 8, bytes.begin() + 8 + static_cast<std::ptrdiff_t>(size));
    piece.conversation = builder_.conversation("can" + std::to_string(interface));
    builder_.add(std::move(piece));
  }

  Builder& builder_;
  std::map<std::string, std::unique_ptr<Side>> sides_;
};

std::uint32_t word(ByteView bytes, std::size_t at, bool swapped) {
  return swapped ? big<std::uint32_t>(bytes, at) : little<std::uint32_t>(bytes, at);
}
std::uint16_t half(ByteView bytes, std::size_t at, bool swapped) {
  return swapped ? big<std::uint16_t>(bytes, at) : little<std::uint16_t>(bytes, at);
}

void read_classic(ByteView file, Builder& builder, Packets& packets) {
  const auto magic = little<std::uint32_t>(file, 0);
  const bool swapped = magic != kMicroseconds && magic != kNanoseconds;
  const double tick_s = word(file, 0, swapped) == kNanoseconds ? 1e-9 : 1e-6;
  const std::uint32_t link = word(file, 20, swapped) & 0x0FFFFFFF;
  std::size_t at = 24;
  while (at + 16 <= file.size()) {
    const std::size_t size = word(file, at + 8, swapped);
    if (size > file.size() - at - 16) break;
    const double t_s = word(file, at, swapped) + tick_s * word(file, at + 4, swapped);
    packets.packet(link, 0, t_s, file.subspan(at + 16, size));
    at += 16 + size;
  }
  if (at < file.size()) builder.skip("end of file cut off", file.size() - at);
}

struct Interface {
  std::uint32_t link{};
  double tick_s = 1e-6;
};

// Interface description block: options follow after 8 bytes of body; 9 is the time's resolution.
Interface interface_of(ByteView body, bool swapped) {
  Interface result{half(body, 0, swapped)};
  std::size_t at = 8;
  while (at + 4 <= body.size()) {
    const auto code = half(body, at, swapped);
    const std::size_t size = half(body, at + 2, swapped);
    if (code == 0 || at + 4 + size > body.size()) break;
    if (code == 9 && size >= 1) {
      const unsigned value = body[at + 4];
      result.tick_s = 1;
      for (unsigned i = 0; i < (value & 0x7F); ++i) result.tick_s /= (value & 0x80) != 0 ? 2 : 10;
    }
    at += 4 + (size + 3) / 4 * 4;
  }
  return result;
}

class NextGeneration {
 public:
  NextGeneration(Builder& builder, Packets& packets) : builder_(builder), packets_(packets) {}

  void read(ByteView file) {
    std::size_t at = 0;
    while (at + 12 <= file.size()) {
      if (little<std::uint32_t>(file, at) == kSectionHeader) {
        swapped_ = little<std::uint32_t>(file, at + 8) != kByteOrder;
        interfaces_.clear();
      }
      const std::size_t size = word(file, at + 4, swapped_);
      if (size < 12 || size % 4 != 0 || size > file.size() - at) break;
      block(word(file, at, swapped_), file.subspan(at + 8, size - 12));
      at += size;
    }
    if (at < file.size()) builder_.skip("end of file cut off", file.size() - at);
  }

 private:
  void block(std::uint32_t type, ByteView body) {
    if (type == 1 && body.size() >= 8) interfaces_.push_back(interface_of(body, swapped_));
    if (type == 6) enhanced(body);
    if (type == 3) simple(body);
  }

  void enhanced(ByteView body) {
    if (body.size() < 20) return builder_.skip("packet cut short", body.size());
    const std::size_t interface = word(body, 0, swapped_), size = word(body, 12, swapped_);
    if (interface >= interfaces_.size() || size > body.size() - 20)
      return builder_.skip("packet cut short", body.size());
    const auto ticks = std::uint64_t{word(body, 4, swapped_)} << 32 | word(body, 8, swapped_);
    packets_.packet(interfaces_[interface].link, interface,
                    static_cast<double>(ticks) * interfaces_[interface].tick_s,
                    body.subspan(20, size));
  }

  void simple(ByteView body) {
    if (body.size() < 4 || interfaces_.empty())
      return builder_.skip("packet cut short", body.size());
    const std::size_t size = std::min<std::size_t>(word(body, 0, swapped_), body.size() - 4);
    packets_.packet(interfaces_[0].link, 0, std::nullopt, body.subspan(4, size));
  }

  Builder& builder_;
  Packets& packets_;
  bool swapped_ = false;
  std::vector<Interface> interfaces_;
};

bool is_classic(std::string_view file) {
  if (file.size() < 24) return false;
  const auto bytes = drivers::as_bytes(file);
  for (const auto magic : {little<std::uint32_t>(bytes, 0), big<std::uint32_t>(bytes, 0)})
    if (magic == kMicroseconds || magic == kNanoseconds) return true;
  return false;
}

bool is_next_generation(std::string_view file) {
  return file.size() >= 28 && little<std::uint32_t>(drivers::as_bytes(file), 0) == kSectionHeader;
}

}  // namespace

bool looks_like_pcap(std::string_view file) {
  return is_classic(file) || is_next_generation(file);
}

Result<Capture> read_pcap(std::string_view file, std::string_view file_name, Builder builder) {
  Packets packets(builder);
  if (is_classic(file))
    read_classic(drivers::as_bytes(file), builder, packets);
  else if (is_next_generation(file))
    NextGeneration(builder, packets).read(drivers::as_bytes(file));
  else
    return Error{std::string(file_name), 0,
                 "no pcap or pcapng file: its first bytes are others; capture with tcpdump -w"};
  packets.finish();
  return builder.take();
}

}  // namespace captures
