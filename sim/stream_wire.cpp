#include <vector>

#include "sim/inbox.hpp"
#include "sim/links.hpp"
#include "sim/wire.hpp"

namespace sim {
namespace {

namespace errc = boost::system::errc;
using Bytes = std::vector<std::uint8_t>;
using View = std::span<const std::uint8_t>;

constexpr std::size_t kPiecesMax = 1024;

}  // namespace

struct StreamWire::Line {
  // One way. Its pieces wait in the inbox; of the one being read, `rest` is left.
  struct Way {
    explicit Way(Line& line) : inbox(line.clock, kPiecesMax, error(errc::not_connected)) {}

    void mend() {
      if (inbox.loss_untold()) {
        rest.clear();
        unread = 0;
      }
      inbox.mend();
    }

    Inbox<Bytes> inbox;
    Bytes rest;
    std::size_t rest_at{};
    std::size_t unread{};  // Bytes in both.
    hal::Time free_at{};   // The last byte given is on the line then.
  };

  class End final : public hal::ByteStream {
   public:
    End(Line& line, Way& out, Way& in) : line_(line), out_(out), in_(in) {}
    hal::Task<hal::Result<void>> write(View bytes) override { return line_.write(out_, bytes); }
    hal::Task<hal::Result<std::size_t>> read_some(std::span<std::uint8_t> into) override {
      return line_.read_some(in_, into);
    }

   private:
    Line& line_;
    Way& out_;
    Way& in_;
  };

  Line(hal::Clock& its_clock, const Config& its_config)
      : clock(its_clock), config(its_config), disturbance(config.seed) {}

  hal::Task<hal::Result<void>> write(Way& way, View bytes);
  hal::Task<hal::Result<std::size_t>> read_some(Way& way, std::span<std::uint8_t> into);
  std::size_t piece_size(const Way& way, std::size_t wanted);
  void send(Way& way, View piece);
  void put(Way& way, hal::Time leaves, View piece);
  void cut(Inbox<Bytes>::UnderWay under_way);

  hal::Clock& clock;
  Config config;
  Disturbance disturbance;
  std::uint64_t connection{};  // Counts the cuts.
  Way there{*this}, back{*this};
  End a{*this, there, back}, b{*this, back, there};
};

hal::Task<hal::Result<void>> StreamWire::Line::write(Way& way, View bytes) {
  const auto mine = connection;
  while (!bytes.empty()) {
    if (!way.inbox.connected() || connection != mine) co_return error(errc::not_connected);
    const std::size_t size = piece_size(way, bytes.size());
    if (size == 0) {
      co_await way.inbox.until_taken();
      continue;
    }
    const std::size_t passes = disturbance.pass(size);
    send(way, bytes.first(passes));
    if (disturbance.cut_now()) cut(Inbox<Bytes>::UnderWay::arrives);
    bytes = bytes.subspan(passes);
  }
  co_return hal::Result<void>{};
}

// 0 while there is no room: two pieces must fit, for one may come twice.
std::size_t StreamWire::Line::piece_size(const Way& way, std::size_t wanted) {
  if (way.inbox.room() < 2 || way.unread >= config.unread_max) return 0;
  const std::size_t fits = std::min(wanted, config.unread_max - way.unread);
  const std::size_t chunk_max = disturbance.faults().chunk_max;
  if (chunk_max == 0) return fits;
  return std::min<std::size_t>(fits, 1 + disturbance.dice().below(chunk_max));
}

void StreamWire::Line::send(Way& way, View piece) {
  const double line_s =
      config.bytes_per_s > 0 ? static_cast<double>(piece.size()) / config.bytes_per_s : 0;
  way.free_at = std::max(clock.now(), way.free_at) + hal::from_seconds(line_s);
  if (piece.empty() || disturbance.loses()) return;
  put(way, way.free_at, piece);
  if (disturbance.doubles()) put(way, way.free_at, piece);
}

void StreamWire::Line::put(Way& way, hal::Time leaves, View piece) {
  Bytes bytes(piece.begin(), piece.end());
  if (disturbance.corrupts()) disturbance.corrupt(bytes);
  way.unread += bytes.size();
  way.inbox.put(disturbance.arrival(leaves), std::move(bytes));
}

hal::Task<hal::Result<std::size_t>> StreamWire::Line::read_some(Way& way,
                                                                std::span<std::uint8_t> into) {
  if (into.empty()) co_return std::size_t{0};
  if (way.rest_at >= way.rest.size()) {
    auto item = co_await way.inbox.take();
    if (!item) co_return item.error();
    way.rest = std::move(item->message);
    way.rest_at = 0;
  }
  std::size_t size = 0;
  for (;;) {
    const std::size_t more = std::min(into.size() - size, way.rest.size() - way.rest_at);
    std::copy_n(way.rest.begin() + static_cast<std::ptrdiff_t>(way.rest_at), more,
                into.begin() + static_cast<std::ptrdiff_t>(size));
    way.rest_at += more;
    size += more;
    if (size == into.size() || disturbance.faults().chunk_max != 0) break;
    auto next = way.inbox.take_ready();
    if (!next) break;
    way.rest = std::move(next->message);
    way.rest_at = 0;
  }
  way.unread -= size;
  co_return size;
}

void StreamWire::Line::cut(Inbox<Bytes>::UnderWay under_way) {
  ++connection;
  there.inbox.cut(under_way);
  back.inbox.cut(under_way);
}

StreamWire::StreamWire(hal::Clock& clock, Config config)
    : line_(std::make_unique<Line>(clock, config)) {}
StreamWire::~StreamWire() = default;

hal::ByteStream& StreamWire::a() {
  return line_->a;
}
hal::ByteStream& StreamWire::b() {
  return line_->b;
}
void StreamWire::set_faults(const LinkFaults& faults) {
  line_->disturbance.set(faults);
  line_->there.inbox.expect_overtaking(faults.reordering > 0);
  line_->back.inbox.expect_overtaking(faults.reordering > 0);
}
void StreamWire::cut() {
  line_->cut(Inbox<Bytes>::UnderWay::lost);
}
void StreamWire::mend() {
  line_->disturbance.mended();
  line_->there.mend();
  line_->back.mend();
}

}  // namespace sim
