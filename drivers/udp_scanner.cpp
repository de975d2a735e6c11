#include "drivers/udp_scanner.hpp"

#include <array>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <cmath>
#include <limits>
#include <utility>

namespace drivers {
namespace {

using namespace std::chrono_literals;
using namespace boost::asio::experimental::awaitable_operators;
namespace errc = boost::system::errc;
using errc::make_error_code;

constexpr Fault kSilent{1, "no packets",
                        "no power, still starting, a cable, or it sends to another address or port",
                        "check power and cable; set the scanner to send to this computer's address "
                        "and the port of the robot file"};
constexpr Fault kForeign{2, "other packets",
                         "another device or model sends here, or it is set to another format",
                         "see the detail; correct the robot file or the scanner's settings"};
constexpr Fault kReceive{3, "cannot receive", "the network port", "see the detail"};

constexpr hal::Duration kSilence = 1s;
constexpr hal::Duration kComeBack = 10s;
constexpr int kForeignInARow = 10;
constexpr hal::Duration kLookTimeout = 1s;
constexpr float kNoClaim = std::numeric_limits<float>::quiet_NaN();

}  // namespace

TurnMerge::TurnMerge(const hal::ScanPattern& pattern) {
  cloud_.pattern = pattern;
  cloud_.ranges_m.assign(pattern.beams(), kNoClaim);
  cloud_.beams.resize(pattern.beams());
  off_rad_.assign(pattern.beams(), std::numeric_limits<float>::infinity());
  for (std::uint32_t c = 0; c < pattern.columns; ++c) {
    const double azimuth = pattern.azimuth_first_rad + c * pattern.azimuth_step_rad;
    for (std::uint32_t r = 0; r < pattern.rows; ++r) {
      const double elevation = pattern.elevation_first_rad + r * pattern.elevation_step_rad;
      cloud_.beams[std::size_t{c} * pattern.rows + r].S_direction =
          Eigen::Vector3d(std::cos(elevation) * std::cos(azimuth),
                          std::cos(elevation) * std::sin(azimuth), std::sin(elevation))
              .cast<float>();
    }
  }
}

void TurnMerge::add(std::uint32_t column, std::uint32_t row, float range_m, const hal::Beam& beam,
                    float off_rad) {
  const std::size_t cell = std::size_t{column} * cloud_.pattern.rows + row;
  float& known_m = cloud_.ranges_m[cell];
  const bool return_now = range_m > 0, return_before = known_m > 0;
  if (return_before && !return_now) return;
  if (return_before == return_now && off_rad_[cell] <= off_rad) return;
  known_m = range_m;
  off_rad_[cell] = off_rad;
  cloud_.beams[cell] = beam;
}

std::size_t TurnMerge::unmeasured() const {
  std::size_t count = 0;
  for (const float range_m : cloud_.ranges_m) count += std::isnan(range_m);
  return count;
}

hal::ScanCloud TurnMerge::take(hal::Time stamp) {
  cloud_.stamp = stamp;
  return std::move(cloud_);
}

UdpScanner::UdpScanner(UdpScanConfig config, hal::Clock& clock, hal::Datagrams& datagrams)
    : config_(config), clock_(clock), datagrams_(datagrams) {}

hal::Task<void> UdpScanner::run() {
  state_ = DeviceState::starting;
  last_packet_ = clock_.now();
  co_await (receive() && watch());
}

hal::Task<void> UdpScanner::receive() {
  std::vector<std::uint8_t> buffer(65536);
  for (;;) {
    const auto got = co_await datagrams_.receive(buffer);
    if (!got) {
      troubles_.set(kReceive, got.error().message());
      co_await clock_.sleep_for(100ms);
      continue;
    }
    troubles_.clear(kReceive);
    take(ByteView(buffer).first(got->size), got->stamp);
  }
}

void UdpScanner::take(ByteView packet, hal::Time arrival) {
  fresh_ = false;
  const auto why = read(packet, arrival);
  if (!why.empty()) {
    ++others_;
    if (++others_in_a_row_ >= kForeignInARow)
      troubles_.set(kForeign, std::string(why) + " (" + std::to_string(packet.size()) + " bytes)");
    return;
  }
  others_in_a_row_ = 0;
  if (!fresh_) return;
  ++packets_;
  last_packet_ = arrival;
  troubles_.clear(kForeign);
  troubles_.clear(kSilent);
  if (state_ != DeviceState::running) {
    state_ = DeviceState::running;
    changed_.notify();
  }
  if (turns_) take_look();
  if (!merge_) return;
  fill(*merge_);
  if (turns_done() >= config_.turns) done_.notify();
}

// A turn with gaps might lack just what is in the way.
void UdpScanner::take_look() {
  const PacketStart start = starts();
  if (auto turn = turns_->next_packet(start.azimuth_rad, start.at)) {
    const auto lost = static_cast<double>(lost_ - turn_lost_);
    const auto came = static_cast<double>(packets_ - turn_packets_);
    turn_lost_ = lost_;
    turn_packets_ = packets_;
    if (lost <= config_.look_lost_share_max * (lost + came))
      put(std::move(*turn));
    else
      ++looks_lost_;
  }
  look(*turns_);
}

void UdpScanner::put(hal::Turn turn) {
  turn.lost_before = std::exchange(looks_lost_, 0);
  looks_.push_back(std::move(turn));
  if (looks_.size() > kLooksMax) {
    const std::uint64_t lost = 1 + looks_.front().lost_before;
    looks_.pop_front();
    looks_.front().lost_before += lost;
  }
  looked_.notify();
}

hal::Task<hal::Result<void>> UdpScanner::start() {
  turns_.emplace(look_columns(), cones(), config_.look_max_rad);
  looks_.clear();
  turn_lost_ = lost_;
  turn_packets_ = packets_;
  looks_lost_ = 0;
  if (state_ != DeviceState::running) co_return make_error_code(errc::not_connected);
  co_return hal::Result<void>{};
}

hal::Task<hal::Result<void>> UdpScanner::stop() {
  turns_.reset();
  co_return hal::Result<void>{};
}

hal::Task<hal::Result<hal::Turn>> UdpScanner::next_turn() {
  const hal::Time deadline = clock_.now() + kLookTimeout;
  if (!turns_) co_return make_error_code(errc::operation_not_permitted);
  while (looks_.empty()) {
    const bool some = co_await looked_.wait_until(clock_, deadline);
    if (!some) co_return make_error_code(errc::timed_out);
  }
  hal::Turn turn = std::move(looks_.front());
  looks_.pop_front();
  co_return turn;
}

hal::Task<hal::Result<hal::Profile>> UdpScanner::next_profile() {
  const auto turn = co_await next_turn();
  if (!turn) co_return turn.error();
  co_return hal::level_profile(*turn);
}

bool UdpScanner::is_new(double step_s, double period_s, double late_s) {
  if (step_s == 0) return watch_.repeated("a packet"), false;
  if (step_s < 0) return watch_.out_of_order(), false;
  const double steps = step_s / period_s;
  const bool gap = steps > 1.5 && std::abs(steps - std::round(steps)) < 0.2;
  const auto lost = gap ? static_cast<std::uint64_t>(std::llround(steps)) - 1 : 0;
  lost_ += lost;
  watch_.came(step_s, period_s, late_s, lost);
  return fresh_ = true;
}

hal::Task<void> UdpScanner::watch() {
  for (;;) {
    co_await clock_.sleep_for(kSilence / 2);
    if (clock_.now() - last_packet_ < kSilence) continue;
    if (!troubles_.has(kForeign))
      troubles_.set(kSilent,
                    "for " + std::to_string((clock_.now() - last_packet_) / 1s) + " s and more");
    state_ = DeviceState::lost;
  }
}

hal::Task<hal::Result<hal::ScanCloud>> UdpScanner::scan() {
  problem_.clear();
  const hal::Time deadline = clock_.now() + kComeBack;
  while (state_ != DeviceState::running) {
    const bool changed = co_await changed_.wait_until(clock_, deadline);
    if (!changed) co_return make_error_code(errc::not_connected);
  }
  const std::uint64_t packets = packets_, lost = lost_;
  begin();
  merge_.emplace(pattern());
  const hal::Duration patience = hal::from_seconds(2 * turn_s() * config_.turns) + 2s;
  const bool complete = co_await done_.wait_until(clock_, clock_.now() + patience);
  TurnMerge merged = std::move(*merge_);
  merge_.reset();
  if (!complete) co_return make_error_code(errc::timed_out);
  const double lost_now = static_cast<double>(lost_ - lost);
  const double share = lost_now / (lost_now + static_cast<double>(packets_ - packets));
  if (share > config_.lost_share_max) {
    problem_ = std::to_string(lost_ - lost) + " packets are lost";
    co_return make_error_code(errc::io_error);
  }
  co_return merged.take(last_packet_);
}

}  // namespace drivers
