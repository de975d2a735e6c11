#include "drivers/ntrip.hpp"

#include <GeographicLib/Geocentric.hpp>
#include <algorithm>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <cmath>
#include <cstdio>
#include <utility>

#include "drivers/nmea_codec.hpp"
#include "drivers/rtcm3.hpp"
#include "drivers/text.hpp"

namespace drivers {
namespace {

using namespace std::chrono_literals;
using boost::asio::experimental::awaitable_operators::operator||;

constexpr hal::Duration kPauseFirst = 1s, kPauseMax = 60s;
constexpr hal::Duration kConnect = 20s;  // The link tries by itself.
constexpr hal::Duration kAnswer = 10s;
constexpr hal::Duration kTable = 3s;
constexpr std::size_t kTableMax = 1U << 18;
constexpr std::size_t kNamesMax = 5;  // Of mountpoints, in a text for a person.
constexpr hal::Duration kTellPosition = 10s;
constexpr hal::Duration kRecent = 5s;
constexpr double kSlowPeriods = 2.5;
constexpr hal::Duration kForget = 50ms;
constexpr std::uint32_t kHalfRange = 1U << 29;  // Of epochs as sent.
constexpr double kWeek_s = 604'800;

constexpr Fault kStarting{1, "no corrections yet", "the caster was just asked", "wait"};
constexpr Fault kUnreached{2, "caster not reached", "no network, or a wrong address",
                           "check the robot's network and the link in [corrections]"};
constexpr Fault kLost{3, "caster lost", "the network, or the caster ended the connection",
                      "wait: it asks again; if it comes back often, check the network"};
constexpr Fault kNoAnswer{4, "caster does not answer",
                          "it is overloaded, or something else is there",
                          "check address and port in [corrections]; the usual port is 2101"};
constexpr Fault kForeign{5, "not a caster", "another server answers at that address",
                         "correct address and port in [corrections]; the usual port is 2101"};
constexpr Fault kUnauthorised{6, "caster refuses user or password",
                              "a wrong or expired account, or one that is in use elsewhere",
                              "correct the credentials file; ask who runs the caster"};
constexpr Fault kNoMountpoint{
    7, "no such mountpoint", "misspelt, renamed, or its base is off",
    "correct the mountpoint in [corrections]; the caster's table of sources lists them"};
constexpr Fault kRefused{8, "caster refuses", "see the detail", "ask who runs the caster"};
constexpr Fault kBroken{9, "caster's answer damaged", "something in between changes what it sends",
                        "set version = 1 in [corrections]; take proxies away"};
constexpr Fault kSilent{10, "caster sends nothing",
                        "its base is off, or the mountpoint is of a network that must be told "
                        "where the robot is",
                        "set tells_position in [corrections] for a network; else try another "
                        "mountpoint"};
constexpr Fault kNoRtcm{11, "no RTCM 3 in what the caster sends",
                        "the mountpoint has another format",
                        "choose a mountpoint of format RTCM 3"};
constexpr Fault kNoPosition{12, "no position for the caster",
                            "the network waits to be told where the robot is, and there is no fix",
                            "give the antenna a clear sky"};
constexpr Fault kDamaged{13, "corrections damaged", "the checksums of RTCM frames do not fit",
                         "check what is between caster and robot, the base's own radio first"};
constexpr Fault kRepeated{14, "corrections repeated or out of order",
                          "something in between sends them twice", "use one way to the caster"};
constexpr Fault kFrozen{15, "corrections frozen", "frames come, but their time stands still",
                        "ask who runs the base; choose another mountpoint"};
constexpr Fault kSlow{16, "corrections slow", "a poor network, or a base with a long period",
                      "improve the radio's reception; choose a base that sends every second"};
constexpr Fault kOld{17, "corrections old", "a slow network or server holds them back",
                     "improve the radio's reception; choose a nearer caster"};
constexpr Fault kFarBase{18, "base far away", "the mountpoint is of another region",
                         "choose a mountpoint within 30 km"};

std::string rounded(double value, int digits) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

std::uint32_t checksum_of(ByteView frame) {
  const ByteView end = frame.last(3);
  return std::uint32_t{end[0]} << 16 | std::uint32_t{end[1]} << 8 | end[2];
}

Eigen::Vector3d ecef_m(const GnssEpoch& epoch) {
  Eigen::Vector3d at;
  GeographicLib::Geocentric::WGS84().Forward(epoch.latitude->deg(), epoch.longitude->deg(),
                                             epoch.altitude_ellipsoid_m.value_or(0), at.x(), at.y(),
                                             at.z());
  return at;
}

// What a table of sources says to who asked for `wanted`.
struct TableTold {
  std::vector<std::string> others;
  std::size_t count{};
  std::optional<NtripSource> listed;

  void line(std::string_view text, const std::string& wanted) {
    const auto source = ntrip_source(text);
    if (!source) return;
    ++count;
    if (source->mountpoint == wanted) listed = source;
    if (others.size() < kNamesMax) others.push_back(source->mountpoint.substr(0, 40));
  }
  std::string text() const {
    if (listed)
      return "it is in the table, as " + listed->format.substr(0, 40) + ", but not served";
    if (others.empty()) return "the caster has none at all";
    std::string all = "there is ";
    for (const std::string& other : others) all += (&other == &others[0] ? "" : ", ") + other;
    return count > others.size() ? all + " and " + std::to_string(count - others.size()) + " more"
                                 : all;
  }
};

}  // namespace

NtripClient::NtripClient(NtripConfig config, hal::Clock& clock, hal::ByteStream& link,
                         DropLink drop)
    : config_(std::move(config)),
      clock_(clock),
      link_(link),
      drop_(std::move(drop)),
      pause_(kPauseFirst, kPauseMax) {}

std::string NtripClient::where() const {
  return config_.request.host + ":" + std::to_string(config_.request.port) + "/" +
         config_.request.mountpoint;
}

// One reason at a time; null: they come.
void NtripClient::name(const Fault* why, std::string detail) {
  if (why == nullptr && why_ == nullptr) return;
  why_ = why;
  troubles_.clear();
  if (why_ != nullptr) troubles_.set(*why_, detail.empty() ? where() : std::move(detail));
}

hal::Task<void> NtripClient::run() {
  state_ = DeviceState::running;
  name(&kStarting);
  for (;;) {
    const std::uint64_t before = frames_;
    co_await attempt();
    if (frames_ != before) pause_.reset();
    co_await begin_anew();
  }
}

// What still comes belongs to the last answer, and so does the news that the connection was lost.
hal::Task<void> NtripClient::begin_anew() {
  const hal::Duration pause = pause_.next();
  co_await (discard() || clock_.sleep_for(pause));
  if (lost_ || !drop_) co_return;
  drop_();
  co_await (discard() || clock_.sleep_for(kForget));
}

hal::Task<void> NtripClient::discard() {
  for (;;) {
    const auto size = co_await link_.read_some(piece_);
    if (size) continue;
    lost_ = true;
    co_await clock_.sleep_for(100ms);
  }
}

hal::Task<void> NtripClient::attempt() {
  const bool asked = co_await ask();
  if (!asked) co_return;
  NtripAnswer answer;
  const hal::Time late = clock_.now() + kAnswer;
  while (answer.verdict() == NtripVerdict::pending) {
    const bool more = co_await read(late);
    if (!more) name(lost_ ? &kLost : &kNoAnswer);
    if (!more) co_return;
    answer.feed(got());
  }
  if (answer.verdict() != NtripVerdict::stream) {
    co_await refused(answer);
    co_return;
  }
  begin_stream();
  take(answer.body());
  co_await (receive(answer) || tell_position() || watch());
}

hal::Task<bool> NtripClient::ask() {
  lost_ = false;
  const auto at = config_.tells_position ? position() : std::nullopt;
  position_told_ = at && config_.request.version == NtripVersion::v2;
  const std::string request = ntrip_request(config_.request, at ? nmea_gga(*at) : std::string());
  const hal::Time late = clock_.now() + kConnect;
  for (;;) {
    const auto sent = co_await link_.write(as_bytes(request));
    if (sent) break;
    if (clock_.now() >= late) {
      name(&kUnreached);
      co_return false;
    }
    co_await clock_.sleep_for(200ms);
  }
  ++requests_;
  co_return true;
}

// Keeps what it read even when nobody asks for it any more.
hal::Task<void> NtripClient::fill() {
  const auto size = co_await link_.read_some(piece_);
  lost_ = !size;
  got_ = size ? *size : 0;
}

// True when bytes came.
hal::Task<bool> NtripClient::read(hal::Time deadline) {
  got_ = 0;
  co_await (fill() || clock_.sleep_until(deadline));
  co_return got_ > 0;
}

hal::Task<void> NtripClient::refused(NtripAnswer& answer) {
  const std::string said = where() + ": \"" + answer.status() + "\"";
  switch (answer.verdict()) {
    case NtripVerdict::unauthorised:
      name(&kUnauthorised, said);
      break;
    case NtripVerdict::not_found:
      name(&kNoMountpoint, said);
      break;
    case NtripVerdict::source_table:
      co_await look_into_table(answer);
      break;
    case NtripVerdict::foreign:
      name(&kForeign, said);
      break;
    default:
      name(&kRefused, said);
  }
}

hal::Task<void> NtripClient::look_into_table(NtripAnswer& answer) {
  TableTold table;
  std::string line;
  const hal::Time late = clock_.now() + kTable;
  for (std::size_t size = 0; size < kTableMax;) {
    size += answer.body().size();
    for (const char c : as_text(answer.body())) {
      if (c != '\n' && line.size() < 1024) line += c;
      if (c == '\n') table.line(std::exchange(line, {}), config_.request.mountpoint);
    }
    if (answer.ended() || answer.broken()) break;
    const bool more = co_await read(late);
    if (!more) break;
    answer.feed(got());
  }
  name(&kNoMountpoint, where() + ": " + table.text());
}

void NtripClient::begin_stream() {
  identity_ = {"NTRIP caster", config_.request.mountpoint, {}, {}};
  resync_.emplace(kGnssFrameMax);
  bytes_ = bytes_at_frame_ = 0;
  damaged_told_ = 0;
  frame_at_ = epoch_at_ = clock_.now();
  damaged_at_ = again_at_ = hal::Time{};
  last_.clear();
  lead_.reset();
  gap_s_ = 0;
}

hal::Task<void> NtripClient::receive(NtripAnswer& answer) {
  for (;;) {
    if (answer.broken()) {
      name(&kBroken);
      co_return;
    }
    const hal::Time late = frame_at_ + config_.silence;
    bool more = false;
    if (!answer.ended()) more = co_await read(late);
    if (lost_ || answer.ended()) {
      name(&kLost);
      co_return;
    }
    if (!more || clock_.now() >= late) {
      name_silence();
      co_return;
    }
    answer.feed(got());
    take(answer.body());
  }
}

void NtripClient::name_silence() {
  const std::uint64_t bytes = bytes_ - bytes_at_frame_;
  if (bytes > 0)
    name(&kNoRtcm, where() + ": no frame in " + std::to_string(bytes) + " bytes");
  else if (config_.tells_position && !position_told_)
    name(&kNoPosition);
  else
    name(&kSilent, where() + ": nothing for " + std::to_string(config_.silence / 1s) + " s");
}

void NtripClient::take(ByteView body) {
  bytes_ += body.size();
  resync_->feed(body);
  while (const auto frame = resync_->next(look_gnss))
    if (gnss_kind(*frame) == GnssKind::rtcm3) take_frame(*frame);
}

void NtripClient::take_frame(ByteView frame) {
  ++frames_;
  frame_at_ = clock_.now();
  bytes_at_frame_ = bytes_;
  name(nullptr);
  note_epoch(frame);
  note_base(frame);
  put(frame);
}

void NtripClient::put(ByteView frame) {
  if (waiting_.size() == kFramesMax) {
    waiting_.erase(waiting_.begin() + (front_at_ > 0 ? 1 : 0));
    ++frames_lost_;
  }
  waiting_.emplace_back(frame.begin(), frame.end());
  ready_.notify();
}

void NtripClient::note_epoch(ByteView frame) {
  const auto epoch = rtcm3_epoch(frame);
  if (!epoch) return;
  const LastOfType now{epoch->raw, checksum_of(frame)};
  const auto [known, first] = last_.try_emplace(epoch->type, now);
  const LastOfType before = known->second;
  const std::uint32_t back = before.epoch_raw - now.epoch_raw;
  const bool again = !first && back == 0 && before.checksum == now.checksum;
  const bool earlier = !first && back > 0 && back < kHalfRange;
  again_ += again || earlier;
  if (again || earlier || (!first && back == 0)) return;  // Some bases send an epoch in parts.
  known->second = now;
  if (!lead_) lead_ = epoch->type;
  if (*lead_ != epoch->type) return;
  if (!first) gap_s_ = hal::seconds(clock_.now() - epoch_at_);
  epoch_at_ = clock_.now();
  age_s_.reset();
  const auto here = position();
  if (!epoch->tow_ms || !here || !here->itow_ms) return;
  const auto behind_ms = std::int64_t{*here->itow_ms} - std::int64_t{*epoch->tow_ms};
  age_s_ = std::remainder(static_cast<double>(behind_ms) / 1e3, kWeek_s);
}

void NtripClient::note_base(ByteView frame) {
  const auto base_m = rtcm3_base_m(frame);
  const auto here = position();
  if (!base_m || !here) return;
  base_distance_m_ = (*base_m - ecef_m(*here)).norm();
}

std::optional<GnssEpoch> NtripClient::position() const {
  if (!position_) return std::nullopt;
  GnssEpoch epoch = position_();
  const bool told = epoch.usable() && epoch.time_of_day_ns;
  return told ? std::optional(std::move(epoch)) : std::nullopt;
}

hal::Task<void> NtripClient::tell_position() {
  for (;;) {
    const auto at = config_.tells_position ? position() : std::nullopt;
    if (at) {
      const std::string sentence = nmea_gga(*at);
      const auto sent = co_await link_.write(as_bytes(sentence));
      position_told_ |= sent.has_value();
    }
    const hal::Duration pause = at ? kTellPosition : hal::Duration(1s);
    co_await clock_.sleep_for(pause);
  }
}

hal::Task<void> NtripClient::watch() {
  for (;;) {
    co_await clock_.sleep_for(1s);
    judge();
  }
}

void NtripClient::judge() {
  const hal::Time now = clock_.now();
  const auto& skipped = resync_->skipped();
  const auto damaged = skipped.find("RTCM3 checksum");
  const std::uint64_t times = damaged == skipped.end() ? 0 : damaged->second.times;
  if (std::exchange(damaged_told_, times) != times) damaged_at_ = now;
  if (std::exchange(again_told_, again_) != again_) again_at_ = now;
  const auto recent = [&](hal::Time at) { return at != hal::Time{} && now - at < kRecent; };
  troubles_.set_if(recent(damaged_at_), kDamaged,
                   std::to_string(times) + " frames since it was asked");
  const bool still = lead_ && now - epoch_at_ > kRecent && now - frame_at_ < kRecent;
  troubles_.set_if(still, kFrozen, rounded(hal::seconds(now - epoch_at_), 0) + " s");
  troubles_.set_if(!still && recent(again_at_), kRepeated,
                   std::to_string(again_) + " frames since the start");
  troubles_.set_if(gap_s_ > kSlowPeriods * config_.period_s, kSlow,
                   "every " + rounded(gap_s_, 1) + " s");
  troubles_.set_if(age_s_ && *age_s_ > config_.late_s, kOld, rounded(age_s_.value_or(0), 1) + " s");
  const bool far = base_distance_m_ && *base_distance_m_ > config_.base_distance_max_m;
  troubles_.set_if(far, kFarBase, rounded(base_distance_m_.value_or(0) / 1e3, 0) + " km");
}

std::string NtripClient::condition() const {
  if (frames_ == 0) return {};
  std::string text = std::to_string(frames_) + " frames";
  if (age_s_) text += ", the last " + rounded(*age_s_, 1) + " s old when it came";
  if (base_distance_m_) text += ", base " + rounded(*base_distance_m_ / 1e3, 1) + " km away";
  return text;
}

hal::Task<hal::Result<std::size_t>> NtripClient::read_some(std::span<std::uint8_t> into) {
  while (waiting_.empty()) co_await ready_.wait();
  const Bytes& front = waiting_.front();
  const std::size_t size = std::min(into.size(), front.size() - front_at_);
  std::copy_n(front.begin() + static_cast<std::ptrdiff_t>(front_at_), size, into.begin());
  front_at_ += size;
  if (front_at_ == front.size()) {
    waiting_.pop_front();
    front_at_ = 0;
  }
  co_return size;
}

hal::Task<hal::Result<void>> NtripClient::write(std::span<const std::uint8_t>) {
  co_return boost::system::errc::make_error_code(boost::system::errc::operation_not_supported);
}

}  // namespace drivers
